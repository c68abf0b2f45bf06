#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "proto/keys/key_file.h"

namespace oblique::bench {

struct CrowdSettings {
  std::string worker_url;
  std::size_t workers = 1;
  /// What a point takes each of them; 0: nothing, they answer at once.
  double point_s = 0.0;
  std::optional<protocol::KeyFile> key = {};  ///< of all of them
};

/// What the workers together have seen so far.
struct CrowdCounts {
  std::uint64_t batches = 0;
  std::uint64_t results = 0;   ///< made
  std::uint64_t messages = 0;  ///< that they sent
  std::uint64_t connects = 0;  ///< of all workers; more than there are workers: some were dropped
  std::uint64_t welcomed = 0;
  /// So late was its thread for all of them once. Beyond 2 s they take the server for silent.
  double longest_gap_s = 0.0;
};

/// Bytes of the result that each of them answers every point with.
std::size_t bytes_of_result();

/// Many workers on one thread, each with a socket and a conversation of its own, as real ones have,
/// that solve nothing: the answer to every point is one result that was solved beforehand.
class Crowd {
 public:
  explicit Crowd(const CrowdSettings& settings);
  /// Closes all connections without taking leave of the server.
  ~Crowd();
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;

  CrowdCounts counts() const;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace oblique::bench
