#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "proto/keys/key_file.h"

namespace oblique::bench {

struct LoadSettings {
  std::string worker_url;
  std::size_t workers = 1;
  /// Simulated time per point; with 0, workers answer at once.
  double point_s = 0.0;
  std::optional<protocol::KeyFile> key = {};  ///< the same key for all workers
};

/// Sums over all workers.
struct LoadCounts {
  std::uint64_t batches = 0;
  std::uint64_t results = 0;   ///< produced
  std::uint64_t messages = 0;  ///< sent
  std::uint64_t connects = 0;  ///< connections, including those of workers that reconnected
  std::uint64_t welcomed = 0;
  /// Longest delay of the generator's thread. If it exceeds 2 s, workers consider the server
  /// silent.
  double longest_gap_s = 0.0;
};

/// Returns the size of the result with which all points are answered.
std::size_t bytes_of_result();

/// Many simulated workers on one thread. Each has its own socket and follows the worker protocol.
/// They do not solve points, but answer all with one result that was solved beforehand.
class LoadGenerator {
 public:
  explicit LoadGenerator(const LoadSettings& settings);
  /// Closes all connections. Sends no goodbye to the server.
  ~LoadGenerator();
  LoadGenerator(const LoadGenerator&) = delete;
  LoadGenerator& operator=(const LoadGenerator&) = delete;

  LoadCounts counts() const;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace oblique::bench
