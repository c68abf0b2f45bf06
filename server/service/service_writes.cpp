// The side of the service that speaks with the database: what goes there, and what follows from it.
#include <utility>

#include "server/service/service.h"

namespace oblique::server {

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
  const bool any = !effect.accepted.empty() && studies_.contains(effect.study);
  if (any && !peer.has_row) {
    // Whoever only comes and goes leaves no row.
    peer.has_row = true;
    write(AddWorker{effect.worker, peer.name, peer.threads, peer.solver_version,
                    peer.instruction_set, peer.joined_at},
          OfNothing{}, false);
  }
  AddResults change{effect.study,         any ? studies_.record(effect.study).table.get() : nullptr,
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
                                       studies_.record(effect.study).name +
                                       " failed: " + effect.reason);
  AddResults change{effect.study,
                    studies_.record(effect.study).table.get(),
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
        studies_.point_failed(results->event.study, outcome.point, results->attempt);
      }
    }
    unstored_bytes_ -= results->bytes;
    if (const auto peer = peers_.find(results->event.worker); peer != peers_.end()) {
      --peer->second.unstored_messages;
      peer->second.unstored_bytes -= results->bytes;
    }
    note_rate(results->event, now);
    feed(results->event, now);
  } else if (const auto* added = std::get_if<OfStudy>(&meaning)) {
    studies_.added(added->study, now.steady_ms);
    const StudyRecord& study = studies_.record(added->study);
    outbox_.note(Severity::kInfo, "study " + study.name + " of " +
                                      std::to_string(study.table.size()) + " points begins");
    feed(StudyAdded{added->study, study.table, {}, 0, false, false, study.share}, now);
    bool created = true;
    for (const Client& client : std::exchange(submitters_[added->study], {})) {
      reply_submitted(client, added->study, std::exchange(created, false));
    }
    submitters_.erase(added->study);
  } else if (const auto* state = std::get_if<OfState>(&meaning)) {
    studies_.changed(state->study, state->state);
    outbox_.note(Severity::kInfo, "study " + studies_.record(state->study).name +
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
    studies_.set_share(share->study, share->share);
    feed(StudyShareChanged{share->study, share->share}, now);
    continue_study(share->client, share->study, now);
  } else if (const auto* forgotten = std::get_if<OfFailures>(&meaning)) {
    studies_.forget_failures(forgotten->study, forgotten->points, now.steady_ms);
    const StudyRecord& study = studies_.record(forgotten->study);
    outbox_.note(Severity::kInfo, "study " + study.name + " tries its failed points again: " +
                                      std::to_string(forgotten->points.size()));
    rates_.forget(forgotten->study);  // fewer points are settled now: no rate can be had of that
    feed(FailuresForgotten{forgotten->study, forgotten->points, study.attempts}, now);
    reply_changed(forgotten->client, forgotten->study, forgotten->points.size(), now);
  }
}

void Service::refused(const Write& meaning, const std::string& error) {
  if (const auto* added = std::get_if<OfStudy>(&meaning)) {
    for (const Client& client : std::exchange(submitters_[added->study], {})) {
      reply_error(client, "the study was not stored: " + error);
    }
    submitters_.erase(added->study);
    studies_.remove(added->study);
  } else if (const auto* state = std::get_if<OfState>(&meaning)) {
    studies_.refused(state->study);
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

}  // namespace oblique::server
