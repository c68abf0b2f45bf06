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
  const std::size_t bytes = results.ByteSizeLong();
  unacknowledged_results_ += static_cast<std::size_t>(results.results_size());
  unacknowledged_bytes_ += bytes;
  unacknowledged_.push_back({std::move(results), bytes, false});
  deliver();
}

void Conversation::deliver() {
  while (state_ == State::kWelcomed && on_their_way_ < unacknowledged_.size()) {
    Unacknowledged& next = unacknowledged_[on_their_way_];
    if (on_their_way_ > 0 && (on_their_way_ >= settings_.messages_on_their_way ||
                              bytes_on_their_way_ + next.bytes > settings_.bytes_on_their_way)) {
      return;
    }
    next.on_its_way = true;
    ++on_their_way_;
    bytes_on_their_way_ += next.bytes;
    protocol::WorkerMessage message;
    *message.mutable_results() = next.results;
    send(std::move(message));
  }
}

void Conversation::forget(std::deque<Unacknowledged>::const_iterator results) {
  unacknowledged_results_ -= static_cast<std::size_t>(results->results.results_size());
  unacknowledged_bytes_ -= results->bytes;
  if (results->on_its_way) {
    --on_their_way_;
    bytes_on_their_way_ -= results->bytes;
  }
}

bool Conversation::may_solve() const {
  return unacknowledged_results_ < settings_.unacknowledged_limit &&
         unacknowledged_bytes_ < settings_.unacknowledged_bytes_limit;
}

void Conversation::give_credit() {
  const auto taken = static_cast<std::uint32_t>(held_.size()) + open_credit_;
  // Points of results that still wait here must not be handed out again.
  const bool waits = on_their_way_ < unacknowledged_.size();
  if (state_ != State::kWelcomed || stopping_ || server_stopping_ || waits || !may_solve() ||
      taken >= settings_.batches_held) {
    return;
  }
  protocol::WorkerMessage message;
  message.mutable_credit()->set_batches(settings_.batches_held - taken);
  send(std::move(message));
  open_credit_ = settings_.batches_held - static_cast<std::uint32_t>(held_.size());
}

}  // namespace oblique::worker
