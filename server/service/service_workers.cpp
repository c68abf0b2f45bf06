// The side of the service that speaks with workers.
#include <algorithm>
#include <bit>
#include <utility>

#include "proto/frame_scan.h"
#include "proto/frames.h"
#include "proto/text.h"
#include "server/service/service.h"
#include "server/store/result_row.h"

namespace oblique::server {
namespace {

constexpr std::size_t kLongestNameKept = 256;
constexpr std::uint32_t kMostThreads = 4096;

/// What a stranger says of itself, fit for logs and tables.
std::string plain(const std::string& text) {
  std::string kept = protocol::shortened(text, kLongestNameKept);
  std::replace_if(
      kept.begin(), kept.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, '?');
  return kept;
}

/// By what the process of a worker is known again, or an empty text: by the id that it has drawn,
/// or by the name that older workers have when they are given no other one, HOST:PID.
std::string process_of(const protocol::WorkerHello& hello) {
  if (!hello.process_id().empty()) {
    return "id " + protocol::shortened(hello.process_id(), kLongestNameKept);
  }
  const std::string& name = hello.name();
  const std::size_t colon = name.rfind(':');
  const bool ends_in_number = colon != std::string::npos && colon > 0 && colon + 1 < name.size() &&
                              name.find_first_not_of("0123456789", colon + 1) == std::string::npos;
  return ends_in_number ? "name " + protocol::shortened(name, kLongestNameKept) : std::string();
}

/// A recipe of the point that every sound worker solves in a moment.
protocol::Recipe probe_recipe() {
  protocol::Recipe recipe;
  protocol::Block& block = *recipe.add_blocks();
  for (const auto& [key, value] : {std::pair{"H", 1.0}, {"mu", 0.4}, {"e", 1.0}}) {
    protocol::Axis& axis = *block.add_axes();
    axis.set_key(key);
    axis.add_values(value);
  }
  return recipe;
}

}  // namespace

void Service::worker_frame(const std::string& identity, std::string_view frame, Instant now) {
  if (!protocol::is_of_a_workers_size(frame)) {
    oversized_frame(identity, now);
    return;
  }
  protocol::WorkerMessage message;
  using Kind = protocol::WorkerMessage;
  if (!protocol::decode(frame, message) || message.kind_case() == Kind::KIND_NOT_SET) {
    bad_frame("a worker");
    return;
  }
  if (message.kind_case() == Kind::kHello) {
    hello(identity, message.hello(), now);
    return;
  }
  const auto known = worker_ids_.find(identity);
  if (known == worker_ids_.end()) {
    if (message.kind_case() != Kind::kGoodbye) {
      protocol::ServerToWorker again;
      again.mutable_hello_again();
      outbox_.to_worker(identity, again);
    }
    return;
  }
  const WorkerId worker = known->second;
  switch (message.kind_case()) {
    case Kind::kCredit:
      feed(CreditGiven{worker, message.credit().batches()}, now);
      break;
    case Kind::kResults:
      results(worker, std::move(*message.mutable_results()), now);
      break;
    case Kind::kHeartbeat: {
      const auto& leases = message.heartbeat().lease_ids();
      feed(HeartbeatReceived{worker, {leases.begin(), leases.end()}}, now);
      protocol::ServerToWorker reply;
      reply.mutable_heartbeat_reply();
      outbox_.to_worker(identity, reply);
      break;
    }
    case Kind::kGoodbye:
      note_of_worker(Severity::kInfo, "worker " + std::to_string(worker) + " leaves", now);
      feed(WorkerLeft{worker}, now);
      forget(worker);
      break;
    default:
      break;
  }
}

void Service::hello(const std::string& identity, const protocol::WorkerHello& hello, Instant now) {
  if (storage_is_gone_ || writes_.size() >= settings_.most_unstored_messages) {
    return;  // nobody is taken on while so much waits for the disk; the worker says it again
  }
  std::uint32_t hellos = 1;
  if (const auto known = worker_ids_.find(identity); known != worker_ids_.end()) {
    // A worker says it once on a connection.
    constexpr std::uint32_t kMostHellos = 8;
    hellos = peers_.at(known->second).hellos + 1;
    if (hellos > kMostHellos) {
      bad_frame("a worker");
      return;
    }
    // It begins anew, and so do we: what it held is free again.
    const WorkerId old = known->second;
    feed(WorkerLeft{old}, now);
    forget(old);
  }
  protocol::ServerToWorker reply;
  std::string reason = protocol::objection_to_version(hello.protocol_version(), "worker");
  if (reason.empty() && hello.solver_version().empty()) {
    reason = "it does not say which version its solver has";
  }
  if (!reason.empty()) {
    if (std::has_single_bit(++refused_workers_)) {
      outbox_.note(Severity::kWarning, "a worker is refused: " + reason + " (" +
                                           std::to_string(refused_workers_) + " refused so far)");
    }
    reply.mutable_refused()->set_reason(reason);
    outbox_.to_worker(identity, reply);
    return;
  }
  const WorkerId id = ++settings_.last_worker_id;
  const Peer peer{identity,
                  hello.protocol_version(),
                  plain(hello.name()),
                  std::clamp(hello.threads(), 1U, kMostThreads),
                  plain(hello.solver_version()),
                  plain(hello.instruction_set()),
                  0,
                  0,
                  hellos,
                  false,
                  iso_8601(now)};
  auto& welcome = *reply.mutable_welcome();
  welcome.set_protocol_version(peer.protocol_version);
  welcome.set_worker_id(id);
  welcome.set_heartbeat_interval_ms(settings_.heartbeat_interval_ms);
  welcome.set_lost_after_ms(static_cast<std::uint32_t>(settings_.scheduler.lost_after_ms));
  welcome.set_database_id(settings_.database_id);
  if (outbox_.to_worker(identity, reply) == Delivery::kGone) {
    return;
  }
  note_of_worker(Severity::kInfo,
                 "worker " + std::to_string(id) + " (" + peer.name + ", " +
                     std::to_string(peer.threads) + " threads) joins",
                 now);
  peers_.emplace(id, peer);
  worker_ids_[identity] = id;
  tell_of_version(id, now);
  feed(WorkerJoined{id, peer.threads, peer.solver_version, process_of(hello),
                    !hello.process_id().empty()},
       now);
  if (stopping_) {
    reply.mutable_stopping();
    outbox_.to_worker(identity, reply);
  }
}

void Service::tell_of_version(WorkerId worker, Instant now) {
  const Peer& peer = peers_.at(worker);
  if (peer.solver_version == settings_.solver_version) {
    return;
  }
  const std::string text = "its solver has version " + peer.solver_version + ", the server's " +
                           settings_.solver_version +
                           ": studies with results of another version than its own go to other "
                           "workers, unless they were submitted with --mix-versions";
  note_of_worker(Severity::kWarning, "worker " + std::to_string(worker) + ": " + text, now);
  protocol::ServerToWorker message;
  message.mutable_notice()->set_text("worker " + std::to_string(worker) + ": " + text);
  send(worker, message);
}

void Service::send_probe(const SendProbe& effect) {
  protocol::ServerToWorker definition;
  definition.mutable_study()->set_study_id(kProbeStudy);
  *definition.mutable_study()->mutable_recipe() = probe_recipe();
  send(effect.worker, definition);
  protocol::ServerToWorker batch;
  batch.mutable_batch()->set_study_id(kProbeStudy);
  batch.mutable_batch()->set_count(1);
  batch.mutable_batch()->set_attempt(1);
  batch.mutable_batch()->set_lease_id(effect.lease);
  send(effect.worker, batch);
}

void Service::results(WorkerId worker, protocol::Results message, Instant now) {
  constexpr std::size_t kWorkersThatKeepAll = 100;
  if (storage_is_gone_) {
    return;  // not acknowledged: the worker keeps them
  }
  if (peers_.at(worker).unstored_messages >= settings_.most_unstored_messages ||
      writes_.size() >= kWorkersThatKeepAll * settings_.most_unstored_messages) {
    bad_peer(worker, "it sends more results than workers keep", now);
    return;
  }
  ResultsReceived event{worker,
                        message.study_id(),
                        message.lease_id(),
                        message.sequence(),
                        message.batch_done(),
                        message.busy_s(),
                        {}};
  event.outcomes.reserve(static_cast<std::size_t>(message.results_size()));
  for (protocol::PointResult& result : *message.mutable_results()) {
    if (const std::string fault = fault_of(result); !fault.empty()) {
      result = protocol::failed_point(result.point(), fault);
    }
    event.outcomes.push_back({result.point(), !result.error().empty()});
  }
  feed(event, now, &message);
  hold_while_disk_is_behind(now);
}

void Service::forget(WorkerId worker) {
  const auto peer = peers_.find(worker);
  if (peer != peers_.end()) {
    worker_ids_.erase(peer->second.identity);
    peers_.erase(peer);
  }
}

/// A frame that no sound worker sends, found before it is read.
void Service::oversized_frame(const std::string& identity, Instant now) {
  const auto known = worker_ids_.find(identity);
  if (known == worker_ids_.end()) {
    bad_frame("a worker");
  } else {
    bad_peer(known->second, "it sends more in one message than workers do", now);
  }
}

/// Of workers that come and go any number of times.
void Service::note_of_worker(Severity severity, const std::string& text, Instant now) {
  if (worker_notes_.allows(now.steady_ms)) {
    outbox_.note(severity, text);
  }
}

/// The peer is given up. A sound worker says hello again and delivers what it has kept.
void Service::bad_peer(WorkerId worker, const std::string& what, Instant now) {
  ++bad_frames_;
  protocol::ServerToWorker again;
  again.mutable_hello_again();
  send(worker, again);
  feed(WorkerUnreachable{worker, what}, now);
}

void Service::bad_frame(const std::string& who) {
  ++bad_frames_;
  // A flood of them must not become a flood of lines.
  if (std::has_single_bit(bad_frames_)) {
    outbox_.note(Severity::kWarning, who + " sent a frame that is no message (" +
                                         std::to_string(bad_frames_) + " of them so far)");
  }
}

}  // namespace oblique::server
