// Results that other studies have are reused: looked up part by part, then the study goes on.
#include <memory>
#include <optional>
#include <stdexcept>
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

/// Looks the open points of the study up in the database; it is held until that ends.
void Service::begin_reuse(StudyId id, Instant now) {
  if (known_.begin(id, now.steady_ms)) {
    reuse_part(id, 0);
  }
}

/// Has one part of the lookup carried out, from that point on.
void Service::reuse_part(StudyId id, std::uint64_t first_point) {
  try {
    auto outcome = std::make_shared<ReusedResults>();
    ledger_.write(ReuseResults{id, states_.record(id).table.get(), first_point,
                               known_.solver_version(), outcome},
                  ReuseWrite{id, outcome});
  } catch (const std::runtime_error& error) {  // only another version can read the recipe
    outbox_.note(Severity::kWarning,
                 fmt::format("study {}: {}", states_.record(id).name, error.what()));
    ledger_.write(EndReuse{id}, EndReuseWrite{id});
  }
}

void Service::stored(const StudyWrite& write, Instant now) {
  feed(changes_.stored(write, now), now);
  if (write.reuses) {
    begin_reuse(write.study, now);
  }
  changes_.answer(write, now);
}

void Service::stored(const GrowthWrite& write, Instant now) {
  if (write.reuses) {
    feed(StudyHeld{write.study, true}, now);
  }
  feed(changes_.stored(write, now), now);
  if (write.reuses) {
    begin_reuse(write.study, now);
  }
  changes_.answer(write, now);
}

void Service::stored(const ReuseWrite& write, Instant now) {
  const StudyId id = write.study;
  if (!states_.contains(id)) {
    return;  // it was deleted meanwhile
  }
  const ReusedResults& part = *write.outcome;
  const std::optional<std::uint64_t> next = known_.add_part(id, part, now.steady_ms);
  if (!part.points.empty()) {
    feed(PointsTaken{id, part.points}, now);
    known_.note_source(id);
    changes_.recount(id);
  }
  if (is_stopping()) {
    return;  // the next server goes on
  }
  if (next) {
    reuse_part(id, *next);
  } else {
    ledger_.write(EndReuse{id}, EndReuseWrite{id});
  }
}

void Service::stored(const EndReuseWrite& write, Instant now) {
  const StudyId id = write.study;
  if (!states_.contains(id)) {
    return;
  }
  if (known_.end(id, now.steady_ms)) {
    reuse_part(id, 0);
    return;
  }
  const protocol::TakenOver taken = known_.message_of(id);
  if (taken.points() > 0) {
    outbox_.note(Severity::kInfo,
                 fmt::format("study {} took over {} known points: {}", states_.record(id).name,
                             taken.points(), origins_of(taken)));
  }
  rates_.forget(id);  // they were not solved
  feed(StudyHeld{id, false}, now);
  changes_.recount(id);
  changes_.release_replies(now);
}

/// What the lookup has not found is solved.
void Service::refused(const ReuseWrite& write, const std::string& error, Instant /*now*/) {
  if (ledger_.is_gone() || !states_.contains(write.study)) {
    return;
  }
  outbox_.note(Severity::kWarning,
               fmt::format("study {}: results of other studies cannot be reused: {}",
                           states_.record(write.study).name, error));
  known_.cut_short(write.study);
  ledger_.write(EndReuse{write.study}, EndReuseWrite{write.study});
}

/// The writer keeps it until it can write it.
void Service::refused(const EndReuseWrite& /*write*/, const std::string& /*error*/,
                      Instant /*now*/) {}

}  // namespace oblique::server
