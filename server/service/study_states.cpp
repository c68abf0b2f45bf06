#include "server/service/study_states.h"

#include <utility>
#include <vector>

#include "proto/text.h"

namespace oblique::server {

void StudyStates::move(StudyId id, StudyState state) {
  studies_.at(id).state = state;
  if (state == StudyState::kRunning || state == StudyState::kPaused) {
    unfinished_.insert(id);
  } else {
    unfinished_.erase(id);
  }
}

std::array<std::uint64_t, kStudyStates> StudyStates::counts() const {
  std::array<std::uint64_t, kStudyStates> counts{};
  for (const auto& [id, study] : studies_) {
    ++counts.at(static_cast<std::size_t>(study.state));
  }
  return counts;
}

std::uint64_t StudyStates::open_points() const {
  std::uint64_t points = 0;
  for (const StudyId id : unfinished_) {
    points += record(id).table.size();
  }
  return points;
}

void StudyStates::restore(const StoredStudy& stored, std::int64_t now_ms) {
  const bool lacks_rows = stored.completed.size() < stored.table.size();
  add(stored.study_id, {stored.name, stored.table, stored.created_at, stored.priority,
                        stored.failures, now_ms, stored.submitted_by});
  move(stored.study_id,
       stored.state == StudyState::kDone && lacks_rows ? StudyState::kRunning : stored.state);
  set_durable(stored.study_id, now_ms);
}

void StudyStates::add(StudyId id, StudyRecord record) {
  ids_.emplace(record.name, id);
  studies_.emplace(id, Study{std::move(record)});
  unfinished_.insert(id);
}

void StudyStates::set_durable(StudyId id, std::int64_t now_ms) {
  Study& study = studies_.at(id);
  study.is_durable = true;
  study.record.since_ms = now_ms;
}

void StudyStates::remove(StudyId id) {
  const auto study = studies_.find(id);
  unfinished_.erase(id);
  ids_.erase(study->second.record.name);
  studies_.erase(study);
}

std::optional<StudyId> StudyStates::find(std::string_view name) const {
  const auto known = ids_.find(name);
  return known == ids_.end() ? std::nullopt : std::optional(known->second);
}

std::optional<StudyId> StudyStates::find_durable(std::string_view name, StudyId id) const {
  const auto known = id != 0 ? std::optional(id) : find(name);
  return known && contains(*known) && is_durable(*known) ? known : std::nullopt;
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
  return study.state != StudyState::kDone && (study.state != wanted || study.is_doubtful);
}

void StudyStates::set_state(StudyId id, StudyState state) {
  studies_.at(id).is_doubtful = false;
  if (studies_.at(id).state != StudyState::kDone) {
    move(id, state);
  }
}

bool StudyStates::finish(StudyId id) {
  const bool is_new = state(id) != StudyState::kDone;
  move(id, StudyState::kDone);
  return is_new;
}

void StudyStates::rename(StudyId id, const std::string& name) {
  StudyRecord& record = studies_.at(id).record;
  ids_.erase(record.name);
  record.name = name;
  ids_.insert_or_assign(name, id);
}

void StudyStates::grow(StudyId id, const StudyTable& table, std::int32_t priority) {
  Study& study = studies_.at(id);
  study.record.table = table;
  study.record.priority = priority;
  study.is_doubtful = false;
  move(id, StudyState::kRunning);
}

void StudyStates::point_failed(StudyId id, std::uint64_t point) {
  studies_.at(id).record.failures.insert(point);
}

void StudyStates::forget_failures(StudyId id, const IntervalSet& points, std::int64_t now_ms) {
  StudyRecord& record = studies_.at(id).record;
  points.for_each(
      [&](const Interval& interval) { record.failures.erase(interval.begin, interval.end); });
  record.since_ms = now_ms;
  if (state(id) == StudyState::kDone) {
    move(id, StudyState::kRunning);
  }
}

}  // namespace oblique::server
