#include "server/store/migrated_rows.h"

#include <string>

#include "server/store/rows/old_rows.h"
#include "server/store/rows/old_workers.h"
#include "server/store/rows/packed_row.h"
#include "server/store/rows/row_columns.h"
#include "server/store/rows/settled_runs.h"

namespace oblique::server {
namespace {

constexpr int kSchema = kFirstPacked - 1;
constexpr std::uint64_t kRowsBetweenReports = 10'000;

class RowMigration {
 public:
  explicit RowMigration(sqlite3* database)
      : old_(database, kSchema),
        texts_(database),
        workers_(database),
        insert_(database),
        settled_(database),
        read_(database, "SELECT checksum IS NULL, checksum IS NULL OR checksum = " +
                            result_checksum_sql(kSchema) + ", " + OldRows::columns_sql(kSchema) +
                            " FROM results_7 ORDER BY study_id, point") {}

  MigratedRows run(const std::function<void(std::uint64_t)>& progress) {
    MigratedRows rows;
    while (read_.step()) {
      ++(take_row() ? rows.kept : rows.left_out);
      if (const std::uint64_t looked_at = rows.kept + rows.left_out;
          looked_at % kRowsBetweenReports == 0) {
        settled_.flush();
        progress(looked_at);
      }
    }
    read_.reset();
    settled_.flush();
    return rows;
  }

 private:
  static constexpr int kFirst = 2;  // column of the row itself

  bool take_row() {
    if (read_.integer(1) == 0 || !old_.pack(read_, kFirst, texts_, row_)) {
      return false;
    }
    OldRows::name_worker(read_, kFirst, workers_, row_);
    insert_.run(row_, read_.integer(0) == 0);
    settled_.add(static_cast<std::uint64_t>(row_.at(0).whole),
                 static_cast<std::uint64_t>(row_.at(1).whole));
    return true;
  }

  OldRows old_;
  TextNumbers texts_;
  OldWorkers workers_;
  RowInsert insert_;
  SettledRuns settled_;
  PackedRow row_;
  Statement read_;
};

}  // namespace

MigratedRows migrate_rows(sqlite3* database, const std::function<void(std::uint64_t)>& progress) {
  const MigratedRows rows = RowMigration(database).run(progress);
  const std::string is_complete =
      "points = (SELECT coalesce(sum(s.points), 0) FROM settled_points AS s"
      " WHERE s.study_id = studies.study_id)";
  execute(database,
          "UPDATE studies SET state = 'running' WHERE state = 'done' AND NOT " + is_complete);
  // The others are counted when a server starts, which goes on with them.
  execute(database, "UPDATE studies SET counted = 1 WHERE " + is_complete);
  return rows;
}

}  // namespace oblique::server
