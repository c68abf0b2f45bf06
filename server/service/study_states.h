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
    std::int64_t last_result_ms;
    std::uint64_t probes_in_vain = 0;
  };
  std::map<std::string, std::uint64_t> origins{};  ///< number of points by source study
  std::uint64_t points = 0;
  bool cut_short = false;
  std::optional<Lookup> lookup{};  ///< set while the lookup runs

  void add(const std::map<std::string, std::uint64_t>& more) {
    for (const auto& [origin, number] : more) {
      origins[origin] += number;
      points += number;
    }
  }
};

/// A study, without the states of its points, which the scheduler has.
struct StudyRecord {
  std::string name;
  StudyTable table;
  std::string created_at;
  std::int32_t priority = 0;
  IntervalSet failures{};      ///< points with a failed row
  std::int64_t since_ms{};     ///< time from which its rate is computed
  std::string submitted_by{};  ///< name of the submitter's key; empty without keys
  Reuse reuse{};
  StudyState state = StudyState::kRunning;
  bool is_durable = false;
  /// A write was refused, but the disk may have stored part of it, which would count after a crash.
  bool is_doubtful = false;
};

/// The studies by number and name, as in the database. A study that is being added has a name but
/// is not durable. Functions throw std::out_of_range for unknown studies unless stated otherwise.
class StudyStates {
 public:
  /// Adds a study from the database. A study that is marked done but lacks rows runs again.
  void restore(const StoredStudy& study, std::int64_t now_ms);
  /// Adds a running study that is being written, with an unused number and name.
  void add(StudyId id, StudyRecord record);
  void remove(StudyId id);

  /// The study of that name, durable or being added.
  std::optional<StudyId> find(std::string_view name) const;
  /// The durable study of that number or, if that is 0, of that name.
  std::optional<StudyId> find_durable(std::string_view name, StudyId id = 0) const;
  /// The nearest name; empty if none is near or there are too many studies.
  std::string nearest(std::string_view name) const;
  /// The durable study with the lowest number above this one.
  std::optional<StudyId> durable_after(StudyId id) const;
  bool contains(StudyId id) const { return studies_.contains(id); }
  const StudyRecord& record(StudyId id) const { return studies_.at(id); }
  /// For changes except of name and state, which have functions of their own.
  StudyRecord& record(StudyId id) { return studies_.at(id); }
  /// Whether it is neither done nor cancelled.
  bool is_open(StudyId id) const { return unfinished_.contains(id); }

  /// Number of studies by StudyState.
  std::array<std::uint64_t, kStudyStates> counts() const;
  /// Numbers of the open studies.
  const std::set<StudyId>& unfinished() const { return unfinished_; }
  /// Number of points of the open studies.
  std::uint64_t open_points() const;
  /// Whether some study has, or had, results that others can reuse.
  bool have_results() const { return have_results_; }
  void note_results() { have_results_ = true; }

  /// Whether the state must be written: the study has another state or a doubtful one, and is not
  /// done.
  bool needs_write(StudyId id, StudyState wanted) const;
  /// Sets a state that is durable. A done study keeps its state until some of its points are open
  /// again.
  void set_state(StudyId id, StudyState state);
  void reopen(StudyId id) { move(id, StudyState::kRunning); }
  /// Sets the state to done. False if it was done.
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
