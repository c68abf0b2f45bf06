#include "worker/conversation.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/result_message.h"

namespace oblique::worker {
namespace {

/// What a server may ask for; outside it, heartbeats would flood or never come.
constexpr std::int64_t kShortestInterval_ms = 10;
constexpr std::int64_t kLongestInterval_ms = 600'000;

/// To a tenth of a second.
std::string seconds_of(std::int64_t duration_ms) {
  return fmt::format("{:.12g} s", std::round(static_cast<double>(duration_ms) / 100.0) / 10.0);
}

}  // namespace

// ---- Outbox
// ---------------------------------------------------------------------------------------

void Outbox::add(protocol::Results results) {
  results.set_sequence(next_sequence_++);
  const std::size_t bytes = results.ByteSizeLong();
  results_ += static_cast<std::size_t>(results.results_size());
  bytes_ += bytes;
  unacknowledged_.push_back({std::move(results), bytes, false});
}

const protocol::Results* Outbox::next_to_send() {
  if (!has_waiting()) {
    return nullptr;
  }
  Message& next = unacknowledged_[on_their_way_];
  if (on_their_way_ > 0 && (on_their_way_ >= limits_.messages_on_their_way ||
                            bytes_on_their_way_ + next.bytes > limits_.bytes_on_their_way)) {
    return nullptr;
  }
  next.on_its_way = true;
  ++on_their_way_;
  bytes_on_their_way_ += next.bytes;
  return &next.results;
}

void Outbox::acknowledged(std::uint64_t sequence) {
  const auto found = std::lower_bound(unacknowledged_.begin(), unacknowledged_.end(), sequence,
                                      [](const Message& message, std::uint64_t sought) {
                                        return message.results.sequence() < sought;
                                      });
  if (found != unacknowledged_.end() && found->results.sequence() == sequence) {
    forget(*found);
    unacknowledged_.erase(found);
  }
}

void Outbox::drop_study(std::uint64_t study_id) {
  std::erase_if(unacknowledged_, [&](const Message& message) {
    const bool is_of_study = message.results.study_id() == study_id;
    if (is_of_study) {
      forget(message);
    }
    return is_of_study;
  });
}

void Outbox::drop_all() {
  unacknowledged_.clear();
  results_ = 0;
  bytes_ = 0;
  on_their_way_ = 0;
  bytes_on_their_way_ = 0;
}

void Outbox::start_over() {
  for (Message& message : unacknowledged_) {
    message.results.set_lease_id(0);
    message.results.set_batch_done(false);
    message.on_its_way = false;
  }
  on_their_way_ = 0;
  bytes_on_their_way_ = 0;
}

void Outbox::forget(const Message& message) {
  results_ -= static_cast<std::size_t>(message.results.results_size());
  bytes_ -= message.bytes;
  if (message.on_its_way) {
    --on_their_way_;
    bytes_on_their_way_ -= message.bytes;
  }
}

// ---- The conversation
// -----------------------------------------------------------------------------

Conversation::Conversation(protocol::WorkerHello hello, ConversationSettings settings,
                           std::string server)
    : hello_(std::move(hello)),
      settings_(std::move(settings)),
      server_(std::move(server)),
      hello_timeout_ms_(settings_.hello_timeout_ms),
      outbox_(settings_.outbox) {}

Effects Conversation::take_effects() {
  return std::exchange(effects_, {});
}

// ---- Connecting -------------------------------------------------------------------------------

Effects Conversation::start(std::int64_t now_ms) {
  now_ms_ = now_ms;
  start_ms_ = now_ms;
  last_work_ms_ = now_ms;
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
  backoff_ms_ =
      std::clamp(2 * backoff_ms_, settings_.shortest_backoff_ms, settings_.longest_backoff_ms);
}

void Conversation::connect_after_backoff(const std::string& reason) {
  server_stopping_ = false;
  if (backoff_ms_ == 0) {
    connect(reason);
    return;
  }
  if (!reason.empty()) {
    effects_.emplace_back(
        Note{reason + ": trying again in " + std::to_string(backoff_ms_) + " ms"});
  }
  state_ = State::kWaiting;
  deadline_ms_ = now_ms_ + backoff_ms_;
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
    rejected_ms_ =
        std::clamp(2 * rejected_ms_, settings_.shortest_rejected_ms, settings_.longest_rejected_ms);
    const bool is_known = std::exchange(rejection_, reason) == reason;
    effects_.emplace_back(Note{(is_known ? "still refused, " : reason + ": ") + "trying again in " +
                                   std::to_string(rejected_ms_ / kSecond_ms) + " s",
                               true});
    state_ = State::kWaiting;
    deadline_ms_ = now_ms_ + rejected_ms_;
  }
  return take_effects();
}

Effects Conversation::on_time(std::int64_t now_ms) {
  now_ms_ = now_ms;
  if (stopping_ && now_ms_ >= stop_deadline_ms_) {
    finish(stop_exit_code_, stop_reason_);
  }
  finish_if_delivered();
  exit_if_due();
  switch (state_) {
    case State::kGreeting:
      if (now_ms_ >= deadline_ms_) {
        // Handshake and hello may take longer than that on a long line.
        hello_timeout_ms_ = std::min(2 * hello_timeout_ms_, settings_.longest_hello_timeout_ms);
        effects_.emplace_back(ReportUnreachable{});
        connect_after_backoff("");
      }
      break;
    case State::kWaiting:
      if (now_ms_ >= deadline_ms_) {
        connect("");
      }
      break;
    case State::kWelcomed:
      if (now_ms_ >= deadline_ms_) {
        connect_after_backoff("the server is silent");
      } else if (now_ms_ >= heartbeat_due_ms_) {
        send_heartbeat();
      }
      break;
    case State::kFinished:
      break;
  }
  return take_effects();
}

std::int64_t Conversation::next_deadline_ms() const {
  if (state_ == State::kFinished) {
    return kNever_ms;
  }
  const std::int64_t last_points_ms =
      outbox_.is_empty() ? std::max(last_points_until_ms_, now_ms_ + 1) : kNever_ms;
  const std::int64_t stop_ms =
      stopping_ ? std::min(stop_deadline_ms_, last_points_ms) : std::min(exit_ms(), idle_exit_ms());
  const std::int64_t heartbeat_ms = state_ == State::kWelcomed ? heartbeat_due_ms_ : kNever_ms;
  return std::min({deadline_ms_, stop_ms, heartbeat_ms});
}

void Conversation::send_heartbeat() {
  std::set<std::uint64_t> leases;
  for (const auto& [number, held] : held_) {
    leases.insert(held.lease_id);
  }
  outbox_.for_each([&](const protocol::Results& results) { leases.insert(results.lease_id()); });
  leases.erase(0);
  protocol::WorkerMessage message;
  message.mutable_heartbeat()->mutable_lease_ids()->Assign(leases.begin(), leases.end());
  send(std::move(message));
  heartbeat_due_ms_ = now_ms_ + heartbeat_interval_ms_;
}

void Conversation::send(protocol::WorkerMessage message) {
  if (state_ == State::kWelcomed) {
    effects_.emplace_back(Send{std::move(message)});
  }
}

// ---- Messages ---------------------------------------------------------------------------------

Effects Conversation::on_message(const protocol::ServerToWorker& message, std::int64_t now_ms) {
  using Kind = protocol::ServerToWorker;
  now_ms_ = now_ms;
  const auto kind = message.kind_case();
  // Before the welcome only the answers to a hello mean anything.
  const bool answers_hello =
      kind == Kind::kWelcome || kind == Kind::kRefused || kind == Kind::kHelloAgain;
  if (state_ != State::kWelcomed && !(state_ == State::kGreeting && answers_hello)) {
    return take_effects();
  }
  deadline_ms_ = now_ms_ + lost_after_ms_;
  switch (kind) {
    case Kind::kWelcome:
      if (state_ == State::kGreeting) {  // said twice: the first one counts
        on(message.welcome());
      }
      break;
    case Kind::kRefused:
      finish(1, "the server refuses this worker: " + message.refused().reason());
      break;
    case Kind::kStudy:
      on(message.study());
      break;
    case Kind::kBatch:
      on(message.batch());
      break;
    case Kind::kResultsStored:
      on(message.results_stored());
      break;
    case Kind::kWithdraw:
      on(message.withdraw());
      break;
    case Kind::kRelease:
      on(message.release());
      break;
    case Kind::kHelloAgain:
      connect_after_backoff("the server does not know this worker");
      break;
    case Kind::kHeartbeatReply:
      backoff_ms_ = 0;
      break;
    case Kind::kStopping:
      // Batches at hand are solved and their results kept. The socket finds the server when it is
      // back, which then says HelloAgain.
      server_stopping_ = true;
      effects_.emplace_back(Note{"the server stops"});
      break;
    case Kind::kNotice:
      effects_.emplace_back(Note{message.notice().text()});
      break;
    case Kind::kTraceOrder:
      on(message.trace_order());
      break;
    case Kind::kTraceCancel:
      effects_.emplace_back(CancelTrace{message.trace_cancel().trace_id()});
      break;
    case Kind::KIND_NOT_SET:
      break;
  }
  return take_effects();
}

void Conversation::on(const protocol::Welcome& welcome) {
  state_ = State::kWelcomed;
  hello_timeout_ms_ = settings_.hello_timeout_ms;
  rejected_ms_ = 0;
  rejection_.clear();
  was_welcomed_ = true;
  heartbeat_interval_ms_ = std::clamp<std::int64_t>(welcome.heartbeat_interval_ms(),
                                                    kShortestInterval_ms, kLongestInterval_ms);
  lost_after_ms_ = std::clamp<std::int64_t>(welcome.lost_after_ms(), 2 * heartbeat_interval_ms_,
                                            3 * kLongestInterval_ms);
  deadline_ms_ = now_ms_ + lost_after_ms_;
  heartbeat_due_ms_ = now_ms_ + heartbeat_interval_ms_;
  server_stopping_ = false;
  effects_.emplace_back(Note{"welcomed as worker " + std::to_string(welcome.worker_id())});

  // The server has given up what this worker held and hands it out anew.
  effects_.emplace_back(DropAll{});
  held_.clear();
  studies_.clear();
  open_credit_ = 0;
  if (database_id_ != welcome.database_id()) {
    if (!outbox_.is_empty()) {
      effects_.emplace_back(Note{"another database: " + std::to_string(outbox_.results()) +
                                 " results for the one before are dropped"});
    }
    outbox_.drop_all();
    database_id_ = welcome.database_id();
    first_batch_of_database_ = next_batch_;
  }
  // Results go before credit, so that their points are not handed out again.
  outbox_.start_over();
  deliver();
  give_credit();
  finish_if_delivered();
}

void Conversation::on(const protocol::StudyDefinition& definition) {
  try {
    studies_[definition.study_id()] =
        std::make_shared<const protocol::PointTable>(definition.recipe());
  } catch (const solver::InputError& error) {
    // The server took this recipe, so it reads recipes otherwise than this worker does. To fail the
    // points would blame the study.
    finish(1, "study " + std::to_string(definition.study_id()) +
                  " cannot be read: install the same release on server and worker. " +
                  error.what());
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
    connect_after_backoff("a batch of points that no known study has");
    return;
  }
  backoff_ms_ = 0;
  held_[next_batch_] = {batch.study_id(), batch.lease_id(), batch.attempt()};
  last_work_ms_ = now_ms_;
  effects_.emplace_back(Solve{Batch(next_batch_++, batch.study_id(), *ranges, study->second)});
}

void Conversation::on(const protocol::ResultsStored& stored) {
  backoff_ms_ = 0;
  last_work_ms_ = now_ms_;
  outbox_.acknowledged(stored.sequence());
  deliver();
  give_credit();
  finish_if_delivered();
}

void Conversation::on(const protocol::Withdraw& withdraw) {
  effects_.emplace_back(DropStudy{withdraw.study_id()});
  std::erase_if(held_,
                [&](const auto& entry) { return entry.second.study_id == withdraw.study_id(); });
  outbox_.drop_study(withdraw.study_id());
  deliver();
  give_credit();
  finish_if_delivered();
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
  if (state_ == State::kFinished) {
    return take_effects();
  }
  for (Progress& part : progress) {
    last_work_ms_ = now_ms;
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
  results.set_busy_s(progress.results.empty() ? progress.busy_s : 0.0);
  // Without the lease of its batch the server takes no range: it hands these points out again.
  for (std::size_t i = 0; found != held_.end() && i < progress.left_out.size(); ++i) {
    if (results.left_out_size() >= 2 * protocol::kMaxLeftOutRanges) {
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
  const auto occupied = static_cast<std::uint32_t>(held_.size()) + open_credit_;
  // Points of results that still wait here must not be handed out again.
  if (state_ != State::kWelcomed || stopping_ || server_stopping_ || outbox_.has_waiting() ||
      !may_solve() || occupied >= settings_.batches_held) {
    return;
  }
  protocol::WorkerMessage message;
  message.mutable_credit()->set_batches(settings_.batches_held - occupied);
  send(std::move(message));
  open_credit_ = settings_.batches_held - static_cast<std::uint32_t>(held_.size());
}

// ---- Traces -----------------------------------------------------------------------------------

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

// ---- The end ----------------------------------------------------------------------------------

Effects Conversation::stop(std::int64_t now_ms, bool points_are_solved) {
  now_ms_ = now_ms;
  if (!stopping_) {
    stop_repeats_until_ms_ = now_ms_ + settings_.stop_repeats_ms;
    begin_stop("stopped", points_are_solved);
  } else if (now_ms_ >= stop_repeats_until_ms_) {
    finish(0, "stopped at once");
  }
  return take_effects();
}

Effects Conversation::on_solver_idle(std::int64_t now_ms) {
  now_ms_ = now_ms;
  last_points_until_ms_ = std::min(last_points_until_ms_, now_ms);
  finish_if_delivered();
  return take_effects();
}

void Conversation::begin_stop(const std::string& reason, bool points_are_solved, int exit_code) {
  stopping_ = true;
  stop_reason_ = reason;
  stop_exit_code_ = exit_code;
  stop_deadline_ms_ = now_ms_ + settings_.stop_timeout_ms;
  last_points_until_ms_ = now_ms_ + (points_are_solved ? settings_.last_points_ms : 0);
  // Points of results that still wait here must not be handed out again.
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
  if (stopping_ && outbox_.is_empty() && now_ms_ >= last_points_until_ms_) {
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
  const std::string lost = outbox_.results() == 0
                               ? ""
                               : "; " + std::to_string(outbox_.results()) +
                                     " results could not be delivered and will be solved again";
  effects_.emplace_back(Finish{exit_code, reason + lost});
}

// ---- Ending by itself ---------------------------------------------------------------------------

std::int64_t Conversation::exit_ms() const {
  return settings_.exit.until_ms == kNever_ms
             ? kNever_ms
             : settings_.exit.until_ms - settings_.exit.shutdown_grace_ms;
}

std::int64_t Conversation::idle_exit_ms() const {
  return settings_.exit.idle_exit_ms == kNever_ms ? kNever_ms
                                                  : last_work_ms_ + settings_.exit.idle_exit_ms;
}

void Conversation::exit_if_due() {
  if (stopping_ || state_ == State::kFinished) {
    return;
  }
  if (!held_.empty() || !outbox_.is_empty()) {
    last_work_ms_ = now_ms_;
  }
  if (now_ms_ >= exit_ms()) {
    exit_by_itself("leaving: --until " + settings_.exit.until);
  } else if (now_ms_ >= idle_exit_ms()) {
    exit_by_itself(fmt::format("no work for {}: leaving (--idle-exit)",
                               seconds_of(settings_.exit.idle_exit_ms)));
  }
}

/// The exit code is 1 for a worker that no server ever welcomed, so that whoever started it
/// notices.
void Conversation::exit_by_itself(const std::string& reason) {
  if (was_welcomed_) {
    begin_stop(reason, !held_.empty());
    return;
  }
  begin_stop(fmt::format("leaving: {} {} in {}", server_,
                         rejection_.empty() ? "was never reached" : "never let this worker in",
                         seconds_of(now_ms_ - start_ms_)),
             false, 1);
}

std::string Conversation::status() const {
  if (stopping_) {
    return "stopping: " + std::to_string(outbox_.results()) + " results are to be delivered";
  }
  return state_ == State::kWelcomed ? std::to_string(held_.size()) + " batches from the server"
                                    : "looks for the server";
}

}  // namespace oblique::worker
