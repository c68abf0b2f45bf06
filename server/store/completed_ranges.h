#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "server/database/sqlite.h"
#include "server/study/interval_set.h"

namespace oblique::server {

/// Reads the completed points of a study. Throws StorageError.
IntervalSet completed_points(sqlite3* database, std::uint64_t study_id);

/// For each study whose column `counted` is 0: sets the completed points to the points that have a
/// row. Left-out points become open, and a worker examines them again. Must be called in a
/// transaction. Throws StorageError.
void count_completed_points(sqlite3* database);

/// Computes `left_out` and `reused_points` of a study from its rows and completed ranges. Sets its
/// state to done if all points are completed; sets a done study to running otherwise. Throws
/// StorageError.
void update_counts_and_state(sqlite3* database, std::uint64_t study_id);

/// Maintains the table `completed_ranges`, which contains the completed points of each study as
/// ranges, so that a server need not read all rows at its start. Each transaction that inserts or
/// deletes rows must update it. If another program deletes rows, a trigger sets `studies.counted`
/// to 0.
///
/// Writing a range takes three statements, however long it is. Adjacent ranges are merged.
///
/// The connection must outlive this object. All members throw StorageError.
class CompletedRanges {
 public:
  explicit CompletedRanges(sqlite3* database);

  /// Adds completed points, which `flush` will write.
  void add(std::uint64_t study_id, const Interval& points) {
    gathered_[study_id].insert(points.begin, points.end);
  }
  void add(std::uint64_t study_id, std::uint64_t point) { add(study_id, {point, point + 1}); }
  /// Writes the added points.
  void flush();
  /// Forgets the added points, because the transaction was rolled back.
  void forget() { gathered_.clear(); }

  /// Returns the stored ranges that overlap `points`, including their parts outside `points`.
  IntervalSet overlapping(std::uint64_t study_id, const Interval& points);
  /// Returns the points in `points` that are neither completed nor added.
  IntervalSet open_points(std::uint64_t study_id, const IntervalSet& points);
  /// Removes completed points.
  void remove(std::uint64_t study_id, const IntervalSet& points);

 private:
  std::optional<Interval> range_before(std::uint64_t study_id, std::uint64_t point);
  std::uint64_t take_out(std::uint64_t study_id, std::uint64_t first, std::uint64_t last);
  void write(std::uint64_t study_id, const Interval& range);

  Statement before_;
  Statement between_;
  Statement take_out_;
  Statement put_;
  std::map<std::uint64_t, IntervalSet> gathered_;  // by study
};

}  // namespace oblique::server
