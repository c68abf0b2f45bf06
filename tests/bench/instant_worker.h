#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>
#include <string>
#include <thread>

#include "worker/session.h"
#include "worker/solver/solve.h"

namespace oblique::bench {

/// A worker in this process that answers every point at once with one result, which was solved
/// beforehand.
class InstantWorker {
 public:
  explicit InstantWorker(const std::string& server_url) : stop_(eventfd(0, EFD_CLOEXEC)) {
    worker::SessionSettings settings;
    settings.server = server_url;
    settings.name = "instant";
    settings.report_interval_ms = 10;
    thread_ = std::thread([this, settings] {
      worker::Session session(settings, [this](const auto&, auto& points, const auto& take) {
        while (const auto position = points.next()) {
          take({*position, result_, {}});
        }
      });
      session.run(stop_, [] {});
    });
  }
  ~InstantWorker() {
    const std::uint64_t one = 1;
    static_cast<void>(write(stop_, &one, sizeof(one)));
    thread_.join();
    close(stop_);
  }
  InstantWorker(const InstantWorker&) = delete;
  InstantWorker& operator=(const InstantWorker&) = delete;

 private:
  const solver::CaseResult result_ = solver::Finger(solver::preset("paper")).solve(1.0, 0.4, 0.8);
  int stop_;
  std::thread thread_;
};

}  // namespace oblique::bench
