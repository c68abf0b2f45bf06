#include "server/service/workers_desk.h"

#include <algorithm>
#include <bit>
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
constexpr std::uint32_t kMostThreads = 4096;
/// A worker says hello once on a connection.
constexpr std::uint32_t kMostHellos = 8;

/// What a stranger says of itself, fit for logs and tables.
std::string plain(const std::string& text) {
  std::string kept = protocol::shortened(text, kLongestWorkerText);
  std::replace_if(
      kept.begin(), kept.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, '?');
  return kept;
}

/// The points that a filter leaves out; nothing where the message has no ranges of points.
std::optional<IntervalSet> left_out_of(const protocol::Results& message) {
  IntervalSet points;
  if (message.left_out_size() % 2 != 0 ||
      message.left_out_size() > 2 * protocol::kMostLeftOutRanges) {
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

}  // namespace

WorkersDesk::WorkersDesk(WorkersDeskSettings settings, ToWorkers& network, ToLog& log,
                         BadFrames& bad_frames, const WriteLedger& ledger)
    : settings_(std::move(settings)),
      network_(network),
      log_(log),
      bad_frames_(bad_frames),
      ledger_(ledger) {}

Heard WorkersDesk::take(const std::string& identity, std::string_view frame, Instant now,
                        const std::string& key) {
  Heard heard;
  if (!protocol::is_of_a_workers_size(frame)) {
    oversized(identity, heard);
    return heard;
  }
  protocol::WorkerMessage message;
  using Kind = protocol::WorkerMessage;
  if (!protocol::decode(frame, message) || message.kind_case() == Kind::KIND_NOT_SET) {
    bad_frames_.count("a worker");
    return heard;
  }
  if (message.kind_case() == Kind::kHello) {
    hello(identity, message.hello(), now, key, heard);
    return heard;
  }
  const auto known = ids_.find(identity);
  if (known == ids_.end()) {
    if (message.kind_case() != Kind::kGoodbye) {
      protocol::ServerToWorker again;
      again.mutable_hello_again();
      network_.to_worker(identity, again);
    }
    return heard;
  }
  const WorkerId worker = known->second;
  switch (message.kind_case()) {
    case Kind::kCredit:
      heard.events.emplace_back(CreditGiven{worker, message.credit().batches()});
      break;
    case Kind::kResults:
      results(worker, std::move(*message.mutable_results()), heard);
      break;
    case Kind::kHeartbeat: {
      const auto& leases = message.heartbeat().lease_ids();
      heard.events.emplace_back(HeartbeatReceived{worker, {leases.begin(), leases.end()}});
      protocol::ServerToWorker reply;
      reply.mutable_heartbeat_reply();
      network_.to_worker(identity, reply);
      workers_.at(worker).was_told = true;
      break;
    }
    case Kind::kGiveBack: {
      const auto& leases = message.give_back().lease_ids();
      heard.events.emplace_back(BatchesReturned{worker, {leases.begin(), leases.end()}});
      break;
    }
    case Kind::kTrace:
      heard.events.emplace_back(CreditGiven{worker, 0});  // it lives
      heard.trace_of = worker;
      heard.trace = std::move(*message.mutable_trace());
      break;
    case Kind::kGoodbye:
      note(Severity::kInfo, fmt::format("worker {} leaves", worker), now);
      forget(worker);
      heard.events.emplace_back(WorkerLeft{worker});
      break;
    case Kind::kHello:
    case Kind::KIND_NOT_SET:
      break;
  }
  return heard;
}

void WorkersDesk::hello(const std::string& identity, const protocol::WorkerHello& hello,
                        Instant now, const std::string& key, Heard& heard) {
  if (ledger_.takes_no_worker()) {
    return;  // it says it again
  }
  std::uint32_t hellos = 1;
  if (const auto known = ids_.find(identity); known != ids_.end()) {
    const WorkerId old = known->second;
    hellos = workers_.at(old).hellos + 1;
    if (hellos > kMostHellos) {
      bad_frames_.count("a worker");
      return;
    }
    // It begins anew, and so do we: what it held is free again.
    forget(old);
    heard.events.emplace_back(WorkerLeft{old});
  }
  if (refuse(identity, hello)) {
    return;
  }
  const WorkerId id = ++settings_.last_worker_id;
  WorkerRecord worker{identity,
                      plain(hello.name()),
                      std::clamp(hello.threads(), 1U, kMostThreads),
                      plain(hello.solver_version()),
                      plain(hello.instruction_set()),
                      iso_8601(now),
                      hellos,
                      key,
                      now.steady_ms};
  worker.host = plain(hello.host());
  if (!welcome(id, worker)) {
    return;
  }
  note(Severity::kInfo,
       fmt::format("worker {} ({}, {} threads{}) joins", id, worker.name, worker.threads,
                   key.empty() ? "" : ", key " + key),
       now);
  workers_.emplace(id, worker);
  ids_[identity] = id;
  tell_of_version(id, now);
  if (settings_.is_insecure) {
    notice_to(id,
              "the server runs with --insecure: whoever reaches it can use it, and what is sent "
              "there is not encrypted");
  }
  if (stopping_) {
    protocol::ServerToWorker stopping;
    stopping.mutable_stopping();
    network_.to_worker(identity, stopping);
  }
  heard.events.emplace_back(WorkerJoined{
      id, worker.threads, worker.solver_version,
      protocol::shortened(hello.process_id(), kLongestWorkerText), !hello.process_id().empty()});
}

/// Says why, if there is a reason.
bool WorkersDesk::refuse(const std::string& identity, const protocol::WorkerHello& hello) {
  std::string reason = protocol::objection_to_worker(hello);
  if (reason.empty() && hello.solver_version().empty()) {
    reason = "it does not say which version its solver has";
  }
  if (reason.empty()) {
    return false;
  }
  if (std::has_single_bit(++refused_)) {
    log_.note(Severity::kWarning,
              fmt::format("a worker is refused: {} ({} refused so far)", reason, refused_));
  }
  protocol::ServerToWorker reply;
  reply.mutable_refused()->set_reason(reason);
  network_.to_worker(identity, reply);
  return true;
}

/// False when the worker is gone already.
bool WorkersDesk::welcome(WorkerId id, const WorkerRecord& worker) {
  protocol::ServerToWorker reply;
  auto& welcome = *reply.mutable_welcome();
  welcome.set_protocol_version(protocol::kProtocolVersion);
  welcome.set_worker_id(id);
  welcome.set_heartbeat_interval_ms(settings_.heartbeat_interval_ms);
  welcome.set_lost_after_ms(static_cast<std::uint32_t>(settings_.lost_after_ms));
  welcome.set_database_id(settings_.database_id);
  return network_.to_worker(worker.identity, reply) != Delivery::kGone;
}

void WorkersDesk::tell_of_version(WorkerId worker, Instant now) {
  const WorkerRecord& record = workers_.at(worker);
  if (record.solver_version == settings_.solver_version) {
    return;
  }
  const std::string text = fmt::format(
      "worker {}: its solver has version {}, the server's {}: studies with results of another "
      "version than its own go to other workers",
      worker, record.solver_version, settings_.solver_version);
  note(Severity::kWarning, text, now);
  notice_to(worker, text);
}

void WorkersDesk::results(WorkerId worker, protocol::Results message, Heard& heard) {
  if (ledger_.is_gone()) {
    return;  // not acknowledged: the worker keeps them
  }
  if (ledger_.is_flooded_by(worker)) {
    give_up(worker, "it sends more results than workers keep", heard);
    return;
  }
  std::optional<IntervalSet> left_out = left_out_of(message);
  if (!left_out) {
    give_up(worker, "it sends ranges of points that are none", heard);
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
  heard.events.emplace_back(std::move(event));
  heard.results = std::move(message);
}

/// A frame that no sound worker sends, found before it is read.
void WorkersDesk::oversized(const std::string& identity, Heard& heard) {
  const auto known = ids_.find(identity);
  if (known == ids_.end()) {
    bad_frames_.count("a worker");
  } else {
    give_up(known->second, "it sends more in one message than workers do", heard);
  }
}

/// A sound worker says hello again and delivers what it has kept.
void WorkersDesk::give_up(WorkerId worker, const std::string& why, Heard& heard) {
  bad_frames_.count();
  protocol::ServerToWorker again;
  again.mutable_hello_again();
  send(worker, again);
  heard.events.emplace_back(WorkerUnreachable{worker, why});
}

void WorkersDesk::drop(const DropWorker& drop, Instant now) {
  const WorkerRecord* record = find(drop.worker);
  note(Severity::kWarning,
       fmt::format("worker {} ({}) is lost: {}", drop.worker, record == nullptr ? "" : record->name,
                   drop.reason),
       now);
  forget(drop.worker);
}

void WorkersDesk::forget(WorkerId worker) {
  const auto known = workers_.find(worker);
  if (known != workers_.end()) {
    ids_.erase(known->second.identity);
    workers_.erase(known);
  }
}

void WorkersDesk::tick(const Silence& silent_ms, Instant now) {
  protocol::ServerToWorker sign;
  sign.mutable_heartbeat_reply();
  const std::int64_t late_ms = settings_.heartbeat_interval_ms * 5 / 4;
  for (auto& [id, worker] : workers_) {
    if (std::exchange(worker.was_told, false)) {
      worker.told_ms = now.steady_ms;
    }
    const bool is_silent = silent_ms(id) > late_ms;
    if (is_silent || now.steady_ms - worker.told_ms > late_ms) {
      // A connection that is gone, as that of a killed process, shows long before the silence
      // would. And a worker whose messages wait here must hear something too.
      send(id, sign);
    }
    if (is_silent && (!ledger_.has_room_for(id) || network_.has_unheard(worker.identity))) {
      found_.emplace_back(CreditGiven{id, 0});  // it is not silent: it is not heard
    }
    if (worker.is_busy && !network_.is_busy(worker.identity)) {
      worker.is_busy = false;
      found_.emplace_back(WorkerBusy{id, false});
    }
  }
  if (const std::uint64_t more = notes_.take_left_out(now.steady_ms); more > 0) {
    log_.note(Severity::kInfo, fmt::format("and {} more lines of workers that come and go", more));
  }
}

std::vector<Event> WorkersDesk::take_found() {
  std::vector<Event> found = std::exchange(found_, {});
  for (auto& [id, gone] : std::exchange(gone_, {})) {
    found.emplace_back(std::move(gone));
  }
  return found;
}

const WorkerRecord* WorkersDesk::find(WorkerId worker) const {
  const auto known = workers_.find(worker);
  return known == workers_.end() ? nullptr : &known->second;
}

std::optional<WorkerId> WorkersDesk::find(std::string_view identity) const {
  const auto known = ids_.find(identity);
  return known == ids_.end() ? std::nullopt : std::optional(known->second);
}

std::optional<WorkerId> WorkersDesk::next_after(WorkerId worker) const {
  const auto next = workers_.upper_bound(worker);
  return next == workers_.end() ? std::nullopt : std::optional(next->first);
}

bool WorkersDesk::needs_row(WorkerId worker) {
  return !std::exchange(workers_.at(worker).has_row, true);
}

/// Of workers that come and go any number of times.
void WorkersDesk::note(Severity severity, const std::string& text, Instant now) {
  if (notes_.allows(now.steady_ms)) {
    log_.note(severity, text);
  }
}

}  // namespace oblique::server
