#include "server/store/completed_ranges.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace oblique::server {
namespace {

std::uint64_t number(const Statement& row, int column) {
  return static_cast<std::uint64_t>(row.integer(column));
}

IntervalSet all_points_with_row(sqlite3* database, std::uint64_t study_id) {
  constexpr auto kLast = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  return points_with_row(database, study_id, {0, kLast});
}

IntervalSet all_ranges(sqlite3* database, std::uint64_t study_id) {
  IntervalSet found;
  Statement ranges(database,
                   "SELECT first_point, points FROM completed_ranges WHERE study_id = ?"
                   " ORDER BY first_point");
  ranges.bind_all(study_id);
  while (ranges.step()) {
    found.insert(number(ranges, 0), number(ranges, 0) + number(ranges, 1));
  }
  return found;
}

IntervalSet without(IntervalSet points, const IntervalSet& others) {
  others.for_each([&](const Interval& range) { points.erase(range.begin, range.end); });
  return points;
}

/// The points in `points` that the study's filter leaves out; none if its recipe cannot be read.
IntervalSet left_out_of(const StudyTable& table, const IntervalSet& points) {
  IntervalSet found;
  try {
    if (points.empty() || !table->has_filter()) {
      return found;
    }
  } catch (const std::runtime_error&) {
    return found;
  }
  points.for_each([&](const Interval& range) {
    const std::uint64_t end = std::min(range.end, table->size());
    for (std::uint64_t begin = range.begin; begin < end;) {
      const std::uint64_t left_in = table->first_left_in(begin, end);
      found.insert(begin, left_in);
      begin = left_in + 1;
    }
  });
  return found;
}

}  // namespace

IntervalSet points_with_row(sqlite3* database, std::uint64_t study_id, const Interval& points) {
  IntervalSet found;
  Interval run{0, 0};
  Statement rows(database,
                 "SELECT point FROM results WHERE study_id = ? AND point >= ? AND point < ?"
                 " ORDER BY point");
  rows.bind_all(study_id, points.begin, points.end);
  while (rows.step()) {
    const std::uint64_t point = number(rows, 0);
    if (point != run.end) {
      found.insert(run.begin, run.end);
      run.begin = point;
    }
    run.end = point + 1;
  }
  found.insert(run.begin, run.end);
  return found;
}

std::map<std::uint64_t, std::optional<IntervalSet>> noted_points(sqlite3* database) {
  std::map<std::uint64_t, std::optional<IntervalSet>> found;
  Statement studies(database, "SELECT study_id FROM studies");
  while (studies.step()) {
    found[number(studies, 0)] = noted_points_of(database, number(studies, 0));
  }
  return found;
}

std::optional<IntervalSet> noted_points_of(sqlite3* database, std::uint64_t study_id) {
  Statement study(database, "SELECT 1 FROM studies WHERE study_id = ? AND counted");
  study.bind_all(study_id);
  if (!study.step()) {
    return std::nullopt;
  }
  return all_ranges(database, study_id);
}

CompletedRanges::CompletedRanges(sqlite3* database)
    : database_(database),
      before_(database,
              "SELECT first_point, points FROM completed_ranges WHERE study_id = ?"
              " AND first_point BETWEEN 0 AND ? ORDER BY first_point DESC LIMIT 1"),
      take_out_(database,
                "DELETE FROM completed_ranges WHERE study_id = ? AND first_point BETWEEN ? AND ?"
                " RETURNING first_point + points"),
      between_(database,
               "SELECT first_point, points FROM completed_ranges WHERE study_id = ?"
               " AND first_point BETWEEN ? AND ?"),
      put_(database, "INSERT OR REPLACE INTO completed_ranges VALUES (?, ?, ?)") {}

/// The last range that begins at or before the point.
std::optional<Interval> CompletedRanges::range_before(std::uint64_t study_id, std::uint64_t point) {
  std::optional<Interval> range;
  before_.bind_all(study_id, point);
  if (before_.step()) {
    range = Interval{number(before_, 0), number(before_, 0) + number(before_, 1)};
  }
  before_.reset();
  return range;
}

/// Deletes the ranges that begin in [first, last]. Returns the end of the last one, or 0.
std::uint64_t CompletedRanges::take_out(std::uint64_t study_id, std::uint64_t first,
                                        std::uint64_t last) {
  std::uint64_t end = 0;
  take_out_.bind_all(study_id, first, last);
  while (take_out_.step()) {
    end = std::max(end, number(take_out_, 0));
  }
  take_out_.reset();
  return end;
}

void CompletedRanges::flush() {
  for (const auto& [study_id, points] : gathered_) {
    points.for_each([this, id = study_id](const Interval& range) { write(id, range); });
  }
  gathered_.clear();
}

void CompletedRanges::write(std::uint64_t study_id, const Interval& range) {
  Interval whole = range;
  const auto before = range_before(study_id, range.begin);
  if (before && before->end >= range.begin) {
    whole = {before->begin, std::max(range.end, before->end)};
  }
  whole.end = std::max(whole.end, take_out(study_id, whole.begin + 1, whole.end));
  put_.bind_all(study_id, whole.begin, whole.end - whole.begin);
  put_.run();
}

IntervalSet CompletedRanges::overlapping(std::uint64_t study_id, const Interval& points) {
  IntervalSet found;
  if (const auto before = range_before(study_id, points.begin);
      before && before->end > points.begin) {
    found.insert(before->begin, before->end);
  }
  Statement& rows = between_;
  rows.bind_all(study_id, points.begin, points.end - 1);
  while (rows.step()) {
    found.insert(number(rows, 0), number(rows, 0) + number(rows, 1));
  }
  rows.reset();
  return found;
}

IntervalSet CompletedRanges::open_points(std::uint64_t study_id, const IntervalSet& points) {
  IntervalSet open = points;
  const auto added = gathered_.find(study_id);
  points.for_each([&](const Interval& range) {
    open = without(std::move(open), overlapping(study_id, range));
    if (added != gathered_.end()) {
      for (const Interval& part : added->second.within(range.begin, range.end)) {
        open.erase(part.begin, part.end);
      }
    }
  });
  return open;
}

void CompletedRanges::remove(std::uint64_t study_id, const IntervalSet& points) {
  points.for_each([&](const Interval& gone) {
    const auto before = range_before(study_id, gone.begin);
    const bool overlaps = before && before->end > gone.begin;
    const std::uint64_t begin = overlaps ? before->begin : gone.begin;
    std::uint64_t end = overlaps ? before->end : gone.begin;
    end = std::max(end, take_out(study_id, begin, gone.end - 1));
    for (const Interval& rest : {Interval{begin, gone.begin}, Interval{gone.end, end}}) {
      if (rest.begin < rest.end) {
        write(study_id, rest);
      }
    }
  });
}

bool CompletedRanges::is_counted(std::uint64_t study_id) {
  Statement query(database_, "SELECT 1 FROM studies WHERE study_id = ? AND counted");
  query.bind_all(study_id);
  return query.step();
}

void CompletedRanges::set_counted(std::uint64_t study_id) {
  execute_with(database_, "UPDATE studies SET counted = 1 WHERE study_id = ?", study_id);
}

void CompletedRanges::count_again(std::uint64_t study_id, const StudyTable& table) {
  const IntervalSet with_row = all_points_with_row(database_, study_id);
  // Evaluating the filter takes time, so it is evaluated only for points without a row.
  const IntervalSet rest = without(all_ranges(database_, study_id), with_row);
  replace(study_id, with_row, left_out_of(table, rest));
}

void CompletedRanges::count_again(std::uint64_t study_id, const IntervalSet& left_out) {
  const IntervalSet with_row = all_points_with_row(database_, study_id);
  replace(study_id, with_row, without(left_out, with_row));
}

void CompletedRanges::replace(std::uint64_t study_id, const IntervalSet& with_row,
                              const IntervalSet& left_out) {
  execute_with(database_, "DELETE FROM completed_ranges WHERE study_id = ?", study_id);
  execute_with(database_, "UPDATE studies SET left_out = ?2 WHERE study_id = ?1", study_id,
               left_out.size());
  for (const IntervalSet* points : {&with_row, &left_out}) {
    points->for_each([&](const Interval& range) { write(study_id, range); });
  }
  set_counted(study_id);
}

}  // namespace oblique::server
