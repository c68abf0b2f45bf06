#include "server/service.h"

#include <chrono>
#include <ctime>
#include <iomanip>
#include <sstream>
#include <utility>

#include "proto/frames.h"

namespace oblique::server {
namespace {

/// Rates are taken over so long.
constexpr std::int64_t kRateSpan_ms = 5000;

}  // namespace

std::string iso_8601(Instant now) {
  const std::time_t seconds = static_cast<std::time_t>(now.utc_ms / 1000);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::ostringstream text;
  text << std::put_time(&parts, "%Y-%m-%dT%H:%M:%S.") << std::setw(3) << std::setfill('0')
       << now.utc_ms % 1000 << 'Z';
  return text.str();
}

std::string shortened(const std::string& text, std::size_t bytes) {
  if (text.size() <= bytes) {
    return text;
  }
  while (bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xc0U) == 0x80U) {
    --bytes;
  }
  return text.substr(0, bytes);
}

Service::Service(ServiceSettings settings, Outbox& outbox, std::vector<StoredStudy> studies,
                 Instant now)
    : settings_(std::move(settings)), outbox_(outbox), scheduler_(settings_.scheduler) {
  for (StoredStudy& study : studies) {
    if (study.state == StudyState::kDone && study.settled.size() < study.table->size()) {
      study.state = StudyState::kRunning;  // rows were lost or removed since: they are solved again
    }
    study_ids_.emplace(study.name, study.study_id);
    studies_.emplace(study.study_id, Study{study.name,
                                           study.table,
                                           study.state,
                                           study.created_at,
                                           study.share,
                                           study.failures,
                                           study.attempts,
                                           true,
                                           0,
                                           false,
                                           {},
                                           {}});
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
    out.mutable_study()->set_study_id(define->study);
    *out.mutable_study()->mutable_recipe() = studies_.at(define->study).table->recipe();
    send(define->worker, out);
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
    outbox_.note(Severity::kWarning, "worker " + std::to_string(drop->worker) + " (" +
                                         (peer == peers_.end() ? "" : peer->second.name) +
                                         ") is lost: " + drop->reason);
    forget(drop->worker);
  } else if (const auto* finished = std::get_if<StudyFinished>(&effect)) {
    Study& study = studies_.at(finished->study);
    if (study.state != StudyState::kDone) {
      study.state = StudyState::kDone;
      outbox_.note(Severity::kInfo, "study " + study.name + " is done");
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
  const Delivery delivery = outbox_.to_worker(peer->second.identity, message);
  if (delivery == Delivery::kGone) {
    found_.emplace_back(WorkerUnreachable{worker});
  } else if (delivery == Delivery::kBusy && !std::exchange(peer->second.is_busy, true)) {
    found_.emplace_back(WorkerBusy{worker, true});
  }
}

// ---- Writing ----------------------------------------------------------------------------------

void Service::write(Change change, Write meaning, bool answer_failure) {
  const std::uint64_t ticket = ++last_ticket_;
  writes_.emplace(ticket, std::move(meaning));
  waiting_changes_ += answer_failure ? 1U : 0U;
  outbox_.write({ticket, std::move(change), answer_failure});
}

void Service::write_results(const StoreResults& effect, protocol::Results& message, Instant now) {
  Peer& peer = peers_.at(effect.worker);
  const std::size_t bytes = message.ByteSizeLong();
  ++peer.unstored_messages;
  peer.unstored_bytes += bytes;
  unstored_bytes_ += bytes;
  const auto study = studies_.find(effect.study);
  AddResults change{effect.study,         study == studies_.end() ? nullptr : study->second.table,
                    effect.worker,        peer.solver_version,
                    peer.instruction_set, message.attempt(),
                    iso_8601(now),        {}};
  OfResults meaning{{effect.worker, effect.study, effect.sequence, {}}, message.attempt(), bytes};
  for (const std::size_t index : effect.accepted) {
    protocol::PointResult& result = *message.mutable_results(static_cast<int>(index));
    meaning.event.outcomes.push_back({result.point(), !result.error().empty()});
    change.results.push_back(std::move(result));
  }
  write(std::move(change), std::move(meaning), false);
}

void Service::write_failure(const StoreFailure& effect, Instant now) {
  outbox_.note(Severity::kWarning, "point " + std::to_string(effect.point) + " of study " +
                                       studies_.at(effect.study).name +
                                       " failed: " + effect.reason);
  AddResults change{effect.study,
                    studies_.at(effect.study).table,
                    0,
                    {},
                    {},
                    effect.attempt,
                    iso_8601(now),
                    {protocol::failed_point(effect.point, effect.reason)}};
  write(std::move(change),
        OfResults{{0, effect.study, 0, {{effect.point, true}}}, effect.attempt, 0}, false);
}

void Service::written(const WriteReport& report, Instant now) {
  if (report.kind == WriteReport::Kind::kFault) {
    outbox_.note(Severity::kError, "results wait, nothing is handed out: " + report.error);
    storage_fault_ = report.error;
    feed(DispatchHeld{true}, now);
    return;
  }
  if (report.kind == WriteReport::Kind::kRecovered) {
    outbox_.note(Severity::kInfo, "the database takes results again");
    storage_fault_.clear();
    feed(DispatchHeld{stopping_ || disk_is_behind_}, now);
    return;
  }
  if (report.kind == WriteReport::Kind::kGone) {
    lose_storage(report.error, now);
    return;
  }
  if (report.kind == WriteReport::Kind::kUnmerged) {
    outbox_.note(Severity::kWarning,
                 "the write-ahead log, the file beside the database that ends in -wal, is not yet "
                 "merged into it: " +
                     report.error +
                     ". Until then a copy needs both files; `oblique backup` makes one that is "
                     "whole");
    return;
  }
  const auto found = writes_.find(report.ticket);
  if (found == writes_.end()) {
    return;
  }
  const Write meaning = std::move(found->second);
  writes_.erase(found);
  const bool a_client_waits =
      !std::holds_alternative<OfResults>(meaning) && !std::holds_alternative<OfNothing>(meaning);
  waiting_changes_ -= a_client_waits ? 1U : 0U;
  if (report.kind == WriteReport::Kind::kStored) {
    stored(meaning, now);
  } else {
    refused(meaning, report.error);
  }
  hold_while_disk_is_behind(now);
}

void Service::stored(const Write& meaning, Instant now) {
  if (const auto* results = std::get_if<OfResults>(&meaning)) {
    for (const PointOutcome& outcome : results->event.outcomes) {
      if (outcome.failed) {
        Study& study = studies_.at(results->event.study);
        study.failures.insert(outcome.point);
        study.attempts.set({outcome.point, outcome.point + 1}, results->attempt);
      }
    }
    unstored_bytes_ -= results->bytes;
    if (const auto peer = peers_.find(results->event.worker); peer != peers_.end()) {
      --peer->second.unstored_messages;
      peer->second.unstored_bytes -= results->bytes;
    }
    feed(results->event, now);
  } else if (const auto* added = std::get_if<OfStudy>(&meaning)) {
    Study& study = studies_.at(added->study);
    study.durable = true;
    outbox_.note(Severity::kInfo, "study " + study.name + " of " +
                                      std::to_string(study.table->size()) + " points begins");
    feed(StudyAdded{added->study, study.table, {}, 0, false, false, study.share}, now);
    bool created = true;
    for (const Client& client : std::exchange(study.submitters, {})) {
      reply_submitted(client, added->study, std::exchange(created, false));
    }
  } else if (const auto* state = std::get_if<OfState>(&meaning)) {
    --studies_.at(state->study).state_writes;
    studies_.at(state->study).is_doubtful = false;
    outbox_.note(Severity::kInfo, "study " + studies_.at(state->study).name +
                                      (state->state == StudyState::kRunning
                                           ? std::string(" goes on")
                                           : " is " + std::string(state_name(state->state))));
    if (state->state == StudyState::kCancelled) {
      feed(StudyCancelled{state->study}, now);
    } else if (state->state == StudyState::kPaused) {
      feed(StudyPaused{state->study}, now);
    } else {
      feed(StudyReopened{state->study}, now);
    }
    if (state->submitted) {
      reply_submitted(state->client, state->study, false);
    } else {
      reply_changed(state->client, state->study, 0, now);
    }
  } else if (const auto* share = std::get_if<OfShare>(&meaning)) {
    studies_.at(share->study).share = share->share;
    feed(StudyShareChanged{share->study, share->share}, now);
    continue_study(share->client, share->study, now);
  } else if (const auto* forgotten = std::get_if<OfFailures>(&meaning)) {
    Study& study = studies_.at(forgotten->study);
    forgotten->points.for_each(
        [&](const Interval& run) { study.failures.erase(run.begin, run.end); });
    if (study.state == StudyState::kDone) {
      study.state = StudyState::kRunning;
    }
    outbox_.note(Severity::kInfo, "study " + study.name + " tries its failed points again: " +
                                      std::to_string(forgotten->points.size()));
    study.samples.clear();  // fewer points are settled now: no rate can be had of that
    feed(FailuresForgotten{forgotten->study, forgotten->points, study.attempts}, now);
    reply_changed(forgotten->client, forgotten->study, forgotten->points.size(), now);
  }
}

void Service::refused(const Write& meaning, const std::string& error) {
  if (const auto* added = std::get_if<OfStudy>(&meaning)) {
    const auto study = studies_.find(added->study);
    for (const Client& client : study->second.submitters) {
      reply_error(client, "the study was not stored: " + error);
    }
    study_ids_.erase(study->second.name);
    studies_.erase(study);
  } else if (const auto* state = std::get_if<OfState>(&meaning)) {
    Study& study = studies_.at(state->study);
    --study.state_writes;
    study.is_doubtful = true;
    OfState* later = nullptr;
    for (auto& [ticket, write] : writes_) {
      auto* other = std::get_if<OfState>(&write);
      if (later == nullptr && other != nullptr && other->study == state->study) {
        later = other;
      }
    }
    if (later != nullptr) {
      // That one is on its way still, and stands now on what was before this one.
      later->before = state->before;
    } else if (study.state == state->state) {
      study.state = state->before;
    }
    reply_error(state->client, "the change was not stored, the study is as before: " + error);
  } else if (const auto* share = std::get_if<OfShare>(&meaning)) {
    reply_error(share->client, "the change was not stored, the study is as before: " + error);
  } else if (const auto* forgotten = std::get_if<OfFailures>(&meaning)) {
    reply_error(forgotten->client, "the change was not stored, the study is as before: " + error);
  }
}

/// Nobody is told that something is stored from here on.
void Service::lose_storage(const std::string& error, Instant now) {
  outbox_.note(Severity::kError, error);
  storage_fault_ = error;
  storage_is_gone_ = true;
  while (!writes_.empty()) {
    const Write meaning = std::move(writes_.begin()->second);
    writes_.erase(writes_.begin());
    refused(meaning, error);
  }
  waiting_changes_ = 0;
  protocol::ServerToWorker notice;
  notice.mutable_notice()->set_text(error);
  for (const auto& [id, peer] : peers_) {
    send(id, notice);
  }
  stop(now);
}

// ---- Time -------------------------------------------------------------------------------------

void Service::tick(Instant now) {
  look_after_workers(now);
  feed(Tick{}, now);
  tell_of_queries(now);
  for (auto& [id, study] : studies_) {
    if (!study.durable) {
      continue;
    }
    const StudyCounts counts = scheduler_.study(id);
    study.samples.push_back({now.steady_ms, counts.solved + counts.failed});
    while (now.steady_ms - study.samples.front().steady_ms > kRateSpan_ms) {
      study.samples.pop_front();
    }
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
