#include "server/service/worker_sessions.h"

#include <algorithm>
#include <array>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/blocks.h"
#include "proto/result_message.h"
#include "proto/text.h"
#include "proto/wire/frame_scan.h"

namespace oblique::server {
namespace {

constexpr std::size_t kLongestWorkerText = 256;
constexpr std::uint32_t kMaxThreads = 4096;

/// Shortens a text from a peer and replaces its control characters, for logs and tables.
std::string plain(const std::string& text) {
  std::string kept = protocol::shortened(text, kLongestWorkerText);
  std::replace_if(
      kept.begin(), kept.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, '?');
  return kept;
}

/// Returns the left-out points in a message; nothing if its ranges are invalid.
std::optional<IntervalSet> left_out_of(const protocol::Results& message) {
  IntervalSet points;
  if (message.left_out_size() % 2 != 0 ||
      message.left_out_size() > 2 * protocol::kMaxLeftOutRanges) {
    return std::nullopt;
  }
  for (int i = 0; i < message.left_out_size(); i += 2) {
    const std::uint64_t first = message.left_out(i);
    const std::uint64_t count = message.left_out(i + 1);
    if (count == 0 || count > protocol::kMaxPoints || first > protocol::kMaxPoints - count) {
      return std::nullopt;
    }
    points.insert(first, first + count);
  }
  return points;
}

/// Returns the process before the worker's; nothing if there was none. Ignores points above a
/// limit.
std::optional<EndedProcess> ended_process(const protocol::WorkerHello& hello) {
  constexpr int kMaxNumbers = 100'000;
  if (!hello.has_replaced()) {
    return std::nullopt;
  }
  const protocol::EndedProcess& message = hello.replaced();
  EndedProcess ended{protocol::shortened(message.process_id(), kLongestWorkerText),
                     message.signal()};
  for (int i = 0; i + 1 < std::min(message.points_size(), kMaxNumbers); i += 2) {
    ended.points.emplace(message.points(i), message.points(i + 1));
  }
  return ended;
}

}  // namespace

// ---- Messages of workers -----------------------------------------------------------------------

WorkerInput WorkerSessions::frame(const std::string& identity, std::string_view frame, Instant now,
                                  const std::string& key) {
  WorkerInput input;
  const auto known = ids_.find(identity);
  protocol::WorkerMessage message;
  const bool is_small = protocol::is_worker_frame_within_limits(frame);
  const bool is_read = is_small && protocol::decode(frame, message);
  const int lease_count =
      message.heartbeat().lease_ids_size() + message.give_back().lease_ids_size();
  if (!is_small || lease_count > protocol::kMaxLeasesAHeartbeat ||
      message.results().results_size() > protocol::kMaxResultsAMessage) {
    if (known == ids_.end()) {
      log_.bad_frame("a worker");
    } else {
      disconnect(known->second, "it sent a message that exceeds the limits for workers", input);
    }
    return input;
  }
  using Kind = protocol::WorkerMessage;
  if (!is_read || message.kind_case() == Kind::KIND_NOT_SET) {
    log_.bad_frame("a worker");
    return input;
  }
  if (message.kind_case() == Kind::kHello) {
    hello(identity, message.hello(), now, key, input);
    return input;
  }
  if (known == ids_.end()) {
    if (message.kind_case() != Kind::kGoodbye) {
      protocol::ServerToWorker again;
      again.mutable_hello_again();
      ports_.to_worker(identity, protocol::encode(again));
    }
    return input;
  }
  const WorkerId worker = known->second;
  switch (message.kind_case()) {
    case Kind::kCredit:
      input.events.emplace_back(CreditGiven{worker, message.credit().batches()});
      break;
    case Kind::kResults:
      results(worker, std::move(*message.mutable_results()), input);
      break;
    case Kind::kHeartbeat: {
      const auto& leases = message.heartbeat().lease_ids();
      input.events.emplace_back(HeartbeatReceived{worker, {leases.begin(), leases.end()}});
      protocol::ServerToWorker reply;
      reply.mutable_heartbeat_reply();
      send(worker, reply);
      break;
    }
    case Kind::kGiveBack: {
      const auto& leases = message.give_back().lease_ids();
      input.events.emplace_back(BatchesReturned{worker, {leases.begin(), leases.end()}});
      break;
    }
    case Kind::kTrace:
      input.events.emplace_back(CreditGiven{worker, 0});  // counts as a sign of life of the worker
      input.trace_of = worker;
      input.trace = std::move(*message.mutable_trace());
      break;
    case Kind::kGoodbye:
      log_.write(Severity::kInfo, fmt::format("worker {} leaves", worker));
      forget(worker);
      input.events.emplace_back(WorkerLeft{worker});
      break;
    case Kind::kHello:
    case Kind::KIND_NOT_SET:
      break;
  }
  return input;
}

void WorkerSessions::hello(const std::string& identity, const protocol::WorkerHello& hello,
                           Instant now, const std::string& key, WorkerInput& input) {
  if (ledger_.is_gone() || !ledger_.has_room()) {
    return;  // the worker will send the message again
  }
  if (const auto known = ids_.find(identity); known != ids_.end()) {
    const WorkerId old = known->second;
    forget(old);  // a second WorkerHello begins a new session, so all leases end
    input.events.emplace_back(WorkerLeft{old});
  }
  protocol::ServerToWorker reply;
  if (const std::string error = refusal_reason(hello); !error.empty()) {
    log_.write(Severity::kWarning, fmt::format("a worker is refused: {}", error));
    reply.mutable_refused()->set_reason(error);
    ports_.to_worker(identity, protocol::encode(reply));
    return;
  }
  const WorkerId id = ++settings_.last_worker_id;
  auto& welcome = *reply.mutable_welcome();
  welcome.set_protocol_version(protocol::kProtocolVersion);
  welcome.set_worker_id(id);
  welcome.set_heartbeat_interval_ms(settings_.heartbeat_interval_ms);
  welcome.set_lost_after_ms(static_cast<std::uint32_t>(lost_after_ms_));
  welcome.set_database_id(settings_.database_id);
  if (ports_.to_worker(identity, protocol::encode(reply)) == Delivery::kGone) {
    return;
  }
  const WorkerRecord worker{
      identity,
      {id, plain(hello.name()), std::clamp(hello.threads(), 1U, kMaxThreads),
       plain(hello.solver_version()), plain(hello.instruction_set()), iso_8601(now)},
      key,
      plain(hello.host()),
      now.steady_ms};
  workers_.emplace(id, worker);
  ids_[identity] = id;
  log_.write(Severity::kInfo, fmt::format("worker {} ({}, {} threads{}) joins", id, worker.row.name,
                                          worker.row.threads, key.empty() ? "" : ", key " + key));
  if (stopping_) {
    send_stopping(id);
  }
  input.events.emplace_back(WorkerJoined{
      id, worker.row.threads, protocol::shortened(hello.process_id(), kLongestWorkerText),
      ended_process(hello)});
}

std::string WorkerSessions::refusal_reason(const protocol::WorkerHello& hello) const {
  std::string error = protocol::hello_error(hello);
  if (error.empty() && hello.solver_version() != settings_.solver_version) {
    error = fmt::format(
        "its solver has version {}, the server's has {}, and results of a study must come from one "
        "version: install the server's release of oblique there",
        plain(hello.solver_version()), settings_.solver_version);
  }
  return error;
}

void WorkerSessions::results(WorkerId worker, protocol::Results message, WorkerInput& input) {
  if (ledger_.is_gone()) {
    return;  // the worker keeps all results that are not acknowledged
  }
  std::optional<IntervalSet> left_out = left_out_of(message);
  if (!left_out) {
    disconnect(worker, "it sent invalid ranges of points", input);
    return;
  }
  ResultsReceived event{worker,
                        message.study_id(),
                        message.lease_id(),
                        message.sequence(),
                        message.batch_done(),
                        message.busy_s(),
                        {},
                        std::move(*left_out)};
  event.outcomes.reserve(static_cast<std::size_t>(message.results_size()));
  for (protocol::PointResult& result : *message.mutable_results()) {
    if (const std::string fault = fault_of(result); !fault.empty()) {
      result = protocol::failed_point(result.point(), fault);
    }
    event.outcomes.push_back({result.point(), !result.error().empty()});
  }
  input.events.emplace_back(std::move(event));
  input.results = std::move(message);
}

/// Disconnects the worker. A correct worker reconnects and delivers its results.
void WorkerSessions::disconnect(WorkerId worker, const std::string& why, WorkerInput& input) {
  log_.bad_frame("a worker");
  protocol::ServerToWorker again;
  again.mutable_hello_again();
  send(worker, again);
  input.events.emplace_back(WorkerUnreachable{worker, why});
}

void WorkerSessions::drop(const DropWorker& drop) {
  const WorkerRecord* record = find(drop.worker);
  log_.write(Severity::kWarning,
             fmt::format("worker {} ({}) is lost: {}", drop.worker,
                         record == nullptr ? "" : record->row.name, drop.reason));
  forget(drop.worker);
}

void WorkerSessions::forget(WorkerId worker) {
  const auto known = workers_.find(worker);
  if (known != workers_.end()) {
    ids_.erase(known->second.identity);
    workers_.erase(known);
  }
}

void WorkerSessions::tick(const Silence& silent_ms, Instant now) {
  protocol::ServerToWorker sign;
  sign.mutable_heartbeat_reply();
  const std::int64_t late_ms = settings_.heartbeat_interval_ms * 5 / 4;
  for (auto& [id, worker] : workers_) {
    if (std::exchange(worker.was_sent, false)) {
      worker.last_sent_ms = now.steady_ms;
    }
    const bool is_silent = silent_ms(id) > late_ms;
    if (is_silent || now.steady_ms - worker.last_sent_ms > late_ms) {
      // Sending detects at once whether the connection of a killed process is gone. The message is
      // also a sign of life for workers whose own messages wait to be read.
      send(id, sign);
    }
    if (is_silent && (!ledger_.has_room() || ports_.has_unread_input(worker.identity))) {
      // the worker is not silent; its messages were not read
      events_.emplace_back(CreditGiven{id, 0});
    }
    if (worker.is_busy && !ports_.is_busy(worker.identity)) {
      worker.is_busy = false;
      events_.emplace_back(WorkerBusy{id, false});
    }
  }
}

std::vector<Event> WorkerSessions::take_events() {
  std::vector<Event> events = std::exchange(events_, {});
  for (auto& [id, unreachable] : std::exchange(unreachable_, {})) {
    events.emplace_back(std::move(unreachable));
  }
  return events;
}

WorkerRecord* WorkerSessions::find(WorkerId worker) {
  const auto known = workers_.find(worker);
  return known == workers_.end() ? nullptr : &known->second;
}

// ---- Messages to workers -----------------------------------------------------------------------

void WorkerSessions::send(const SendBatch& batch) {
  protocol::ServerToWorker message;
  auto& fields = *message.mutable_batch();
  fields.set_study_id(batch.study);
  fields.set_attempt(batch.attempt);
  fields.set_lease_id(batch.lease);
  std::uint64_t reached = 0;
  for (const Interval& range : batch.points) {
    fields.add_ranges(static_cast<std::int64_t>(range.begin - reached));
    fields.add_ranges(static_cast<std::int64_t>(range.end - range.begin));
    reached = range.end;
  }
  send(batch.worker, message, batch.lease);
}

void WorkerSessions::send(const AcknowledgeResults& stored) {
  protocol::ServerToWorker message;
  message.mutable_results_stored()->set_sequence(stored.sequence);
  send(stored.worker, message);
}

void WorkerSessions::send(const WithdrawStudy& withdraw) {
  protocol::ServerToWorker message;
  message.mutable_withdraw()->set_study_id(withdraw.study);
  send(withdraw.worker, message);
}

void WorkerSessions::send(const ReleaseBatch& release) {
  protocol::ServerToWorker message;
  message.mutable_release()->set_lease_id(release.lease);
  send(release.worker, message);
}

void WorkerSessions::define(const DefineStudy& define, const StudyRecord& study) {
  protocol::StudyDefinition rest;
  rest.set_study_id(define.study);
  rest.set_uid(study.uid);
  send_frame(define.worker,
             protocol::encode_around(
                 protocol::ServerToWorker(), protocol::ServerToWorker::kStudyFieldNumber,
                 protocol::encode_around(rest, protocol::StudyDefinition::kRecipeFieldNumber,
                                         study.table.recipe_bytes())));
}

void WorkerSessions::notify_all(const std::string& text) {
  protocol::ServerToWorker message;
  message.mutable_notice()->set_text(text);
  for (const auto& [id, worker] : workers_) {
    send(id, message);
  }
}

void WorkerSessions::stop() {
  if (!std::exchange(stopping_, true)) {
    for (const auto& [id, worker] : workers_) {
      send_stopping(id);
    }
  }
}

void WorkerSessions::send_stopping(WorkerId worker) {
  protocol::ServerToWorker message;
  message.mutable_stopping();
  send(worker, message);
}

/// `lease` is the lease of the batch in the frame; 0 if the frame contains no batch. If the frame
/// cannot be delivered, adds a WorkerUnreachable or WorkerBusy event.
void WorkerSessions::send_frame(WorkerId worker, const std::string& frame, LeaseId lease) {
  const auto known = workers_.find(worker);
  if (known == workers_.end()) {
    return;
  }
  WorkerRecord& record = known->second;
  record.was_sent = true;
  const Delivery delivery = ports_.to_worker(record.identity, frame);
  if (delivery == Delivery::kGone) {
    WorkerUnreachable& unreachable =
        unreachable_.try_emplace(worker, WorkerUnreachable{worker}).first->second;
    if (lease != 0) {
      unreachable.unsent.push_back(lease);
    }
  } else if (delivery == Delivery::kBusy && !std::exchange(record.is_busy, true)) {
    events_.emplace_back(WorkerBusy{worker, true});
  }
}

}  // namespace oblique::server
