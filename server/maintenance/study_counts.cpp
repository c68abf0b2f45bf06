#include "server/maintenance/study_counts.h"

#include "server/store/rows/settled_runs.h"

namespace oblique::server {

std::uint64_t count_rows_again(sqlite3* database, std::uint64_t study_id) {
  SettledRuns(database).count_again(study_id);
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
