#include "client/service/watch_teller.h"

#include "client/output/progress.h"

namespace oblique::client {

std::string WatchTeller::wait_to_tell(const protocol::StudyStatus& status, Seconds elapsed) {
  if (status.waits_for() != reason_) {
    reason_ = status.waits_for();
    reason_since_ = elapsed;
  }
  const bool is_settled = reason_.empty() || elapsed - reason_since_ >= kWaitIsTold;
  if (!is_settled || reason_ == told_reason_) {
    return {};
  }
  told_reason_ = reason_;
  return reason_.empty() ? "The study goes on." : "The study waits for " + reason_ + ".";
}

std::string WatchTeller::update(const protocol::StudyStatus& status, Seconds elapsed) {
  auto sentence = wait_to_tell(status, elapsed);
  const std::uint64_t settled = status.solved() + status.failed();
  if (settled != settled_ || !status.waits_for().empty()) {
    settled_ = settled;
    settled_since_ = elapsed;
    told_without_ = false;
  } else if (sentence.empty() && !told_without_ && elapsed - settled_since_ >= kLongWithout) {
    told_without_ = true;
    sentence = "Nothing was solved for " + shown_duration(kLongWithout.count()) +
               ": is a server at work on this study, with workers?";
  }
  return sentence;
}

}  // namespace oblique::client
