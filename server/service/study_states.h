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

/// Results of other studies that a study reuses.
struct Reuse {
  struct Lookup {
    std::int64_t began_ms;
    std::int64_t last_result_ms = began_ms;
    std::uint64_t probes_in_vain = 0;
  };
  std::map<std::string, std::uint64_t> origins{};  ///< number of reused points, by source study
  std::uint64_t points = 0;
  bool cut_short = false;
  std::optional<Lookup> lookup{};  ///< has a value while the lookup runs

  void add(const std::map<std::string, std::uint64_t>& more) {
    for (const auto& [origin, number] : more) {
      origins[origin] += number;
      points += number;
    }
  }
};

/// A study. The scheduler stores the states of its points.
struct StudyRecord {
  std::string name;
  StudyTable table;
  std::string created_at;
  std::int32_t priority = 0;
  IntervalSet failures{};      ///< points whose row has an error
  std::int64_t since_ms{};     ///< start of the period for the study's points per second
  std::string submitted_by{};  ///< name of the submitter's key; empty without keys
  std::string uid{};           ///< AddStudy.uid
  Reuse reuse{};
  StudyState state = StudyState::kRunning;
  bool is_durable = false;
  /// True if a write of the state was refused. The disk may contain a part of the write, which
  /// would take effect after a crash.
  bool is_doubtful = false;
};

/// The studies by number and name, as in the database. A study that is being added has a name but
/// is not durable yet. Functions throw std::out_of_range for unknown studies unless stated
/// otherwise.
class StudyStates {
 public:
  /// Adds a study from the database. A study that is marked done but lacks rows becomes running.
  void restore(const StoredStudy& study, std::int64_t now_ms);
  /// Adds a running study with an unused number and name, while it is being written.
  void add(StudyId id, StudyRecord record);
  void remove(StudyId id);

  /// Returns the study with that name, durable or being added.
  std::optional<StudyId> find(std::string_view name) const;
  /// Returns the durable study with number `id` or, if `id` is 0, with that name.
  std::optional<StudyId> find_durable(std::string_view name, StudyId id = 0) const;
  /// Returns the study name nearest to `name`; empty if none is near or too many studies exist.
  std::string nearest(std::string_view name) const;
  /// Returns the durable study with the lowest number above `id`.
  std::optional<StudyId> durable_after(StudyId id) const;
  bool contains(StudyId id) const { return studies_.contains(id); }
  const StudyRecord& record(StudyId id) const { return studies_.at(id); }
  /// Returns the record for changes. Name, state and table must be changed by their own functions.
  StudyRecord& record(StudyId id) { return studies_.at(id); }
  /// Returns whether the study is neither done nor cancelled.
  bool is_open(StudyId id) const { return unfinished_.contains(id); }

  /// Returns the number of studies in each StudyState.
  std::array<std::uint64_t, kStudyStates> counts() const;
  /// Returns the numbers of the open studies.
  const std::set<StudyId>& unfinished() const { return unfinished_; }
  /// Returns the number of points of all open studies.
  std::uint64_t open_points() const { return open_points_; }
  /// Returns whether any study has, or once had, results that others can reuse.
  bool have_results() const { return have_results_; }
  void note_results() { have_results_ = true; }

  /// Returns whether the state must be written: the study is not done, and its state differs from
  /// `wanted` or is doubtful.
  bool needs_write(StudyId id, StudyState wanted) const;
  /// Sets a state that is durable. A done study stays done until `reopen`.
  void set_state(StudyId id, StudyState state);
  void reopen(StudyId id) { move(id, StudyState::kRunning); }
  /// Replaces the table by one with more points, and sets the state to running.
  void grow(StudyId id, StudyTable table);
  /// Sets the state to done. Returns false if it was done already.
  bool finish(StudyId id);

  /// Reserves an unused name for a study until `release` or `rename`.
  void reserve(StudyId id, const std::string& name) { ids_.emplace(name, id); }
  void release(const std::string& name) { ids_.erase(name); }
  void rename(StudyId id, const std::string& name);

 private:
  void move(StudyId id, StudyState state);

  std::map<StudyId, StudyRecord> studies_;
  std::map<std::string, StudyId, std::less<>> ids_;  // by name
  std::set<StudyId> unfinished_;
  std::uint64_t open_points_ = 0;  // number of points of the studies in `unfinished_`
  bool have_results_ = false;
};

}  // namespace oblique::server
