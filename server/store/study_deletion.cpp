#include "server/store/study_deletion.h"

namespace oblique::server {

void StudyDeletion::remove(std::uint64_t study_id) {
  for (const char* sql :
       {"UPDATE about SET last_study_id = max(last_study_id, ?1), has_orphans = 1",
        "INSERT OR IGNORE INTO deletions (study_id) VALUES (?1)",
        "DELETE FROM retries WHERE study_id = ?1", "DELETE FROM reused_points WHERE study_id = ?1",
        "DELETE FROM studies WHERE study_id = ?1"}) {
    execute_with(database_, sql, study_id);
  }
}

bool StudyDeletion::has_rows() const {
  return Statement(database_, "SELECT 1 FROM deletions").step();
}

void StudyDeletion::delete_rows(std::size_t most) {
  Statement first(database_, "SELECT study_id FROM deletions LIMIT 1");
  if (!first.step()) {
    return;
  }
  const auto study = static_cast<std::uint64_t>(first.integer(0));
  first.reset();
  const std::size_t results = delete_some(
      "DELETE FROM results WHERE study_id = ?1 AND point IN"
      " (SELECT point FROM results WHERE study_id = ?1 ORDER BY point LIMIT ?2)",
      study, most);
  rows_ += results;
  const std::size_t ranges = delete_some(
      "DELETE FROM completed_ranges WHERE study_id = ?1 AND first_point IN"
      " (SELECT first_point FROM completed_ranges WHERE study_id = ?1 ORDER BY first_point"
      " LIMIT ?2)",
      study, most - results);
  if (results + ranges < most) {
    execute_with(database_, "DELETE FROM deletions WHERE study_id = ?", study);
  }
}

/// Returns the number of deleted rows.
std::size_t StudyDeletion::delete_some(const char* sql, std::uint64_t study_id, std::size_t most) {
  execute_with(database_, sql, study_id, most);
  return static_cast<std::size_t>(sqlite3_changes(database_));
}

void StudyDeletion::remove_orphans() {
  if (has_rows() || !Statement(database_, "SELECT 1 FROM about WHERE has_orphans").step()) {
    return;
  }
  execute(database_, R"sql(
    CREATE TEMP TABLE used AS SELECT DISTINCT model_id, worker_id FROM results;
    DELETE FROM models WHERE model_id NOT IN (SELECT model_id FROM used);
    DELETE FROM workers WHERE worker_id NOT IN (SELECT worker_id FROM used WHERE worker_id IS NOT NULL);
    DROP TABLE used;
    UPDATE about SET has_orphans = 0;
  )sql");
}

}  // namespace oblique::server
