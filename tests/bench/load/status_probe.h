#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "proto/keys/key_file.h"

namespace oblique::bench {

/// A client, on its own thread, that requests the status of a study at fixed times without waiting
/// for earlier replies.
class StatusProbe {
 public:
  struct Seen {
    std::vector<double> latencies_ms;  ///< ascending
    std::uint64_t unanswered = 0;      ///< requests
    std::uint64_t settled = 0;         ///< points with an answer, by the last reply
    std::uint64_t leased = 0;
    std::uint32_t workers = 0;

    /// Quantile of the latencies; 0 without replies.
    double quantile_ms(double share) const;
  };

  /// Starts the requests.
  StatusProbe(std::string client_url, std::optional<protocol::KeyFile> key, std::string study,
              std::chrono::milliseconds interval);
  ~StatusProbe();
  StatusProbe(const StatusProbe&) = delete;
  StatusProbe& operator=(const StatusProbe&) = delete;

  /// Ends the requests, waits one second for the last replies and returns the measurements. Call it
  /// once.
  Seen stop();

 private:
  void run();

  std::string client_url_;
  std::optional<protocol::KeyFile> key_;
  std::string study_;
  std::chrono::milliseconds interval_;
  Seen seen_;  // used by the thread until it ends
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace oblique::bench
