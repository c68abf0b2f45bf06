#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "server/scheduler/scheduler_events.h"
#include "server/store/changes.h"
#include "server/store/store.h"
#include "server/study/interval_set.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// The results of other studies that a study reuses.
struct Reuse {
  struct Lookup {
    std::int64_t last_result_ms;
    std::uint64_t probes_in_vain = 0;
  };
  std::map<std::string, std::uint64_t> origins{};  ///< points by name of the source
  std::uint64_t points = 0;
  bool cut_short = false;
  std::optional<Lookup> lookup{};  ///< under way

  void add(const std::map<std::string, std::uint64_t>& more) {
    for (const auto& [origin, number] : more) {
      origins[origin] += number;
      points += number;
    }
  }
};

/// What is known of a study beside the points that the scheduler has.
struct StudyRecord {
  std::string name;
  StudyTable table;
  std::string created_at;
  std::int32_t priority = 0;
  IntervalSet failures{};      ///< points whose rows say failed
  std::int64_t since_ms{};     ///< start of the time over which its rate is known
  std::string submitted_by{};  ///< name of the key; empty: without keys
  Reuse reuse{};
  StudyState state = StudyState::kRunning;
  bool is_durable = false;
  /// A write was refused: what the disk took of it may count after a crash.
  bool is_doubtful = false;
};

/// The studies by number and name, as the database has them. A study that is being added is known
/// by its name, but not durable. Unless said otherwise a study must be known, or std::out_of_range
/// is thrown.
class StudyStates {
 public:
  /// Adds a study of the database. One that is called done and lacks rows runs again.
  void restore(const StoredStudy& study, std::int64_t now_ms);
  /// Adds a running study that is being written. Its number and name must be unused.
  void add(StudyId id, StudyRecord record);
  void remove(StudyId id);

  /// The study of that name, durable or being added.
  std::optional<StudyId> find(std::string_view name) const;
  /// The durable study of that number, or, if that is 0, of that name.
  std::optional<StudyId> find_durable(std::string_view name, StudyId id = 0) const;
  /// The name nearest to this one; empty: none is near, or there are too many studies.
  std::string nearest(std::string_view name) const;
  /// The durable study of the lowest number above this one.
  std::optional<StudyId> durable_after(StudyId id) const;
  bool contains(StudyId id) const { return studies_.contains(id); }
  const StudyRecord& record(StudyId id) const { return studies_.at(id); }
  /// To be changed, but for name and state, which have functions of their own.
  StudyRecord& record(StudyId id) { return studies_.at(id); }
  /// It is neither done nor cancelled.
  bool is_open(StudyId id) const { return unfinished_.contains(id); }

  /// Studies by state, by the values of StudyState.
  std::array<std::uint64_t, kStudyStates> counts() const;
  /// Numbers of the open studies.
  const std::set<StudyId>& unfinished() const { return unfinished_; }
  /// Points of the open studies.
  std::uint64_t open_points() const;
  /// Some study has, or had, results that others can reuse.
  bool have_results() const { return have_results_; }
  void note_results() { have_results_ = true; }

  /// Whether the state must be written: the study has another or a doubtful one. A done study keeps
  /// its state.
  bool needs_write(StudyId id, StudyState wanted) const;
  /// The state is durable. A study that is done stays so until points of it are open again.
  void set_state(StudyId id, StudyState state);
  void reopen(StudyId id) { move(id, StudyState::kRunning); }
  /// All points are completed. False when that was known.
  bool finish(StudyId id);

  /// Reserves an unused name until `release` or `rename`.
  void reserve(StudyId id, const std::string& name) { ids_.emplace(name, id); }
  void release(const std::string& name) { ids_.erase(name); }
  void rename(StudyId id, const std::string& name);

 private:
  void move(StudyId id, StudyState state);

  std::map<StudyId, StudyRecord> studies_;
  std::map<std::string, StudyId, std::less<>> ids_;  // by name
  std::set<StudyId> unfinished_;
  bool have_results_ = false;
};

}  // namespace oblique::server
