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

/// A client that requests the status of a study at fixed times, even if the last reply has not
/// arrived. It has its own thread.
class StatusProbe {
 public:
  struct Seen {
    std::vector<double> latencies_ms;  ///< in ascending order
    std::uint64_t unanswered = 0;      ///< at the end
    std::uint64_t settled = 0;         ///< points of the study, by the last answer
    std::uint64_t leased = 0;
    std::uint32_t workers = 0;

    /// Quantile of the latencies; 0 without replies.
    double quantile_ms(double share) const;
  };

  /// Sends requests until it is stopped.
  StatusProbe(std::string client_url, std::optional<protocol::KeyFile> key, std::string study,
              std::chrono::milliseconds interval);
  ~StatusProbe();
  StatusProbe(const StatusProbe&) = delete;
  StatusProbe& operator=(const StatusProbe&) = delete;

  /// Waits a second for the last replies and returns the measurements. May be called once.
  Seen stop();

 private:
  void run();

  std::string client_url_;
  std::optional<protocol::KeyFile> key_;
  std::string study_;
  std::chrono::milliseconds interval_;
  Seen seen_;  // used by the thread only, until it has ended
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace oblique::bench
