#include "server/store/study_deletion.h"

namespace oblique::server {
namespace {

constexpr const char* kDeletedStudyWithRows =
    "SELECT study_id FROM deletions AS d"
    " WHERE EXISTS (SELECT 1 FROM results WHERE study_id = d.study_id)"
    " OR EXISTS (SELECT 1 FROM completed_ranges WHERE study_id = d.study_id) LIMIT 1";

}  // namespace

void StudyDeletion::remove(std::uint64_t study_id) {
  for (const char* sql :
       {"UPDATE about SET last_study_id = max(last_study_id, ?1)",
        "INSERT OR IGNORE INTO deletions (study_id) VALUES (?1)",
        "DELETE FROM retries WHERE study_id = ?1", "DELETE FROM reused_points WHERE study_id = ?1",
        "DELETE FROM studies WHERE study_id = ?1"}) {
    Statement statement(database_, sql);
    statement.bind(1, study_id);
    statement.run();
  }
}

bool StudyDeletion::has_rows() const {
  return Statement(database_, kDeletedStudyWithRows).step();
}

void StudyDeletion::delete_rows(std::size_t most) {
  Statement find(database_, kDeletedStudyWithRows);
  if (!find.step()) {
    return;
  }
  const auto study = static_cast<std::uint64_t>(find.integer(0));
  find.reset();
  const std::size_t deleted = delete_some(
      "DELETE FROM results WHERE study_id = ?1 AND point IN"
      " (SELECT point FROM results WHERE study_id = ?1 ORDER BY point LIMIT ?2)",
      study, most);
  rows_ += deleted;
  delete_some(
      "DELETE FROM completed_ranges WHERE study_id = ?1 AND first_point IN"
      " (SELECT first_point FROM completed_ranges WHERE study_id = ?1 ORDER BY first_point LIMIT "
      "?2)",
      study, most - deleted);
}

/// Returns how many rows the statement deleted.
std::size_t StudyDeletion::delete_some(const char* sql, std::uint64_t study_id, std::size_t most) {
  Statement statement(database_, sql);
  statement.bind(1, study_id);
  statement.bind(2, std::uint64_t{most});
  statement.run();
  return static_cast<std::size_t>(sqlite3_changes(database_));
}

void StudyDeletion::remove_orphans() {
  if (!Statement(database_, "SELECT 1 FROM deletions").step() || has_rows()) {
    return;
  }
  execute(database_, R"sql(
    CREATE TEMP TABLE used AS SELECT DISTINCT model_id, worker_id FROM results;
    DELETE FROM models WHERE model_id NOT IN (SELECT model_id FROM used);
    DELETE FROM workers WHERE worker_id NOT IN (SELECT worker_id FROM used WHERE worker_id IS NOT NULL);
    DROP TABLE used;
    DELETE FROM deletions;
  )sql");
}

}  // namespace oblique::server
