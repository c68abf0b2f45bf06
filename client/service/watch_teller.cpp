#include "client/service/watch_teller.h"

#include <spdlog/fmt/fmt.h>

#include "client/io/progress.h"
#include "proto/study_counts.h"

namespace oblique::client {

std::string WatchTeller::wait_to_tell(const protocol::StudyStatus& status, Seconds elapsed) {
  if (status.waits_for() != reason_) {
    reason_ = status.waits_for();
    reason_since_ = elapsed;
  }
  const bool is_settled = reason_.empty() || elapsed - reason_since_ >= kShortestWait;
  if (!is_settled || reason_ == said_reason_) {
    return {};
  }
  said_reason_ = reason_;
  return reason_.empty() ? "The study goes on." : fmt::format("The study waits for {}.", reason_);
}

std::string WatchTeller::update(const protocol::StudyStatus& status, Seconds elapsed) {
  auto sentence = wait_to_tell(status, elapsed);
  const std::uint64_t settled = protocol::completed_points(status);
  if (settled != settled_ || !status.waits_for().empty()) {
    settled_ = settled;
    settled_since_ = elapsed;
    said_without_ = false;
  } else if (sentence.empty() && !said_without_ && elapsed - settled_since_ >= kLongWithout) {
    said_without_ = true;
    sentence =
        fmt::format("Nothing was solved for {}: is a server at work on this study, with workers?",
                    format_duration(kLongWithout.count()));
  }
  return sentence;
}

}  // namespace oblique::client
