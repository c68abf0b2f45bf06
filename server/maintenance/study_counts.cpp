#include "server/maintenance/study_counts.h"

#include <stdexcept>
#include <utility>

#include "proto/recipe/checks.h"
#include "proto/recipe/point_table.h"
#include "server/store/rows/settled_runs.h"

namespace oblique::server {
namespace {

/// Notes the points without a row that the study's filter leaves out. Costs about a microsecond for
/// each point without a row.
void note_left_out(sqlite3* database, std::uint64_t study_id, SettledRuns& runs) {
  Statement study(database, "SELECT recipe FROM studies WHERE study_id = ?");
  study.bind(1, study_id);
  protocol::Recipe recipe;
  if (!study.step() || !protocol::parse_recipe(study.bytes(0), recipe)) {
    return;
  }
  IntervalSet left_out;
  try {
    const protocol::PointTable table(std::move(recipe));
    IntervalSet open(0, table.has_filter() ? table.size() : 0);
    if (const auto settled = noted_points_of(database, study_id)) {
      settled->for_each([&](const Interval& run) { open.erase(run.begin, run.end); });
    }
    open.for_each([&](const Interval& run) {
      for (std::uint64_t at = run.begin; at < run.end; ++at) {
        const std::uint64_t next = table.first_left_in(at, run.end);
        left_out.insert(at, next);
        at = next;
      }
    });
  } catch (const solver::InputError&) {  // another version has stored it
    return;
  }
  left_out.for_each([&](const Interval& run) { runs.add(study_id, run); });
  runs.flush();
  Statement note(database, "UPDATE studies SET left_out = ?2 WHERE study_id = ?1");
  note.bind(1, study_id);
  note.bind(2, left_out.size());
  note.run();
}

}  // namespace

std::uint64_t count_rows_again(sqlite3* database, std::uint64_t study_id) {
  SettledRuns runs(database);
  runs.count_again(study_id);
  note_left_out(database, study_id, runs);
  for (const char* sql :
       {"DELETE FROM taken_points WHERE study_id = ?1",
        "INSERT INTO taken_points (study_id, origin_id, points)"
        " SELECT ?1, CAST(taken_from AS INTEGER) AS origin, count(*) FROM packed_results"
        " WHERE study_id = ?1 AND taken_from IS NOT NULL GROUP BY origin",
        "INSERT OR IGNORE INTO origins (origin_id, name)"
        " SELECT t.origin_id, coalesce((SELECT s.name FROM studies AS s"
        " WHERE s.study_id = t.origin_id), 'study number ' || t.origin_id || ' (deleted)')"
        " FROM taken_points AS t WHERE t.study_id = ?1"}) {
    Statement statement(database, sql);
    statement.bind(1, study_id);
    statement.run();
  }
  Statement count(database,
                  "SELECT coalesce(sum(points), 0) FROM settled_points WHERE study_id = ?");
  count.bind(1, study_id);
  count.step();
  return static_cast<std::uint64_t>(count.integer(0));
}

}  // namespace oblique::server
