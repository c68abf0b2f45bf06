#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "server/scheduler/worker_processes.h"
#include "server/store/changes.h"
#include "server/store/store.h"
#include "server/study/interval_set.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// What is known of a study beside the points that the scheduler has.
struct StudyRecord {
  std::string name;
  StudyTable table;
  std::string created_at;
  std::int32_t priority = 0;   ///< as the database has it
  IntervalSet failures;        ///< points whose rows say failed
  PointAttempts attempts;      ///< of points that failed, also of those that were forgotten
  std::int64_t since_ms{};     ///< nothing is known of its rate before
  std::string submitted_by{};  ///< name of the key; empty: without keys
};

/// The studies by number and name, and of each what the disk makes of its state: what is durable,
/// what is on its way there, and what is doubtful, for a change that was refused may count again
/// after a crash until something else is written in its place. Nothing here writes: it is told what
/// was handed over, and what became of it, in the order of handing over. Unless said otherwise a
/// study must be known, or std::out_of_range is thrown.
class StudyStates {
 public:
  /// A study of the database. One that is called done and lacks rows runs again.
  void restore(const StoredStudy& study, std::int64_t now_ms);

  /// A new study, running, is handed over. Neither its number nor its name may be known.
  void add(StudyId id, StudyRecord record);
  /// It is durable.
  void added(StudyId id, std::int64_t now_ms);
  /// It was refused or is deleted, and is unknown from now on.
  void remove(StudyId id);

  /// The study of that name, durable or on its way.
  std::optional<StudyId> find(std::string_view name) const;
  /// The same when it is durable.
  std::optional<StudyId> find_durable(std::string_view name) const;
  /// The name that differs least from this one, if any is near it; empty: none, or there are very
  /// many studies.
  std::string nearest(std::string_view name) const;
  /// The durable study of the lowest number above this one.
  std::optional<StudyId> durable_after(StudyId id) const;
  bool contains(StudyId id) const { return studies_.contains(id); }
  bool is_durable(StudyId id) const { return studies_.at(id).is_durable; }
  const StudyRecord& record(StudyId id) const { return studies_.at(id).record; }

  /// Studies by state, by the values of StudyState.
  const std::array<std::uint64_t, kStudyStates>& counts() const { return counts_; }
  /// Those that run or are paused, also such as are on their way.
  const std::set<StudyId>& unfinished() const { return unfinished_; }

  /// As it was handed over last: what the study becomes unless that is refused.
  StudyState state(StudyId id) const { return studies_.at(id).state; }
  /// It is neither done nor cancelled.
  bool is_open(StudyId id) const {
    return state(id) == StudyState::kRunning || state(id) == StudyState::kPaused;
  }
  /// Whether that state must be written to be sure of it. One that is there already must, while
  /// another one is on its way or doubtful. What is done takes no other state.
  bool needs_write(StudyId id, StudyState wanted) const;
  /// A state is handed over, ...
  void change(StudyId id, StudyState state);
  /// ... is durable, ...
  void changed(StudyId id, StudyState state);
  /// ... or was refused: the latest durable state holds, or what is on its way still.
  void refused(StudyId id);

  /// All points are settled. False when that is known.
  bool finish(StudyId id);

  /// The name, which no study has, is kept for this one, ...
  void reserve(StudyId id, const std::string& name) { ids_.emplace(name, id); }
  /// ... and is not any more, ...
  void release(const std::string& name) { ids_.erase(name); }
  /// ... or is durably its only one.
  void rename(StudyId id, const std::string& name);
  /// It is durable that the study has all the points of the table.
  void grow(StudyId id, const StudyTable& table, std::int32_t priority);

  void set_priority(StudyId id, std::int32_t priority) {
    studies_.at(id).record.priority = priority;
  }
  /// It is durable that the point failed in that attempt.
  void point_failed(StudyId id, std::uint64_t point, std::uint32_t attempt);
  /// It is durable that these failures are forgotten: a study that was done runs.
  void forget_failures(StudyId id, const IntervalSet& points, std::int64_t now_ms);

 private:
  struct Study {
    StudyRecord record;
    StudyState state = StudyState::kRunning;
    StudyState durable_state = StudyState::kRunning;  // while others are on their way
    std::uint32_t on_their_way = 0;                   // states
    bool is_doubtful = false;
    bool is_durable = false;
  };

  void enter(StudyId id, StudyState state);
  void leave(StudyId id, StudyState state);
  void set_state(StudyId id, Study& study, StudyState state);

  std::map<StudyId, Study> studies_;
  std::map<std::string, StudyId, std::less<>> ids_;  // by name
  std::array<std::uint64_t, kStudyStates> counts_{};
  std::set<StudyId> unfinished_;
};

}  // namespace oblique::server
