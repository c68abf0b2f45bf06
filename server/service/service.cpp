#include "server/service/service.h"

#include <chrono>
#include <ctime>
#include <iomanip>
#include <sstream>
#include <utility>

#include "proto/frames.h"

namespace oblique::server {

std::string iso_8601(Instant now) {
  const std::time_t seconds = static_cast<std::time_t>(now.utc_ms / 1000);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::ostringstream text;
  text << std::put_time(&parts, "%Y-%m-%dT%H:%M:%S.") << std::setw(3) << std::setfill('0')
       << now.utc_ms % 1000 << 'Z';
  return text.str();
}

Service::Service(ServiceSettings settings, Outbox& outbox, std::vector<StoredStudy> studies,
                 Instant now)
    : settings_(std::move(settings)), outbox_(outbox), scheduler_(settings_.scheduler) {
  for (StoredStudy& study : studies) {
    studies_.restore(study, now.steady_ms);
    feed(StudyAdded{study.study_id, study.table, std::move(study.settled), study.failures.size(),
                    study.state == StudyState::kCancelled, study.state == StudyState::kPaused,
                    study.share, study.solver_version, std::move(study.attempts)},
         now);
  }
}

void Service::feed(const Event& event, Instant now, protocol::Results* message) {
  handle(event, now, message);
  while (!found_.empty()) {
    const Event found = std::move(found_.back());
    found_.pop_back();
    handle(found, now, nullptr);
  }
}

void Service::handle(const Event& event, Instant now, protocol::Results* message) {
  for (const Effect& effect : scheduler_.handle(event, now.steady_ms)) {
    perform(effect, now, message);
  }
}

void Service::perform(const Effect& effect, Instant now, protocol::Results* message) {
  protocol::ServerToWorker out;
  if (const auto* define = std::get_if<DefineStudy>(&effect)) {
    define_study(*define);
  } else if (const auto* batch = std::get_if<SendBatch>(&effect)) {
    auto& fields = *out.mutable_batch();
    fields.set_study_id(batch->study);
    fields.set_model(batch->model);
    fields.set_first_point(batch->first_point);
    fields.set_count(batch->count);
    fields.set_attempt(batch->attempt);
    fields.set_lease_id(batch->lease);
    send(batch->worker, out);
  } else if (const auto* probe = std::get_if<SendProbe>(&effect)) {
    send_probe(*probe);
  } else if (const auto* store = std::get_if<StoreResults>(&effect)) {
    write_results(*store, *message, now);
  } else if (const auto* failure = std::get_if<StoreFailure>(&effect)) {
    write_failure(*failure, now);
  } else if (const auto* stored = std::get_if<AcknowledgeResults>(&effect)) {
    out.mutable_results_stored()->set_sequence(stored->sequence);
    send(stored->worker, out);
  } else if (const auto* withdraw = std::get_if<WithdrawStudy>(&effect)) {
    out.mutable_withdraw()->set_study_id(withdraw->study);
    send(withdraw->worker, out);
  } else if (const auto* release = std::get_if<ReleaseBatch>(&effect)) {
    out.mutable_release()->set_lease_id(release->lease);
    send(release->worker, out);
  } else if (const auto* drop = std::get_if<DropWorker>(&effect)) {
    const auto peer = peers_.find(drop->worker);
    note_of_worker(Severity::kWarning,
                   "worker " + std::to_string(drop->worker) + " (" +
                       (peer == peers_.end() ? "" : peer->second.name) +
                       ") is lost: " + drop->reason,
                   now);
    forget(drop->worker);
  } else if (const auto* finished = std::get_if<StudyFinished>(&effect)) {
    if (studies_.finish(finished->study)) {
      outbox_.note(Severity::kInfo, "study " + studies_.record(finished->study).name + " is done");
      write(SetStudyState{finished->study, StudyState::kDone, iso_8601(now)}, OfNothing{}, false);
    }
  }
}

void Service::send(WorkerId worker, const protocol::ServerToWorker& message) {
  const auto peer = peers_.find(worker);
  const bool is_of_version_2 = message.has_release() || message.has_notice();
  if (peer != peers_.end() && is_of_version_2 && peer->second.protocol_version < 2) {
    return;
  }
  if (peer == peers_.end()) {
    return;
  }
  note_delivery(worker, peer->second, outbox_.to_worker(peer->second.identity, message));
}

void Service::note_delivery(WorkerId worker, Peer& peer, Delivery delivery) {
  if (delivery == Delivery::kGone) {
    found_.emplace_back(WorkerUnreachable{worker});
  } else if (delivery == Delivery::kBusy && !std::exchange(peer.is_busy, true)) {
    found_.emplace_back(WorkerBusy{worker, true});
  }
}

/// The recipe goes out as it is kept: encoding a long one again for each worker would hold up the
/// others.
void Service::define_study(const DefineStudy& effect) {
  const auto peer = peers_.find(effect.worker);
  if (peer == peers_.end()) {
    return;
  }
  const std::string frame =
      protocol::definition_around(effect.study, studies_.record(effect.study).table.recipe_bytes());
  note_delivery(effect.worker, peer->second,
                outbox_.forward_to_worker(peer->second.identity, frame));
}

// ---- Time -------------------------------------------------------------------------------------

void Service::tick(Instant now) {
  look_after_workers(now);
  feed(Tick{}, now);
  tell_of_queries(now);
  if (const std::uint64_t more = worker_notes_.take_left_out(now.steady_ms); more > 0) {
    outbox_.note(Severity::kInfo,
                 "and " + std::to_string(more) + " more lines of workers that come and go");
  }
  rates_.sample([this](StudyId id) { return settled_of(id); }, now.steady_ms);
}

std::uint64_t Service::settled_of(StudyId id) const {
  const StudyCounts counts = scheduler_.study(id);
  return counts.solved + counts.failed;
}

/// Before the points of `event` count as settled.
void Service::note_rate(const ResultsStored& event, Instant now) {
  if (studies_.contains(event.study) && !event.outcomes.empty()) {
    rates_.note(event.study, settled_of(event.study), studies_.record(event.study).since_ms,
                now.steady_ms);
  }
}

void Service::look_after_workers(Instant now) {
  // A heartbeat is late: sending shows whether the connection is gone, as that of a killed process
  // is, long before the silence would. A worker whose messages wait here must hear something too.
  protocol::ServerToWorker sign;
  sign.mutable_heartbeat_reply();
  const std::int64_t late_ms = settings_.heartbeat_interval_ms * 5 / 4;
  for (auto& [id, peer] : peers_) {
    if (scheduler_.silent_ms(id, now.steady_ms) > late_ms) {
      send(id, sign);
      if (!has_room_for(peer)) {
        found_.emplace_back(CreditGiven{id, 0});  // it is not silent: it is not heard
      }
    }
    if (peer.is_busy && !outbox_.is_busy(peer.identity)) {
      peer.is_busy = false;
      found_.emplace_back(WorkerBusy{id, false});
    }
  }
}

bool Service::has_room_for(std::string_view worker) const {
  const auto known = worker_ids_.find(worker);
  return known == worker_ids_.end() || has_room_for(peers_.at(known->second));
}

bool Service::has_room_for(const Peer& peer) const {
  return peer.unstored_bytes < settings_.unstored_bytes_of_worker &&
         unstored_bytes_ < settings_.unstored_bytes;
}

void Service::hold_while_disk_is_behind(Instant now) {
  const std::size_t parts = disk_is_behind_ ? 2 : 1;
  const bool is_behind = unstored_bytes_ >= settings_.unstored_bytes_to_hold / parts ||
                         writes_.size() >= settings_.unstored_messages_to_hold / parts;
  if (is_behind != disk_is_behind_) {
    disk_is_behind_ = is_behind;
    feed(DispatchHeld{stopping_ || !storage_fault_.empty() || is_behind}, now);
  }
}

void Service::stop(Instant now) {
  stopping_ = true;
  feed(DispatchHeld{true}, now);
  for (const auto& [ticket, request] : std::exchange(long_requests_, {})) {
    reply_error(request.client, "the server is stopping: ask again when it is back");
  }
  protocol::ServerToWorker message;
  message.mutable_stopping();
  for (const auto& [id, peer] : peers_) {
    outbox_.to_worker(peer.identity, message);
  }
  for (const auto& [ticket, query] : queries_) {
    reply_error(query.client, "the server is stopping: ask again when it runs");
  }
  queries_.clear();
}

}  // namespace oblique::server
