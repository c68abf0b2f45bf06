#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "client/verbs/doctor/report.h"

namespace oblique::client::doctor {

/// One part of the examination, on a thread of its own. A disk or a name service that does not
/// answer holds up its thread and nothing else: what `findings` gives then says so, and the program
/// must end without waiting for threads (std::_Exit).
class Examination {
 public:
  Examination(Findings if_silent, const std::function<Findings()>& examine)
      : if_silent_(std::move(if_silent)) {
    std::packaged_task<Findings()> task(examine);
    findings_ = task.get_future();
    std::thread(std::move(task)).detach();
  }

  /// Waits until `end` at most. What was thrown becomes a sentence of what cannot work.
  Findings findings(std::chrono::steady_clock::time_point end) {
    if (findings_.wait_until(end) != std::future_status::ready) {
      is_silent_ = true;
      return if_silent_;
    }
    try {
      return findings_.get();
    } catch (const std::exception& error) {
      Findings failed = if_silent_;
      failed.broken = {as_sentence(error.what())};
      return failed;
    }
  }

  /// Whether it was waited for in vain.
  bool is_silent() const { return is_silent_; }

 private:
  Findings if_silent_;
  bool is_silent_ = false;
  std::future<Findings> findings_;
};

}  // namespace oblique::client::doctor
