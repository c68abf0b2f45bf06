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

/// A client on its own thread. It requests the status of a study at fixed times and does not wait
/// for earlier replies.
class StatusProbe {
 public:
  struct Seen {
    std::vector<double> latencies_ms;  ///< ascending
    std::uint64_t unanswered = 0;      ///< requests
    std::uint64_t settled = 0;         ///< number of solved and failed points in the last reply
    std::uint64_t leased = 0;
    std::uint32_t workers = 0;

    /// Returns a quantile of the latencies; 0 if there are no replies.
    double quantile_ms(double share) const;
  };

  /// Starts sending requests.
  StatusProbe(std::string client_url, std::optional<protocol::KeyFile> key, std::string study,
              std::chrono::milliseconds interval);
  ~StatusProbe();
  StatusProbe(const StatusProbe&) = delete;
  StatusProbe& operator=(const StatusProbe&) = delete;

  /// Stops sending requests, waits one second for the last replies and returns the measurements.
  /// Must be called once.
  Seen stop();

 private:
  void run();

  std::string client_url_;
  std::optional<protocol::KeyFile> key_;
  std::string study_;
  std::chrono::milliseconds interval_;
  Seen seen_;  // written only by `thread_` while it runs
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace oblique::bench
