#include "server/store/completed_ranges.h"

#include <algorithm>
#include <limits>

namespace oblique::server {
namespace {

std::uint64_t number(const Statement& row, int column) {
  return static_cast<std::uint64_t>(row.integer(column));
}

}  // namespace

IntervalSet points_with_row(sqlite3* database, std::uint64_t study_id, const Interval& points) {
  IntervalSet found;
  Interval run{0, 0};
  Statement rows(database,
                 "SELECT point FROM results WHERE study_id = ? AND point >= ? AND point < ?"
                 " ORDER BY point");
  rows.bind(1, study_id);
  rows.bind(2, points.begin);
  rows.bind(3, points.end);
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
  Statement studies(database, "SELECT study_id, counted FROM studies");
  while (studies.step()) {
    found[number(studies, 0)] =
        studies.integer(1) != 0 ? std::optional(IntervalSet()) : std::nullopt;
  }
  Statement runs(database,
                 "SELECT study_id, first_point, points FROM completed_ranges"
                 " ORDER BY study_id, first_point");
  while (runs.step()) {
    const auto study = found.find(number(runs, 0));
    if (study != found.end() && study->second) {
      study->second->insert(number(runs, 1), number(runs, 1) + number(runs, 2));
    }
  }
  return found;
}

std::optional<IntervalSet> noted_points_of(sqlite3* database, std::uint64_t study_id) {
  Statement study(database, "SELECT 1 FROM studies WHERE study_id = ? AND counted");
  study.bind(1, study_id);
  if (!study.step()) {
    return std::nullopt;
  }
  IntervalSet found;
  Statement runs(database,
                 "SELECT first_point, points FROM completed_ranges WHERE study_id = ?"
                 " ORDER BY first_point");
  runs.bind(1, study_id);
  while (runs.step()) {
    found.insert(number(runs, 0), number(runs, 0) + number(runs, 1));
  }
  return found;
}

struct CompletedRanges::Statements {
  explicit Statements(sqlite3* database)
      : before(database,
               "SELECT first_point, points FROM completed_ranges WHERE study_id = ?"
               " AND first_point BETWEEN 0 AND ? ORDER BY first_point DESC LIMIT 1"),
        take_out(database,
                 "DELETE FROM completed_ranges WHERE study_id = ? AND first_point BETWEEN ? AND ?"
                 " RETURNING first_point + points"),
        between(database,
                "SELECT first_point, points FROM completed_ranges WHERE study_id = ?"
                " AND first_point BETWEEN ? AND ?"),
        put(database, "INSERT OR REPLACE INTO completed_ranges VALUES (?, ?, ?)"),
        is_counted(database, "SELECT 1 FROM studies WHERE study_id = ? AND counted"),
        set_counted(database, "UPDATE studies SET counted = 1 WHERE study_id = ?"),
        clear(database, "DELETE FROM completed_ranges WHERE study_id = ?") {}

  /// The last range that begins at or before the point.
  std::optional<Interval> range_before(std::uint64_t study_id, std::uint64_t point) {
    std::optional<Interval> range;
    before.bind(1, study_id);
    before.bind(2, point);
    if (before.step()) {
      range = Interval{number(before, 0), number(before, 0) + number(before, 1)};
    }
    before.reset();
    return range;
  }

  /// Takes out the ranges that begin in [first, last]. Returns the end of the last one, or 0.
  std::uint64_t take_out_ranges(std::uint64_t study_id, std::uint64_t first, std::uint64_t last) {
    std::uint64_t end = 0;
    take_out.bind(1, study_id);
    take_out.bind(2, first);
    take_out.bind(3, last);
    while (take_out.step()) {
      end = std::max(end, number(take_out, 0));
    }
    take_out.reset();
    return end;
  }

  Statement before;
  Statement take_out;
  Statement between;
  Statement put;
  Statement is_counted;
  Statement set_counted;
  Statement clear;
};

CompletedRanges::CompletedRanges(sqlite3* database)
    : database_(database), statements_(std::make_unique<Statements>(database)) {}
CompletedRanges::~CompletedRanges() = default;

void CompletedRanges::flush() {
  for (const auto& [study_id, points] : gathered_) {
    points.for_each([this, id = study_id](const Interval& range) { write(id, range); });
  }
  gathered_.clear();
}

void CompletedRanges::write(std::uint64_t study_id, const Interval& range) {
  Interval whole = range;
  const auto before = statements_->range_before(study_id, range.begin);
  if (before && before->end >= range.begin) {
    whole = {before->begin, std::max(range.end, before->end)};
  }
  whole.end =
      std::max(whole.end, statements_->take_out_ranges(study_id, whole.begin + 1, whole.end));
  Statement& put = statements_->put;
  put.bind(1, study_id);
  put.bind(2, whole.begin);
  put.bind(3, whole.end - whole.begin);
  put.run();
}

IntervalSet CompletedRanges::overlapping(std::uint64_t study_id, const Interval& points) {
  IntervalSet found;
  if (const auto before = statements_->range_before(study_id, points.begin);
      before && before->end > points.begin) {
    found.insert(before->begin, before->end);
  }
  Statement& rows = statements_->between;
  rows.bind(1, study_id);
  rows.bind(2, points.begin);
  rows.bind(3, points.end - 1);
  while (rows.step()) {
    found.insert(number(rows, 0), number(rows, 0) + number(rows, 1));
  }
  rows.reset();
  return found;
}

void CompletedRanges::remove(std::uint64_t study_id, const IntervalSet& points) {
  points.for_each([&](const Interval& gone) {
    const auto before = statements_->range_before(study_id, gone.begin);
    const bool overlaps = before && before->end > gone.begin;
    const std::uint64_t begin = overlaps ? before->begin : gone.begin;
    std::uint64_t end = overlaps ? before->end : gone.begin;
    end = std::max(end, statements_->take_out_ranges(study_id, begin, gone.end - 1));
    for (const Interval& rest : {Interval{begin, gone.begin}, Interval{gone.end, end}}) {
      if (rest.begin < rest.end) {
        write(study_id, rest);
      }
    }
  });
}

bool CompletedRanges::is_counted(std::uint64_t study_id) {
  Statement& query = statements_->is_counted;
  query.bind(1, study_id);
  const bool found = query.step();
  query.reset();
  return found;
}

void CompletedRanges::set_counted(std::uint64_t study_id) {
  statements_->set_counted.bind(1, study_id);
  statements_->set_counted.run();
}

void CompletedRanges::count_again(std::uint64_t study_id) {
  constexpr auto kLast = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  const IntervalSet points = points_with_row(database_, study_id, {0, kLast});
  statements_->clear.bind(1, study_id);
  statements_->clear.run();
  points.for_each([&](const Interval& range) { write(study_id, range); });
  set_counted(study_id);
}

}  // namespace oblique::server
