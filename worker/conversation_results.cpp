// The part of the conversation that delivers what was solved and asks for more.
#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/result_message.h"
#include "worker/conversation.h"

namespace oblique::worker {
namespace {

/// To a tenth of a second.
std::string seconds_of(std::int64_t duration_ms) {
  constexpr double kTenth_ms = 100.0;
  constexpr double kTenths = 10.0;
  return fmt::format("{:.12g} s",
                     std::round(static_cast<double>(duration_ms) / kTenth_ms) / kTenths);
}

}  // namespace

Effects Conversation::on_progress(std::vector<Progress> progress, std::int64_t now_ms) {
  now_ms_ = now_ms;
  if (state_ == State::kFinished) {
    return take_effects();
  }
  for (Progress& part : progress) {
    leaving_.note_work(now_ms);
    leaving_.note_solved({part.study_id, part.results.size() + size_of(part.left_out)},
                         part.busy_s);
    report(part);
  }
  give_back_what_takes_too_long();
  give_credit();
  return take_effects();
}

void Conversation::report(Progress& progress) {
  if (progress.batch < first_batch_of_database_) {
    return;  // the study of that number is another one now
  }
  const auto found = held_.find(progress.batch);
  // A batch of before the last welcome: what is solved is solved, but there is no lease to end.
  const Held held = found != held_.end() ? found->second : Held{progress.study_id, 0, 0, 0};
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
  results.set_busy_s(progress.results.empty() ? progress.busy_s : 0.0);
  // Without the lease of its batch the server takes no range: it hands these points out again.
  for (std::size_t i = 0; found != held_.end() && i < progress.left_out.size(); ++i) {
    if (results.left_out_size() >= 2 * protocol::kMostLeftOutRanges) {
      outbox_.add(std::exchange(results, new_message()));
      deliver();
    }
    const Batch::Range& range = progress.left_out[i];
    results.add_left_out(range.begin);
    results.add_left_out(range.end - range.begin);
  }
  std::size_t bytes = results.ByteSizeLong();
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
  if (found != held_.end()) {
    found->second.points_left -= std::min<std::uint64_t>(
        found->second.points_left, progress.results.size() + size_of(progress.left_out));
  }
  const bool ends_lease = progress.batch_done && found != held_.end();
  results.set_batch_done(ends_lease);
  if (ends_lease) {
    held_.erase(found);
  }
  if (ends_lease || results.results_size() > 0 || results.left_out_size() > 0) {
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
      !may_solve() || taken >= settings_.batches_held ||
      !leaving_.has_time_for_more(held_points(), now_ms_)) {
    return;
  }
  protocol::WorkerMessage message;
  message.mutable_credit()->set_batches(settings_.batches_held - taken);
  send(std::move(message));
  open_credit_ = settings_.batches_held - static_cast<std::uint32_t>(held_.size());
}

// ---- Traces -----------------------------------------------------------------------------------

void Conversation::on(const protocol::TraceOrder& order) {
  leaving_.note_work(now_ms_);
  if (!stopping_) {
    effects_.emplace_back(SolveTrace{order});
    return;
  }
  protocol::WorkerMessage message;
  message.mutable_trace()->set_trace_id(order.trace_id());
  message.mutable_trace()->set_not_taken(true);
  send(std::move(message));
}

Effects Conversation::on_traces(std::vector<protocol::Trace> traces, std::int64_t now_ms) {
  now_ms_ = now_ms;
  for (protocol::Trace& trace : traces) {
    leaving_.note_work(now_ms);
    protocol::WorkerMessage message;
    *message.mutable_trace() = std::move(trace);
    send(std::move(message));
  }
  return take_effects();
}

// ---- Time that is over ------------------------------------------------------------------------

std::vector<HeldPoints> Conversation::held_points() const {
  std::vector<HeldPoints> points;
  points.reserve(held_.size());
  for (const auto& [number, held] : held_) {
    points.push_back({held.study_id, held.points_left});
  }
  return points;
}

/// The batches from that number on.
void Conversation::give_back(std::uint64_t first_batch) {
  protocol::WorkerMessage message;
  for (auto held = held_.lower_bound(first_batch); held != held_.end(); ++held) {
    message.mutable_give_back()->add_lease_ids(held->second.lease_id);
  }
  if (message.has_give_back()) {
    send(std::move(message));
  }
}

/// Another worker can have what stands behind a batch that takes all the time. The first batch is
/// worked on to the end: what it gives until then counts.
void Conversation::give_back_what_takes_too_long() {
  const std::vector<HeldPoints> points = held_points();
  const std::size_t kept = std::max<std::size_t>(leaving_.ending_in_time(points, now_ms_), 1);
  if (stopping_ || kept >= held_.size()) {
    return;
  }
  const auto first = std::next(held_.begin(), static_cast<std::ptrdiff_t>(kept));
  effects_.emplace_back(Note{std::to_string(held_.size() - kept) +
                             " batches would not end before the time to leave and go back"});
  give_back(first->first);
  for (auto held = first; held != held_.end(); held = held_.erase(held)) {
    effects_.emplace_back(DropBatch{held->first});
  }
}

/// A worker that no server ever welcomed was of no use, and who started it should know.
void Conversation::leave(const std::string& reason, bool points_are_solved) {
  if (was_welcomed_) {
    begin_stop(reason, points_are_solved);
    return;
  }
  begin_stop(fmt::format("leaving: {} {} in {}", settings_.server,
                         rejection_.empty() ? "was never reached" : "never let this worker in",
                         seconds_of(now_ms_ - start_ms_)),
             points_are_solved, 1);
}

void Conversation::leave_if_due() {
  if (stopping_ || state_ == State::kFinished) {
    return;
  }
  const bool is_without_work = held_.empty() && outbox_.is_empty();
  if (!is_without_work) {
    leaving_.note_work(now_ms_);
  }
  if (leaving_.is_due(now_ms_)) {
    leave("leaving: --until " + settings_.leaving.until, !is_without_work);
  } else if (is_without_work && !leaving_.has_time_for_more({}, now_ms_)) {
    leave("leaving: no further batch would end before --until " + settings_.leaving.until, false);
  } else if (leaving_.is_idle_for_too_long(now_ms_)) {
    leave(fmt::format("no work for {}: leaving (--idle-exit)",
                      seconds_of(settings_.leaving.idle_exit_ms)),
          false);
  }
}

std::string Conversation::status() const {
  if (stopping_) {
    return "stopping: " + std::to_string(outbox_.results()) + " results are to be delivered";
  }
  return state_ == State::kWelcomed ? std::to_string(held_.size()) + " batches from the server"
                                    : "looks for the server";
}

}  // namespace oblique::worker
