#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "server/database/sqlite.h"
#include "server/study/interval_set.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// Points by the number of their study.
using PointsOfStudies = std::map<std::uint64_t, IntervalSet>;

/// The points in `points` that have a row, read from `results`. Throws StorageError.
IntervalSet points_with_row(sqlite3* database, std::uint64_t study_id, const Interval& points);

/// The completed points of all studies, read from `completed_ranges`; none for a study whose rows
/// must be counted again. Throws StorageError.
std::map<std::uint64_t, std::optional<IntervalSet>> noted_points(sqlite3* database);

/// The same of one study.
std::optional<IntervalSet> noted_points_of(sqlite3* database, std::uint64_t study_id);

/// Maintains the table `completed_ranges`: the completed points of each study as ranges, so that a
/// start need not read all rows. Each transaction that inserts or deletes rows must update it. When
/// another program deletes rows, a trigger sets `studies.counted` to 0, and the next start of a
/// server counts the rows again.
///
/// Writing a range costs three statements, whatever its length. Adjacent ranges are merged.
///
/// The connection must outlive this. All members throw StorageError.
class CompletedRanges {
 public:
  explicit CompletedRanges(sqlite3* database);

  /// Marks points as completed. `flush` writes them.
  void add(std::uint64_t study_id, std::uint64_t point) { gathered_[study_id].insert(point); }
  void add(std::uint64_t study_id, const Interval& points) {
    gathered_[study_id].insert(points.begin, points.end);
  }
  /// Writes what was added.
  void flush();
  /// Drops what was added, because its transaction was rolled back.
  void forget() { gathered_.clear(); }

  /// The written ranges of a study that overlap `points`, uncut.
  IntervalSet overlapping(std::uint64_t study_id, const Interval& points);
  /// The points in `points` that are neither completed nor added.
  IntervalSet open_points(std::uint64_t study_id, const IntervalSet& points);
  /// Opens these points again.
  void remove(std::uint64_t study_id, const IntervalSet& points);
  /// False after another program deleted rows of the study.
  bool is_counted(std::uint64_t study_id);
  void set_counted(std::uint64_t study_id);
  /// Computes the ranges of a study again. They have the points with a row, and those points of the
  /// present ranges without a row that the filter leaves out. If the recipe cannot be read they
  /// have only points with a row.
  void count_again(std::uint64_t study_id, const StudyTable& table);
  /// The same for the points with a row and the points in `left_out` without one.
  void count_again(std::uint64_t study_id, const IntervalSet& left_out);

 private:
  void replace(std::uint64_t study_id, const IntervalSet& with_row, const IntervalSet& left_out);
  std::optional<Interval> range_before(std::uint64_t study_id, std::uint64_t point);
  std::uint64_t take_out(std::uint64_t study_id, std::uint64_t first, std::uint64_t last);
  void write(std::uint64_t study_id, const Interval& range);

  sqlite3* database_;
  Statement before_;
  Statement take_out_;
  Statement between_;
  Statement put_;
  PointsOfStudies gathered_;
};

}  // namespace oblique::server
