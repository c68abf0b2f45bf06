#include "server/maintenance/study_counts.h"

#include <algorithm>
#include <stdexcept>

#include "server/store/completed_ranges.h"

namespace oblique::server {
namespace {

/// The points of `points` that the study's filter leaves out; none where its recipe cannot be read.
IntervalSet left_out(const StudyTable& table, const IntervalSet& points) {
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

void count_again(sqlite3* database, std::uint64_t study_id, const StudyTable& table,
                 const IntervalSet& noted) {
  CompletedRanges ranges(database);
  ranges.count_again(study_id);
  left_out(table, noted).for_each([&](const Interval& range) { ranges.add(study_id, range); });
  ranges.flush();
  for (const char* sql :
       {"DELETE FROM main.reused_points WHERE study_id = ?1",
        // A source is STUDY/POINT, and a name may have slashes too.
        "INSERT INTO main.reused_points (study_id, source, points)"
        " SELECT ?1, substr(reused_from, 1, length(rtrim(reused_from, '0123456789')) - 1) AS "
        "source,"
        " count(*) FROM main.results WHERE study_id = ?1 AND reused_from IS NOT NULL"
        " GROUP BY source",
        "UPDATE main.studies SET state = CASE state WHEN 'done' THEN 'running' ELSE 'done' END,"
        " changed_at = strftime('%Y-%m-%dT%H:%M:%fZ', 'now') WHERE study_id = ?1"
        " AND (state = 'done') <> (points = (SELECT coalesce(sum(p.points), 0)"
        " FROM main.completed_ranges AS p WHERE p.study_id = ?1))"}) {
    Statement statement(database, sql);
    statement.bind(1, study_id);
    statement.run();
  }
}

}  // namespace oblique::server
