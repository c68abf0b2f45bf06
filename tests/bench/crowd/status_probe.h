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

/// A client that asks a server for the status of a study at fixed times, whether the last answer
/// has come or not, on a thread of its own.
class StatusProbe {
 public:
  struct Seen {
    std::vector<double> latencies_ms;  ///< in ascending order
    std::uint64_t unanswered = 0;      ///< at the end
    std::uint64_t settled = 0;         ///< points of the study, by the last answer
    std::uint64_t leased = 0;
    std::uint32_t workers = 0;

    /// The latency that this share of the answers did not exceed; 0 without answers.
    double quantile_ms(double share) const;
  };

  /// Asks until it is stopped.
  StatusProbe(std::string client_url, std::optional<protocol::KeyFile> key, std::string study,
              std::chrono::milliseconds interval);
  ~StatusProbe();
  StatusProbe(const StatusProbe&) = delete;
  StatusProbe& operator=(const StatusProbe&) = delete;

  /// Waits a second for the last answers, and gives what was seen. To be called once.
  Seen stop();

 private:
  void run();

  std::string client_url_;
  std::optional<protocol::KeyFile> key_;
  std::string study_;
  std::chrono::milliseconds interval_;
  Seen seen_;  // of the thread until it has ended
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace oblique::bench
