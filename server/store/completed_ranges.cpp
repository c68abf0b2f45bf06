#include "server/store/completed_ranges.h"

#include <algorithm>

namespace oblique::server {
namespace {

Interval interval_in(const Statement& row) {
  return {row.number(0), row.number(0) + row.number(1)};
}

}  // namespace

IntervalSet completed_points(sqlite3* database, std::uint64_t study_id) {
  IntervalSet found;
  Statement ranges(database,
                   "SELECT first_point, points FROM completed_ranges WHERE study_id = ?"
                   " ORDER BY first_point");
  ranges.bind_all(study_id);
  while (ranges.step()) {
    const Interval range = interval_in(ranges);
    found.insert(range.begin, range.end);
  }
  return found;
}

void count_completed_points(sqlite3* database) {
  // In a run of consecutive points, the point minus the row number is constant.
  execute(database, R"sql(
    DELETE FROM completed_ranges WHERE study_id IN (SELECT study_id FROM studies WHERE NOT counted);
    INSERT INTO completed_ranges (study_id, first_point, points)
      SELECT study_id, min(point), count(*) FROM
        (SELECT study_id, point,
                point - row_number() OVER (PARTITION BY study_id ORDER BY point) AS run
         FROM results WHERE study_id IN (SELECT study_id FROM studies WHERE NOT counted))
      GROUP BY study_id, run;
    UPDATE studies SET counted = 1, left_out = 0 WHERE NOT counted;
  )sql");
}

void update_counts_and_state(sqlite3* database, std::uint64_t study_id) {
  constexpr const char* kCompleted =
      "(SELECT coalesce(sum(points), 0) FROM main.completed_ranges WHERE study_id = ?1)";
  const std::string completed = kCompleted;
  for (const std::string& sql :
       {"UPDATE main.studies SET left_out = " + completed +
            " - (SELECT count(*) FROM main.results WHERE study_id = ?1) WHERE study_id = ?1",
        std::string("DELETE FROM main.reused_points WHERE study_id = ?1"),
        // Removes "/POINT" from `reused_from`, which is STUDY/POINT; the study's name may contain
        // slashes.
        std::string("INSERT INTO main.reused_points (study_id, source, points) SELECT ?1,"
                    " substr(reused_from, 1, length(rtrim(reused_from, '0123456789')) - 1) AS src,"
                    " count(*) FROM main.results WHERE study_id = ?1 AND reused_from IS NOT NULL"
                    " GROUP BY src"),
        "UPDATE main.studies SET state = CASE state WHEN 'done' THEN 'running' ELSE 'done' END,"
        " changed_at = strftime('%Y-%m-%dT%H:%M:%fZ', 'now')"
        " WHERE study_id = ?1 AND (state = 'done') <> (points = " +
            completed + ")"}) {
    execute_with(database, sql, study_id);
  }
}

CompletedRanges::CompletedRanges(sqlite3* database)
    : before_(database,
              "SELECT first_point, points FROM completed_ranges WHERE study_id = ?"
              " AND first_point BETWEEN 0 AND ? ORDER BY first_point DESC LIMIT 1"),
      between_(database,
               "SELECT first_point, points FROM completed_ranges WHERE study_id = ?"
               " AND first_point BETWEEN ? AND ?"),
      take_out_(database,
                "DELETE FROM completed_ranges WHERE study_id = ? AND first_point BETWEEN ? AND ?"
                " RETURNING first_point + points"),
      put_(database, "INSERT OR REPLACE INTO completed_ranges VALUES (?, ?, ?)") {}

std::optional<Interval> CompletedRanges::range_before(std::uint64_t study_id, std::uint64_t point) {
  std::optional<Interval> range;
  before_.bind_all(study_id, point);
  if (before_.step()) {
    range = interval_in(before_);
  }
  before_.reset();
  return range;
}

/// Deletes the ranges that begin in [first, last]. Returns the largest of their ends, or 0.
std::uint64_t CompletedRanges::take_out(std::uint64_t study_id, std::uint64_t first,
                                        std::uint64_t last) {
  std::uint64_t end = 0;
  take_out_.bind_all(study_id, first, last);
  while (take_out_.step()) {
    end = std::max(end, take_out_.number(0));
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
  between_.bind_all(study_id, points.begin, points.end - 1);
  while (between_.step()) {
    const Interval range = interval_in(between_);
    found.insert(range.begin, range.end);
  }
  between_.reset();
  return found;
}

IntervalSet CompletedRanges::open_points(std::uint64_t study_id, const IntervalSet& points) {
  IntervalSet open = points;
  const auto erase = [&open](const Interval& range) { open.erase(range.begin, range.end); };
  points.for_each([&](const Interval& range) { overlapping(study_id, range).for_each(erase); });
  if (const auto added = gathered_.find(study_id); added != gathered_.end()) {
    added->second.for_each(erase);
  }
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

}  // namespace oblique::server
