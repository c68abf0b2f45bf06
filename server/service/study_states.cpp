#include "server/service/study_states.h"

#include <utility>
#include <vector>

#include "proto/text.h"

namespace oblique::server {

void StudyStates::move(StudyId id, StudyState state) {
  StudyRecord& study = studies_.at(id);
  study.state = state;
  if (state == StudyState::kRunning || state == StudyState::kPaused) {
    open_points_ += unfinished_.insert(id).second ? study.table.size() : 0;
  } else {
    open_points_ -= unfinished_.erase(id) > 0 ? study.table.size() : 0;
  }
}

void StudyStates::grow(StudyId id, StudyTable table) {
  StudyRecord& study = studies_.at(id);
  open_points_ += is_open(id) ? table.size() - study.table.size() : 0;
  study.table = std::move(table);
  move(id, StudyState::kRunning);
}

std::array<std::uint64_t, kStudyStates> StudyStates::counts() const {
  std::array<std::uint64_t, kStudyStates> counts{};
  for (const auto& [id, study] : studies_) {
    ++counts.at(static_cast<std::size_t>(study.state));
  }
  return counts;
}

void StudyStates::restore(const StoredStudy& stored, std::int64_t now_ms) {
  const bool lacks_rows = stored.completed.size() < stored.table.size();
  StudyRecord study{stored.name,     stored.table, stored.created_at,   stored.priority,
                    stored.failures, now_ms,       stored.submitted_by, stored.uid};
  study.reuse.add(stored.reused);
  study.is_durable = true;
  add(stored.study_id, std::move(study));
  move(stored.study_id,
       stored.state == StudyState::kDone && lacks_rows ? StudyState::kRunning : stored.state);
  have_results_ = have_results_ || !stored.completed.empty();
}

void StudyStates::add(StudyId id, StudyRecord record) {
  ids_.emplace(record.name, id);
  studies_.emplace(id, std::move(record));
  move(id, StudyState::kRunning);
}

void StudyStates::remove(StudyId id) {
  const auto study = studies_.find(id);
  move(id, StudyState::kCancelled);
  ids_.erase(study->second.name);
  studies_.erase(study);
}

std::optional<StudyId> StudyStates::find(std::string_view name) const {
  const auto known = ids_.find(name);
  return known == ids_.end() ? std::nullopt : std::optional(known->second);
}

std::optional<StudyId> StudyStates::find_durable(std::string_view name, StudyId id) const {
  const auto known = id != 0 ? std::optional(id) : find(name);
  return known && contains(*known) && record(*known).is_durable ? known : std::nullopt;
}

std::string StudyStates::nearest(std::string_view name) const {
  constexpr std::size_t kMaxCompared = 10'000;
  if (ids_.size() > kMaxCompared) {
    return {};
  }
  std::vector<std::string_view> names;
  for (const auto& [known, id] : ids_) {
    names.emplace_back(known);
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
  const StudyRecord& study = record(id);
  return study.state != StudyState::kDone && (study.state != wanted || study.is_doubtful);
}

void StudyStates::set_state(StudyId id, StudyState state) {
  record(id).is_doubtful = false;
  if (record(id).state != StudyState::kDone) {
    move(id, state);
  }
}

bool StudyStates::finish(StudyId id) {
  const bool is_new = record(id).state != StudyState::kDone;
  move(id, StudyState::kDone);
  return is_new;
}

void StudyStates::rename(StudyId id, const std::string& name) {
  ids_.erase(std::exchange(record(id).name, name));
  ids_.insert_or_assign(name, id);
}

}  // namespace oblique::server
