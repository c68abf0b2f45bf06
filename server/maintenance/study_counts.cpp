#include "server/maintenance/study_counts.h"

namespace oblique::server {
void count_reused_and_set_state(sqlite3* database, std::uint64_t study_id) {
  for (const char* sql :
       {"DELETE FROM main.reused_points WHERE study_id = ?1",
        // `reused_from` is STUDY/POINT, and the name of a study may contain slashes.
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
