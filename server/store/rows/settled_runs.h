#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include "server/database/sqlite.h"
#include "server/study/interval_set.h"

namespace oblique::server {

/// Points by the number of their study.
using PointsOfStudies = std::map<std::uint64_t, IntervalSet>;

/// Which of [begin, end) have a row, by a look at the rows' index. Throws StorageError.
IntervalSet points_with_row(sqlite3* database, std::uint64_t study_id, const Interval& points);

/// The points of all studies that are settled as `settled_points` has them, but of those in doubt,
/// which come with nothing. Throws StorageError.
std::map<std::uint64_t, std::optional<IntervalSet>> noted_points(sqlite3* database);

/// The same of one study.
std::optional<IntervalSet> noted_points_of(sqlite3* database, std::uint64_t study_id);

/// The table `settled_points`: which points of each study have a row or are left out by a filter,
/// as runs of neighbours, so that nobody need look at the rows to know. Whoever changes rows says
/// so here, in the same transaction. What other programs delete is noted by the schema's triggers:
/// the study is in doubt from then on, and must be counted again.
///
/// A run costs three statements when it is written, whatever its length. Points that come in no
/// order make runs of one, each of which costs less than the row beside it, and is gone once its
/// neighbours have come.
///
/// The connection must outlive this. All members throw StorageError.
class SettledRuns {
 public:
  explicit SettledRuns(sqlite3* database);
  ~SettledRuns();
  SettledRuns(const SettledRuns&) = delete;
  SettledRuns& operator=(const SettledRuns&) = delete;

  /// The points have got rows, or a filter leaves them out. Known to the database after `flush`.
  void add(std::uint64_t study_id, const Interval& points) {
    gathered_[study_id].insert(points.begin, points.end);
  }
  /// Writes the runs that were gathered, each united with its neighbours.
  void flush();
  /// The transaction of what was gathered is undone.
  void forget() { gathered_.clear(); }

  /// Looks which of [begin, end) have a row; to be called after rows of these were deleted. The
  /// study is in doubt afterwards only if it was `before`, which `is_doubtful` has said.
  void look_again(std::uint64_t study_id, const Interval& points, bool was_doubtful);
  /// Rows were deleted by somebody who does not keep the runs.
  bool is_doubtful(std::uint64_t study_id);
  /// Counts all rows of the study, writes its runs and takes it out of doubt. Points that a filter
  /// leaves out are forgotten: workers name them again.
  void count_again(std::uint64_t study_id);

 private:
  struct Statements;

  void write(std::uint64_t study_id, const Interval& run);
  void erase(std::uint64_t study_id, const Interval& points);
  void set_certain(std::uint64_t study_id);

  sqlite3* database_;
  std::unique_ptr<Statements> statements_;
  PointsOfStudies gathered_;
};

}  // namespace oblique::server
