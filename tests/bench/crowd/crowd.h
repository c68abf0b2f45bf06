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
  /// Time that a worker takes for each point; 0: it answers at once
  double point_s = 0.0;
  std::optional<protocol::KeyFile> key = {};  ///< of all of them
};

/// Totals over all workers so far.
struct CrowdCounts {
  std::uint64_t batches = 0;
  std::uint64_t results = 0;   ///< made
  std::uint64_t messages = 0;  ///< sent by the workers
  std::uint64_t connects = 0;  ///< of all workers; more than workers: some connected again
  std::uint64_t welcomed = 0;
  /// Longest time that the thread needed to serve all workers once. Above 2 s the workers count the
  /// server as silent.
  double longest_gap_s = 0.0;
};

/// Size of the result with which every point is answered [bytes].
std::size_t bytes_of_result();

/// Many workers on one thread. Each has its own socket and conversation, as real workers have, but
/// solves nothing: it answers every point with the same result.
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
