// The part of the conversation that delivers what was solved and asks for more.
#include <utility>

#include "proto/result_message.h"
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
  if (progress.batch < first_batch_of_database_) {
    return;  // the study of that number is another one now
  }
  const auto found = held_.find(progress.batch);
  // A batch of before the last welcome: what is solved is solved, but there is no lease to end.
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
    if (result.ByteSizeLong() > settings_.most_bytes_a_result) {
      result = protocol::failed_point(result.point(), "its result is too large to send");
    }
    const std::size_t result_bytes = result.ByteSizeLong();
    const auto count = static_cast<std::size_t>(results.results_size());
    if (count == settings_.results_a_message ||
        (count > 0 && bytes + result_bytes > settings_.bytes_a_message)) {
      outbox_.add(std::exchange(results, new_message()));
      deliver();
      bytes = 0;
    }
    bytes += result_bytes;
    results.set_busy_s(results.busy_s() + s_per_point);
    *results.add_results() = std::move(result);
  }
  const bool ends_lease = progress.batch_done && found != held_.end();
  results.set_batch_done(ends_lease);
  if (ends_lease) {
    held_.erase(found);
  }
  if (ends_lease || results.results_size() > 0) {
    outbox_.add(std::move(results));
    deliver();
  }
}

void Conversation::deliver() {
  while (state_ == State::kWelcomed) {
    const protocol::Results* next = outbox_.next_to_send();
    if (next == nullptr) {
      return;
    }
    protocol::WorkerMessage message;
    *message.mutable_results() = *next;
    send(std::move(message));
  }
}

void Conversation::give_credit() {
  const auto taken = static_cast<std::uint32_t>(held_.size()) + open_credit_;
  // Points of results that still wait here must not be handed out again.
  if (state_ != State::kWelcomed || stopping_ || server_stopping_ || outbox_.has_waiting() ||
      !may_solve() || taken >= settings_.batches_held) {
    return;
  }
  protocol::WorkerMessage message;
  message.mutable_credit()->set_batches(settings_.batches_held - taken);
  send(std::move(message));
  open_credit_ = settings_.batches_held - static_cast<std::uint32_t>(held_.size());
}

}  // namespace oblique::worker
