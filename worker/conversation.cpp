#include "worker/conversation.h"

#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/result_message.h"

namespace oblique::worker {
namespace {

// Bounds on the heartbeat interval that a server requests.
constexpr std::int64_t kShortestInterval_ms = 10;
constexpr std::int64_t kLongestInterval_ms = 600'000;

/// Formats a duration in seconds, rounded to a tenth.
std::string seconds_of(std::int64_t duration_ms) {
  return fmt::format("{:.12g} s", std::round(static_cast<double>(duration_ms) / 100.0) / 10.0);
}

}  // namespace

// ---- Outbox -------------------------------------------------------------------------------------

void Outbox::add(protocol::Results results) {
  results.set_sequence(next_sequence_++);
  const std::size_t bytes = results.ByteSizeLong();
  results_ += static_cast<std::size_t>(results.results_size());
  bytes_ += bytes;
  messages_.push_back({std::move(results), bytes});
}

const protocol::Results* Outbox::next_to_send() {
  if (!has_waiting() || on_their_way_ >= limits_.messages_on_their_way) {
    return nullptr;
  }
  return &messages_[on_their_way_++].results;
}

template <class Predicate>
void Outbox::remove(const Predicate& is_unwanted) {
  for (std::size_t i = messages_.size(); i-- > 0;) {
    if (const Message& message = messages_[i]; is_unwanted(message.results)) {
      results_ -= static_cast<std::size_t>(message.results.results_size());
      bytes_ -= message.bytes;
      on_their_way_ -= i < on_their_way_ ? 1U : 0U;
      messages_.erase(messages_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

void Outbox::acknowledged(std::uint64_t sequence) {
  remove([&](const protocol::Results& results) { return results.sequence() == sequence; });
}

void Outbox::drop_study(std::uint64_t study_id) {
  remove([&](const protocol::Results& results) { return results.study_id() == study_id; });
}

void Outbox::drop_all() {
  remove([](const protocol::Results&) { return true; });
}

void Outbox::start_over() {
  for (Message& message : messages_) {
    message.results.set_lease_id(0);
    message.results.set_batch_done(false);
  }
  on_their_way_ = 0;
}

void Outbox::add_leases(std::set<std::uint64_t>& leases) const {
  for (const Message& message : messages_) {
    leases.insert(message.results.lease_id());
  }
}

// ---- Connecting ---------------------------------------------------------------------------------

Conversation::Conversation(protocol::WorkerHello hello, ConversationSettings settings,
                           std::string server)
    : hello_(std::move(hello)),
      settings_(std::move(settings)),
      server_(std::move(server)),
      hello_timeout_ms_(settings_.hello_timeout.shortest_ms),
      outbox_(settings_.outbox) {}

Effects Conversation::take_effects() {
  return std::exchange(effects_, {});
}

void Conversation::note(std::string text, bool is_warning) {
  effects_.emplace_back(Note{std::move(text), is_warning});
}

void Conversation::send(protocol::WorkerMessage message) {
  if (state_ == State::kWelcomed) {
    effects_.emplace_back(Send{std::move(message)});
  }
}

Effects Conversation::start(std::int64_t now_ms) {
  now_ms_ = start_ms_ = last_work_ms_ = now_ms;
  connect("");
  return take_effects();
}

void Conversation::connect(const std::string& reason) {
  effects_.emplace_back(Connect{reason});
  protocol::WorkerMessage message;
  *message.mutable_hello() = hello_;
  effects_.emplace_back(Send{std::move(message)});
  state_ = State::kGreeting;
  deadline_ms_ = now_ms_ + hello_timeout_ms_;
  backoff_ms_ = settings_.backoff.after(backoff_ms_);
}

void Conversation::connect_after_backoff(const std::string& reason) {
  server_stopping_ = false;
  if (backoff_ms_ == 0) {
    connect(reason);
    return;
  }
  if (!reason.empty()) {
    note(fmt::format("{}: trying again in {} ms", reason, backoff_ms_));
  }
  wait(backoff_ms_);
}

void Conversation::wait(std::int64_t duration_ms) {
  state_ = State::kWaiting;
  deadline_ms_ = now_ms_ + duration_ms;
}

Effects Conversation::on_send_failed(std::int64_t now_ms) {
  now_ms_ = now_ms;
  if (state_ == State::kGreeting || state_ == State::kWelcomed) {
    connect_after_backoff("a message could not be sent");
  }
  return take_effects();
}

Effects Conversation::on_rejected(const std::string& reason, std::int64_t now_ms) {
  constexpr std::int64_t kSecond_ms = 1000;
  now_ms_ = now_ms;
  if (state_ == State::kGreeting || state_ == State::kWelcomed) {
    rejected_ms_ = settings_.rejection.after(rejected_ms_);
    const bool is_known = std::exchange(rejection_, reason) == reason;
    note(fmt::format("{}trying again in {} s", is_known ? "still refused, " : reason + ": ",
                     rejected_ms_ / kSecond_ms),
         true);
    wait(rejected_ms_);
  }
  return take_effects();
}

// ---- Time ---------------------------------------------------------------------------------------

Effects Conversation::on_time(std::int64_t now_ms) {
  now_ms_ = now_ms;
  if (stopping_ && now_ms_ >= stop_deadline_ms_) {
    finish(stop_exit_code_, stop_reason_);
  }
  exit_if_due();
  const bool is_over = now_ms_ >= deadline_ms_;
  if (state_ == State::kGreeting && is_over) {
    hello_timeout_ms_ = settings_.hello_timeout.after(hello_timeout_ms_);
    if (!std::exchange(has_warned_, true)) {
      note(fmt::format(
               "no server answers at {}; trying again. Is it running there, is this its port "
               "for workers, and does a firewall let connections through?",
               server_),
           true);
    }
    connect_after_backoff("");
  } else if (state_ == State::kWaiting && is_over) {
    connect("");
  } else if (state_ == State::kWelcomed && is_over) {
    connect_after_backoff("the server is silent");
  } else if (state_ == State::kWelcomed && now_ms_ >= heartbeat_due_ms_) {
    send_heartbeat();
  }
  return take_effects();
}

std::int64_t Conversation::next_deadline_ms() const {
  if (state_ == State::kFinished) {
    return kNever_ms;
  }
  const std::int64_t stop_ms =
      stopping_ ? stop_deadline_ms_ : std::min(settings_.exit.stop_ms, idle_exit_ms());
  const std::int64_t heartbeat_ms = state_ == State::kWelcomed ? heartbeat_due_ms_ : kNever_ms;
  return std::min({deadline_ms_, stop_ms, heartbeat_ms});
}

void Conversation::send_heartbeat() {
  std::set<std::uint64_t> leases;
  for (const auto& [number, held] : held_) {
    leases.insert(held.lease_id);
  }
  outbox_.add_leases(leases);
  leases.erase(0);
  protocol::WorkerMessage message;
  message.mutable_heartbeat()->mutable_lease_ids()->Assign(leases.begin(), leases.end());
  send(std::move(message));
  heartbeat_due_ms_ = now_ms_ + heartbeat_interval_ms_;
}

// ---- Messages -----------------------------------------------------------------------------------

Effects Conversation::on_message(const protocol::ServerToWorker& message, std::int64_t now_ms) {
  now_ms_ = now_ms;
  const bool answers_hello =
      message.has_welcome() || message.has_refused() || message.has_hello_again();
  if (state_ == State::kWelcomed || (state_ == State::kGreeting && answers_hello)) {
    deadline_ms_ = now_ms_ + lost_after_ms_;
    handle(message);
  }
  return take_effects();
}

void Conversation::handle(const protocol::ServerToWorker& message) {
  using Kind = protocol::ServerToWorker;
  switch (message.kind_case()) {
    case Kind::kWelcome:
      return on(message.welcome());
    case Kind::kRefused:
      return finish(1, "the server refuses this worker: " + message.refused().reason());
    case Kind::kStudy:
      return on(message.study());
    case Kind::kBatch:
      return on(message.batch());
    case Kind::kResultsStored:
      return on(message.results_stored());
    case Kind::kWithdraw:
      return on(message.withdraw());
    case Kind::kRelease:
      return on(message.release());
    case Kind::kHelloAgain:
      return connect_after_backoff("the server does not know this worker");
    case Kind::kHeartbeatReply:
      backoff_ms_ = 0;
      return;
    case Kind::kStopping:
      // Solving continues. The socket reconnects to the restarted server, which sends HelloAgain.
      server_stopping_ = true;
      return note("the server stops");
    case Kind::kNotice:
      return note(message.notice().text());
    case Kind::kTraceOrder:
      return on(message.trace_order());
    case Kind::kTraceCancel:
      effects_.emplace_back(CancelTrace{message.trace_cancel().trace_id()});
      return;
    case Kind::KIND_NOT_SET:
      return;
  }
}

void Conversation::on(const protocol::Welcome& welcome) {
  if (state_ == State::kWelcomed) {
    return;
  }
  state_ = State::kWelcomed;
  hello_timeout_ms_ = settings_.hello_timeout.shortest_ms;
  rejected_ms_ = 0;
  rejection_.clear();
  was_welcomed_ = true;
  has_warned_ = false;
  heartbeat_interval_ms_ = std::clamp<std::int64_t>(welcome.heartbeat_interval_ms(),
                                                    kShortestInterval_ms, kLongestInterval_ms);
  lost_after_ms_ = std::clamp<std::int64_t>(welcome.lost_after_ms(), 2 * heartbeat_interval_ms_,
                                            3 * kLongestInterval_ms);
  deadline_ms_ = now_ms_ + lost_after_ms_;
  heartbeat_due_ms_ = now_ms_ + heartbeat_interval_ms_;
  server_stopping_ = false;
  note(fmt::format("welcomed as worker {}", welcome.worker_id()));

  // The server has revoked the leases of this worker and leases their points again.
  effects_.emplace_back(DropAll{});
  held_.clear();
  studies_.clear();
  open_credit_ = 0;
  if (database_id_ != welcome.database_id()) {
    if (!outbox_.is_empty()) {
      note(fmt::format("the server has another database: {} results for the last one are dropped",
                       outbox_.results()));
    }
    outbox_.drop_all();
    database_id_ = welcome.database_id();
    first_batch_of_database_ = next_batch_;
  }
  outbox_.start_over();
  go_on();
}

void Conversation::on(const protocol::StudyDefinition& definition) {
  try {
    studies_[definition.study_id()] =
        std::make_shared<const protocol::PointTable>(definition.recipe());
    uids_[definition.study_id()] = definition.uid();
  } catch (const solver::InputError& error) {
    // The server accepted this recipe, so the server's release differs from the worker's. The
    // worker stops, because otherwise the points of the study would fail.
    finish(1, fmt::format("study {} cannot be read: install the same release on server and "
                          "worker. {}",
                          definition.study_id(), error.what()));
  }
}

void Conversation::on(const protocol::Batch& batch) {
  open_credit_ -= std::min(open_credit_, 1U);
  if (stopping_) {
    return;
  }
  const auto study = studies_.find(batch.study_id());
  const auto ranges =
      study == studies_.end() ? std::nullopt : ranges_of(batch, study->second->size());
  if (!ranges) {
    connect_after_backoff("the server sent a batch with an unknown study or points");
    return;
  }
  backoff_ms_ = 0;
  held_[next_batch_] = {batch.study_id(), batch.lease_id()};
  last_work_ms_ = now_ms_;
  effects_.emplace_back(Solve{Batch(next_batch_++, batch.study_id(), *ranges, study->second,
                                    batch.attempt(), uids_[batch.study_id()])});
}

void Conversation::on(const protocol::ResultsStored& stored) {
  backoff_ms_ = 0;
  last_work_ms_ = now_ms_;
  outbox_.acknowledged(stored.sequence());
  go_on();
}

void Conversation::on(const protocol::Withdraw& withdraw) {
  effects_.emplace_back(DropStudy{withdraw.study_id()});
  std::erase_if(held_,
                [&](const auto& entry) { return entry.second.study_id == withdraw.study_id(); });
  outbox_.drop_study(withdraw.study_id());
  go_on();
}

void Conversation::on(const protocol::Release& release) {
  const auto found = std::find_if(held_.begin(), held_.end(), [&](const auto& entry) {
    return entry.second.lease_id == release.lease_id();
  });
  if (found != held_.end()) {
    effects_.emplace_back(DropBatch{found->first});
    held_.erase(found);
    give_credit();
  }
}

// ---- Solved points ------------------------------------------------------------------------------

Effects Conversation::on_progress(std::vector<Progress> progress, std::int64_t now_ms) {
  now_ms_ = now_ms;
  if (state_ != State::kFinished) {
    for (Progress& part : progress) {
      last_work_ms_ = now_ms;
      report(part);
    }
    give_credit();
  }
  return take_effects();
}

void Conversation::report(Progress& progress) {
  if (progress.batch < first_batch_of_database_) {
    return;  // in the new database this id belongs to another study
  }
  const auto found = held_.find(progress.batch);
  const bool has_lease = found != held_.end();  // false for batches of an earlier session
  const Held held = has_lease ? found->second : Held{progress.study_id, 0};
  const auto new_message = [&] {
    protocol::Results results;
    results.set_study_id(held.study_id);
    results.set_study_uid(progress.study_uid);
    results.set_lease_id(held.lease_id);
    results.set_attempt(progress.attempt);
    return results;
  };
  const double s_per_point = progress.results.empty()
                                 ? 0.0
                                 : progress.busy_s / static_cast<double>(progress.results.size());
  protocol::Results results = new_message();
  results.set_busy_s(progress.results.empty() ? progress.busy_s : 0.0);
  // Without a lease the server ignores ranges of filtered points and leases these points again.
  for (std::size_t i = 0; has_lease && i < progress.left_out.size(); ++i) {
    if (results.left_out_size() >= 2 * protocol::kMaxLeftOutRanges) {
      add_results(std::exchange(results, new_message()));
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
      add_results(std::exchange(results, new_message()));
      bytes = 0;
    }
    bytes += result_bytes;
    results.set_busy_s(results.busy_s() + s_per_point);
    *results.add_results() = std::move(result);
  }
  const bool ends_lease = progress.batch_done && has_lease;
  results.set_batch_done(ends_lease);
  if (ends_lease) {
    held_.erase(found);
  }
  if (ends_lease || results.results_size() > 0 || results.left_out_size() > 0) {
    add_results(std::move(results));
  }
}

void Conversation::add_results(protocol::Results results) {
  outbox_.add(std::move(results));
  deliver();
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
  const auto occupied = static_cast<std::uint32_t>(held_.size()) + open_credit_;
  if (state_ != State::kWelcomed || stopping_ || server_stopping_ || outbox_.has_waiting() ||
      !may_solve() || occupied >= settings_.batches_held) {
    return;
  }
  protocol::WorkerMessage message;
  message.mutable_credit()->set_batches(settings_.batches_held - occupied);
  send(std::move(message));
  open_credit_ = settings_.batches_held - static_cast<std::uint32_t>(held_.size());
}

void Conversation::go_on() {
  deliver();
  give_credit();
  finish_if_delivered();
}

// ---- Traces -------------------------------------------------------------------------------------

void Conversation::on(const protocol::TraceOrder& order) {
  last_work_ms_ = now_ms_;
  if (!stopping_) {
    effects_.emplace_back(SolveTrace{order});
    return;
  }
  protocol::WorkerMessage message;
  message.mutable_trace()->set_trace_id(order.trace_id());
  message.mutable_trace()->set_declined(true);
  send(std::move(message));
}

Effects Conversation::on_traces(std::vector<protocol::Trace> traces, std::int64_t now_ms) {
  now_ms_ = now_ms;
  for (protocol::Trace& trace : traces) {
    last_work_ms_ = now_ms;
    protocol::WorkerMessage message;
    *message.mutable_trace() = std::move(trace);
    send(std::move(message));
  }
  return take_effects();
}

// ---- The end ------------------------------------------------------------------------------------

Effects Conversation::stop(std::int64_t now_ms) {
  now_ms_ = now_ms;
  if (!stopping_) {
    stop_repeats_until_ms_ = now_ms_ + settings_.stop_repeats_ms;
    begin_stop("stopped");
  } else if (now_ms_ >= stop_repeats_until_ms_) {
    finish(0, "stopped at once");
  }
  return take_effects();
}

void Conversation::begin_stop(const std::string& reason, int exit_code) {
  stopping_ = true;
  stop_reason_ = reason;
  stop_exit_code_ = exit_code;
  stop_deadline_ms_ = now_ms_ + settings_.stop_timeout_ms;
  // The server leases returned points again. So leases are returned after all results.
  if (!outbox_.has_waiting() && !held_.empty()) {
    protocol::WorkerMessage message;
    for (const auto& [number, held] : held_) {
      message.mutable_give_back()->add_lease_ids(held.lease_id);
    }
    send(std::move(message));
  }
  effects_.emplace_back(DropAll{});
  held_.clear();
  finish_if_delivered();
}

void Conversation::finish_if_delivered() {
  if (stopping_ && outbox_.is_empty()) {
    finish(stop_exit_code_, stop_reason_);
  }
}

void Conversation::finish(int exit_code, const std::string& reason) {
  if (state_ == State::kFinished) {
    return;
  }
  if (exit_code == 0) {
    protocol::WorkerMessage message;
    message.mutable_goodbye();
    send(std::move(message));
  }
  state_ = State::kFinished;
  effects_.emplace_back(DropAll{});
  const std::string lost =
      outbox_.results() == 0
          ? ""
          : fmt::format("; {} results could not be delivered and will be solved again",
                        outbox_.results());
  effects_.emplace_back(Finish{exit_code, reason + lost});
}

/// Stops the worker at `stop_ms` or when idle. The exit code is 1 if no server ever welcomed it.
void Conversation::exit_if_due() {
  if (!held_.empty() || !outbox_.is_empty()) {
    last_work_ms_ = now_ms_;
  }
  const bool is_time = now_ms_ >= settings_.exit.stop_ms;
  if (stopping_ || state_ == State::kFinished || (!is_time && now_ms_ < idle_exit_ms())) {
    return;
  }
  if (!was_welcomed_) {
    const char* what = rejection_.empty() ? "was never reached" : "never accepted this worker";
    begin_stop(fmt::format("leaving: {} {} in {}", server_, what, seconds_of(now_ms_ - start_ms_)),
               1);
  } else if (is_time) {
    begin_stop("leaving: --until " + settings_.exit.until);
  } else {
    begin_stop(fmt::format("no work for {}: leaving (--idle-exit)",
                           seconds_of(settings_.exit.idle_exit_ms)));
  }
}

std::string Conversation::status() const {
  if (stopping_) {
    return fmt::format("stopping: {} results are to be delivered", outbox_.results());
  }
  return state_ == State::kWelcomed ? fmt::format("holds {} batches", held_.size())
                                    : "connecting to the server";
}

}  // namespace oblique::worker
