// The part of the conversation that delivers what was solved and asks for more.
#include <utility>

#include "worker/conversation.h"

namespace oblique::worker {

Effects Conversation::on_progress(std::vector<Progress> progress, std::int64_t now_ms) {
  now_ms_ = now_ms;
  if (state_ == State::kFinished) {
    return take_effects();
  }
  for (Progress& part : progress) {
    report(part);
  }
  give_credit();
  return take_effects();
}

void Conversation::report(Progress& progress) {
  if (progress.task < first_task_of_database_) {
    return;  // the study of that number is another one now
  }
  const auto found = held_.find(progress.task);
  // A task of before the last welcome: what is solved is solved, but there is no lease to end.
  const Held held = found != held_.end() ? found->second : Held{progress.study_id, 0, 0};
  const auto new_message = [&] {
    protocol::Results results;
    results.set_study_id(progress.study_id);
    results.set_lease_id(held.lease_id);
    results.set_attempt(held.attempt);
    return results;
  };
  const double s_per_point = progress.results.empty()
                                 ? 0.0
                                 : progress.busy_s / static_cast<double>(progress.results.size());
  protocol::Results results = new_message();
  std::size_t bytes = 0;
  for (protocol::PointResult& result : progress.results) {
    if (result.ByteSizeLong() > settings_.bytes_a_message) {
      result = protocol::failed_point(result.point(), "its result is too large to send");
    }
    const std::size_t result_bytes = result.ByteSizeLong();
    const auto count = static_cast<std::size_t>(results.results_size());
    if (count == settings_.results_a_message ||
        (count > 0 && bytes + result_bytes > settings_.bytes_a_message)) {
      queue_results(std::exchange(results, new_message()));
      bytes = 0;
    }
    bytes += result_bytes;
    results.set_busy_s(results.busy_s() + s_per_point);
    *results.add_results() = std::move(result);
  }
  const bool ends_lease = progress.task_done && found != held_.end();
  results.set_batch_done(ends_lease);
  if (ends_lease) {
    held_.erase(found);
  }
  if (ends_lease || results.results_size() > 0) {
    queue_results(std::move(results));
  }
}

void Conversation::queue_results(protocol::Results results) {
  results.set_sequence(next_sequence_++);
  unacknowledged_results_ += static_cast<std::size_t>(results.results_size());
  protocol::WorkerMessage message;
  *message.mutable_results() = results;
  unacknowledged_.push_back(std::move(results));
  send(std::move(message));
}

bool Conversation::may_solve() const {
  return unacknowledged_results_ < settings_.unacknowledged_limit;
}

void Conversation::give_credit() {
  const auto taken = static_cast<std::uint32_t>(held_.size()) + open_credit_;
  if (state_ != State::kWelcomed || stopping_ || server_stopping_ || !may_solve() ||
      taken >= settings_.batches_held) {
    return;
  }
  protocol::WorkerMessage message;
  message.mutable_credit()->set_batches(settings_.batches_held - taken);
  send(std::move(message));
  open_credit_ = settings_.batches_held - static_cast<std::uint32_t>(held_.size());
}

}  // namespace oblique::worker
