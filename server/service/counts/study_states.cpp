#include "server/service/counts/study_states.h"

#include <utility>
#include <vector>

#include "proto/suggestion.h"

namespace oblique::server {
namespace {

bool is_unfinished(StudyState state) {
  return state == StudyState::kRunning || state == StudyState::kPaused;
}

}  // namespace

void StudyStates::enter(StudyId id, StudyState state) {
  ++counts_.at(static_cast<std::size_t>(state));
  if (is_unfinished(state)) {
    unfinished_.insert(id);
  }
}

void StudyStates::leave(StudyId id, StudyState state) {
  --counts_.at(static_cast<std::size_t>(state));
  unfinished_.erase(id);
}

void StudyStates::set_state(StudyId id, Study& study, StudyState state) {
  leave(id, study.state);
  study.state = state;
  enter(id, state);
}

void StudyStates::restore(const StoredStudy& stored, std::int64_t now_ms) {
  const bool lacks_rows = stored.completed.size() < stored.table.size();
  const StudyState state =
      stored.state == StudyState::kDone && lacks_rows ? StudyState::kRunning : stored.state;
  add(stored.study_id, {stored.name, stored.table, stored.created_at, stored.priority,
                        stored.failures, stored.attempts, now_ms, stored.submitted_by});
  Study& study = studies_.at(stored.study_id);
  set_state(stored.study_id, study, state);
  study.durable_state = state;
  study.is_durable = true;
}

void StudyStates::add(StudyId id, StudyRecord record) {
  ids_.emplace(record.name, id);
  enter(id, studies_.emplace(id, Study{std::move(record)}).first->second.state);
}

void StudyStates::added(StudyId id, std::int64_t now_ms) {
  Study& study = studies_.at(id);
  study.is_durable = true;
  study.record.since_ms = now_ms;
}

void StudyStates::remove(StudyId id) {
  const auto study = studies_.find(id);
  leave(id, study->second.state);
  ids_.erase(study->second.record.name);
  studies_.erase(study);
}

std::optional<StudyId> StudyStates::find(std::string_view name) const {
  const auto known = ids_.find(name);
  return known == ids_.end() ? std::nullopt : std::optional(known->second);
}

std::optional<StudyId> StudyStates::find_durable(std::string_view name) const {
  const auto id = find(name);
  return id && is_durable(*id) ? id : std::nullopt;
}

std::string StudyStates::nearest(std::string_view name) const {
  constexpr std::size_t kMostCompared = 10'000;
  if (ids_.size() > kMostCompared) {
    return {};
  }
  std::vector<std::string_view> names;
  names.reserve(ids_.size());
  for (const auto& [known, id] : ids_) {
    if (is_durable(id)) {
      names.emplace_back(known);
    }
  }
  return std::string(protocol::nearest(name, names));
}

std::optional<StudyId> StudyStates::durable_after(StudyId id) const {
  auto study = studies_.upper_bound(id);
  while (study != studies_.end() && !study->second.is_durable) {
    ++study;
  }
  return study == studies_.end() ? std::nullopt : std::optional(study->first);
}

bool StudyStates::needs_write(StudyId id, StudyState wanted) const {
  const Study& study = studies_.at(id);
  return study.state != StudyState::kDone &&
         (study.state != wanted || study.on_their_way > 0 || study.is_doubtful);
}

void StudyStates::change(StudyId id, StudyState state) {
  Study& study = studies_.at(id);
  if (study.on_their_way == 0) {
    study.durable_state = study.state;
  }
  set_state(id, study, state);
  ++study.on_their_way;
}

void StudyStates::changed(StudyId id, StudyState state) {
  Study& study = studies_.at(id);
  study.durable_state = study.state == StudyState::kDone ? StudyState::kDone : state;
  study.is_doubtful = false;
  --study.on_their_way;
}

void StudyStates::refused(StudyId id) {
  Study& study = studies_.at(id);
  study.is_doubtful = true;
  --study.on_their_way;
  if (study.on_their_way == 0) {
    set_state(id, study, study.durable_state);
  }
}

void StudyStates::rename(StudyId id, const std::string& name) {
  StudyRecord& record = studies_.at(id).record;
  ids_.erase(record.name);
  record.name = name;
  ids_.insert_or_assign(name, id);
}

void StudyStates::grow(StudyId id, const StudyTable& table, std::int32_t priority) {
  StudyRecord& record = studies_.at(id).record;
  record.table = table;
  record.priority = priority;
}

bool StudyStates::finish(StudyId id) {
  Study& study = studies_.at(id);
  study.durable_state = StudyState::kDone;
  const bool is_new = study.state != StudyState::kDone;
  set_state(id, study, StudyState::kDone);
  return is_new;
}

void StudyStates::point_failed(StudyId id, std::uint64_t point, std::uint32_t attempt) {
  StudyRecord& record = studies_.at(id).record;
  record.failures.insert(point);
  record.attempts.set({point, point + 1}, attempt);
}

void StudyStates::forget_failures(StudyId id, const IntervalSet& points, std::int64_t now_ms) {
  Study& study = studies_.at(id);
  points.for_each(
      [&](const Interval& interval) { study.record.failures.erase(interval.begin, interval.end); });
  if (study.state == StudyState::kDone) {
    set_state(id, study, StudyState::kRunning);
    study.durable_state = StudyState::kRunning;
  }
  study.record.since_ms = now_ms;
}

}  // namespace oblique::server
