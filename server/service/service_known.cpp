// Points that other studies have solved.
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/service/service.h"

namespace oblique::server {
namespace {

/// "120 of a and 3 of b".
std::string origins_of(const protocol::TakenOver& taken) {
  std::string text;
  for (int i = 0; i < taken.from_size(); ++i) {
    text += fmt::format("{}{} of {}", i == 0 ? "" : ", ", taken.from(i).points(),
                        taken.from(i).study());
  }
  return text;
}

}  // namespace

/// The study has rows that others may want.
void Service::note_source(StudyId id) {
  if (known_.note_source(id)) {
    outbox_.finder().note_source(id, states_.record(id).table);
  }
}

void Service::seek_known(StudyId id) {
  known_.begin(id);
  const auto& record = states_.record(id);
  outbox_.finder().seek({id, record.table, record.terms.priority});
}

void Service::stored(const StudyWrite& write, Instant now) {
  feed(changes_.stored(write, now), now);
  if (write.takes_over) {
    seek_known(write.study);
  }
  changes_.answer(write, now);
}

void Service::stored(const GrowthWrite& write, Instant now) {
  if (write.takes_over) {
    feed(StudyHeld{write.study, true}, now);
  }
  feed(changes_.stored(write, now), now);
  if (known_.is_source(write.study)) {
    outbox_.finder().note_source(write.study, write.table);
  }
  if (write.takes_over) {
    seek_known(write.study);
  }
  changes_.answer(write, now);
}

void Service::known(KnownReport report) {
  if (ledger_.is_gone()) {
    return;
  }
  if (!states_.contains(report.study_id)) {  // it was deleted meanwhile
    if (!report.is_end) {
      outbox_.finder().go_on();
    }
    return;
  }
  if (report.is_end) {
    ledger_.write(EndTaking{report.study_id}, EndTakingWrite{report.study_id, report.is_cut_short});
    return;
  }
  auto taken = std::make_shared<TakenResults>();
  ledger_.write(TakeResults{report.study_id, report.source_id, std::move(report.runs),
                            known_.solver_version(), taken},
                TakingWrite{report.study_id, taken});
}

void Service::stored(const TakingWrite& write, Instant now) {
  outbox_.finder().go_on();
  const StudyId id = write.study;
  if (!states_.contains(id) || write.taken->points.empty()) {
    return;
  }
  known_.add(id, write.taken->origin, write.taken->points.size());
  feed(PointsTaken{id, write.taken->points, known_.solver_version()}, now);
  note_source(id);
  changes_.recount(id);
}

void Service::stored(const EndTakingWrite& write, Instant now) {
  const StudyId id = write.study;
  if (!known_.end(id, write.is_cut_short)) {
    return;
  }
  if (states_.contains(id)) {
    const protocol::TakenOver taken = known_.message_of(id);
    if (taken.points() > 0) {
      outbox_.note(Severity::kInfo,
                   fmt::format("study {} took over {} known points: {}", states_.record(id).name,
                               taken.points(), origins_of(taken)));
    }
    rates_.forget(id);  // they were not solved
    feed(StudyHeld{id, false}, now);
    changes_.recount(id);
  }
  changes_.release_replies(now);
}

/// The writer keeps these until it can write them.
void Service::refused(const TakingWrite& /*write*/, const std::string& /*error*/, Instant /*now*/) {
}
void Service::refused(const EndTakingWrite& /*write*/, const std::string& /*error*/,
                      Instant /*now*/) {}

}  // namespace oblique::server
