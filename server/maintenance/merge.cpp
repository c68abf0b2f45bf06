#include "server/maintenance/merge.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "server/database/draft_file.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"
#include "server/maintenance/backup.h"
#include "server/maintenance/check.h"
#include "server/maintenance/merged_studies.h"
#include "server/maintenance/study_counts.h"
#include "server/store/rows/row_columns.h"
#include "server/store/schema/schema_setup.h"
#include "server/store/store.h"

namespace oblique::server {
namespace {

/// The longest value of a database: it came in one message.
constexpr int kLongestValue = static_cast<int>(2 * protocol::kMaxFrameBytes);

/// Throws StorageError when a table of the source computes its values, which could go on without
/// end, or a row is damaged.
void check_source(const std::string& path) {
  const DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
  sqlite3_limit(database.get(), SQLITE_LIMIT_LENGTH, kLongestValue);
  Statement computed(
      database.get(),
      fmt::format("SELECT t.name FROM pragma_table_list AS t WHERE t.name COLLATE NOCASE IN ('{}')"
                  " AND (t.type <> 'table' OR NOT t.strict OR EXISTS"
                  " (SELECT 1 FROM pragma_table_xinfo(t.name) WHERE hidden > 1))",
                  fmt::join(our_tables(), "', '")));
  if (computed.step()) {
    throw StorageError(fmt::format("{} in it is no table as servers make it", computed.text(0)));
  }
  add_row_checksum(database.get());
  if (const auto faults = faults_of_rows(database.get(), 1); !faults.empty()) {
    throw StorageError(faults.front() +
                       ": `oblique check` tells more, and `oblique backup --salvage` saves what "
                       "can be merged");
  }
}

/// Copies what results refer to, and fills temporary tables `..._places` that map each number in
/// the source to one in main. Rows are matched by all that identifies them.
void place_references(sqlite3* database) {
  std::string model = "lengths_m, definition";
  for (const auto& key : solver::model_keys()) {
    model += ", " + std::string(key.name);
  }
  const std::string worker = "name, threads, solver_version, instruction_set, joined_at";
  const auto place = [&](const std::string& table, const std::string& id,
                         const std::string& columns, const std::string& identity,
                         const std::string& checksum) {
    execute(
        database,
        fmt::format(
            "INSERT INTO main.{0} ({2}) SELECT {2} FROM source.{0}"
            " WHERE ({3}) NOT IN (SELECT {3} FROM main.{0}) GROUP BY {3};"
            "CREATE TEMP TABLE {0}_places (source INTEGER PRIMARY KEY, target INTEGER NOT NULL);"
            "INSERT INTO temp.{0}_places SELECT s.{1}, min(t.{1}) FROM source.{0} AS s"
            " JOIN main.{0} AS t USING ({3}) GROUP BY s.{1};",
            table, id, columns, identity));
    if (!checksum.empty()) {  // it covers the number, which the row has only now
      execute(database, fmt::format("UPDATE main.{0} SET checksum = {2} WHERE checksum IS NULL AND"
                                    " {1} IN (SELECT target FROM temp.{0}_places)",
                                    table, id, checksum));
    }
  };
  place("models", "model_id", model, "definition", "");
  place("workers", "worker_id", worker, worker, worker_checksum_sql());
  place("texts", "text_id", "text", "text", text_checksum_sql());
}

void place_studies_by_sql(sqlite3* database, const std::vector<StudyPlace>& places) {
  execute(database,
          "CREATE TEMP TABLE studies_places (source INTEGER PRIMARY KEY, target INTEGER NOT NULL)");
  Statement insert(database, "INSERT INTO temp.studies_places VALUES (?, ?)");
  for (const StudyPlace& place : places) {
    insert.bind(1, place.source_id);
    insert.bind(2, place.id);
    insert.run();
  }
}

/// Maps the studies from which results were taken over. One that is not merged keeps its name,
/// under a number that no study gets.
void place_origins(sqlite3* database) {
  execute(
      database,
      "CREATE TEMP TABLE origins_places (source INTEGER PRIMARY KEY, target INTEGER, name TEXT);"
      "INSERT INTO temp.origins_places SELECT n.origin,"
      " p.target, coalesce(s.name, o.name, 'study number ' || n.origin || ' (deleted)')"
      " FROM (SELECT DISTINCT CAST(taken_from AS INTEGER) AS origin FROM source.packed_results"
      " WHERE taken_from IS NOT NULL) AS n"
      " LEFT JOIN temp.studies_places AS p ON p.source = n.origin"
      " LEFT JOIN main.studies AS s ON s.study_id = p.target"
      " LEFT JOIN source.origins AS o ON o.origin_id = n.origin;"
      // A name without a study may have a number from an earlier merge.
      "UPDATE temp.origins_places SET target = (SELECT min(o.origin_id) FROM main.origins AS o"
      " WHERE o.name = origins_places.name"
      " AND o.origin_id NOT IN (SELECT study_id FROM main.studies)) WHERE target IS NULL;");
  execute(database, fmt::format("UPDATE temp.origins_places SET target = n.last + n.place FROM"
                                " (SELECT source, {} AS last, row_number() OVER () AS place"
                                " FROM temp.origins_places WHERE target IS NULL) AS n"
                                " WHERE n.source = origins_places.source",
                                last_study_id_sql()));
  execute(database,
          "INSERT OR IGNORE INTO main.origins (origin_id, name)"
          " SELECT target, name FROM temp.origins_places;"
          "UPDATE main.about SET last_study_id = max(last_study_id,"
          " coalesce((SELECT max(target) FROM temp.origins_places), 0));");
}

/// The rows of the source as main will have them, as the temporary view `incoming`.
void make_incoming_view(sqlite3* database) {
  const auto mapped = [](std::string_view table, std::string_view column) {
    return fmt::format("(SELECT target FROM temp.{}_places WHERE source = r.{})", table, column);
  };
  std::string columns;
  for (const std::string_view name : packed_columns()) {
    std::string value = fmt::format("r.{}", name);
    if (name == "study_id") {
      value = mapped("studies", name);
    } else if (name == "model_id") {
      value = mapped("models", name);
    } else if (name == "worker") {
      value = mapped("workers", name);
    } else if (name == "mode" || name == "major_mode" || name == "margin_event") {
      value = mapped("texts", name);
    } else if (name == "taken_from") {  // ORIGIN/POINT
      value =
          "(SELECT target FROM temp.origins_places WHERE source = CAST(r.taken_from AS INTEGER))"
          " || substr(r.taken_from, instr(r.taken_from, '/'))";
    }
    columns += fmt::format(", {} AS {}", value, name);
  }
  execute(database, fmt::format("CREATE TEMP VIEW incoming AS SELECT r.study_id AS source_study,"
                                " r.checksum IS NOT NULL AS has_checksum{}"
                                " FROM source.packed_results AS r",
                                columns));
}

/// The outputs that differ between the rows `i` and `t`, as ', NAME, NAME'. The time that a solver
/// took is no output.
std::string differences_sql() {
  const auto version = [](std::string_view row) {
    return fmt::format("(SELECT solver_version FROM main.workers WHERE worker_id = {}.worker)",
                       row);
  };
  std::string sql = fmt::format("CASE WHEN {} IS NOT {} THEN ', solver_version' ELSE '' END",
                                version("i"), version("t"));
  for (const std::string_view name : packed_outputs()) {
    if (name != "wall") {
      sql += fmt::format(" || CASE WHEN i.{0} IS NOT t.{0} THEN ', {1}' ELSE '' END", name,
                         shown_name(name));
    }
  }
  return sql;
}

/// Merges rows in parts: the points of a study above ?2 up to ?3, where ?1 is its number in the
/// source and ?4 that in the target.
class RowMerge {
 public:
  RowMerge(sqlite3* database, Merged& merged)
      : database_(database),
        merged_(merged),
        outside_(database,
                 "SELECT point FROM source.packed_results WHERE study_id = ?1"
                 " AND (point < 0 OR point >= ?2) LIMIT 1"),
        part_(database,
              "SELECT count(*), max(point) FROM (SELECT point FROM source.packed_results"
              " WHERE study_id = ?1 AND point > ?2 ORDER BY point LIMIT 4096)"),
        differing_(database,
                   fmt::format("SELECT point, differences FROM (SELECT i.point, {} AS differences"
                               " FROM incoming AS i CROSS JOIN main.packed_results AS t"
                               " ON t.study_id = ?4 AND t.point = i.point"
                               " WHERE {} AND i.error IS NULL AND t.error IS NULL)"
                               " WHERE differences <> ''",
                               differences_sql(), kPart)),
        other_version_(
            database,
            fmt::format("SELECT w.solver_version FROM incoming AS i CROSS JOIN main.workers AS w"
                        " ON w.worker_id = i.worker WHERE {} AND w.solver_version <> ?5"
                        " AND NOT EXISTS (SELECT 1 FROM main.packed_results AS t"
                        " WHERE t.study_id = ?4 AND t.point = i.point"
                        " AND (t.error IS NULL OR i.error IS NOT NULL)) LIMIT 1",
                        kPart)),
        remove_failed_(
            database,
            fmt::format("DELETE FROM main.packed_results WHERE study_id = ?4 AND point > ?2"
                        " AND point <= ?3 AND error IS NOT NULL AND point IN"
                        " (SELECT i.point FROM incoming AS i WHERE {} AND i.error IS NULL)",
                        kPart)),
        insert_(database,
                fmt::format("INSERT INTO main.packed_results ({0}, checksum)"
                            " SELECT {0}, CASE WHEN has_checksum THEN {1} END FROM incoming AS i"
                            " WHERE {2} AND study_id = ?4 ON CONFLICT (study_id, point) DO NOTHING",
                            fmt::join(packed_columns(), ", "), result_checksum_sql(), kPart)) {
    Statement points(database, "SELECT sum(points) FROM source.studies");
    points.step();
    expected_ = static_cast<std::uint64_t>(points.integer(0));
  }

  void run(const std::vector<StudyPlace>& places, const Merger::Progress& progress) {
    for (const StudyPlace& place : places) {
      refuse_points_outside(place);
      last_ = -1;
      while (const std::uint64_t rows = next_part(place)) {
        merge_part(place, rows);
        looked_at_ += rows;
        progress(looked_at_, std::max(expected_, looked_at_));
      }
    }
    progress(looked_at_, looked_at_);
  }

 private:
  static constexpr const char* kPart = "i.source_study = ?1 AND i.point > ?2 AND i.point <= ?3";

  void refuse_points_outside(const StudyPlace& place) {
    outside_.bind(1, place.source_id);
    outside_.bind(2, place.points_in_source);
    if (outside_.step()) {
      throw StorageError(
          fmt::format("study number {} has a result of point {}, which it does not "
                      "have: `oblique check` tells more",
                      place.source_id, outside_.integer(0)));
    }
    outside_.reset();
  }

  /// Returns the number of rows of the next part; 0: there is none.
  std::uint64_t next_part(const StudyPlace& place) {
    first_ = last_;
    part_.bind(1, place.source_id);
    part_.bind(2, first_);
    part_.step();
    const auto rows = static_cast<std::uint64_t>(part_.integer(0));
    last_ = part_.integer(1);
    part_.reset();
    return rows;
  }

  Statement& bound(Statement& statement, const StudyPlace& place) const {
    statement.bind(1, place.source_id);
    statement.bind(2, first_);
    statement.bind(3, last_);
    statement.bind(4, place.id);
    return statement;
  }

  void merge_part(const StudyPlace& place, std::uint64_t rows) {
    note_differing(place);
    if (!place.solver_version.empty()) {
      refuse_other_version(place);
    }
    merged_.failures_replaced += changed_by(bound(remove_failed_, place));
    const std::uint64_t added = changed_by(bound(insert_, place));
    merged_.results_added += added;
    merged_.results_known += rows - added;
  }

  std::uint64_t changed_by(Statement& statement) const {
    statement.run();
    return static_cast<std::uint64_t>(sqlite3_changes64(database_));
  }

  void note_differing(const StudyPlace& place) {
    constexpr std::size_t kMostRemarks = 10;
    bound(differing_, place);
    while (differing_.step()) {
      if (++merged_.results_differing <= kMostRemarks) {
        merged_.remarks.push_back(fmt::format("study {}, point {} differs in {}", place.name,
                                              differing_.integer(0), differing_.text(1).substr(2)));
      }
    }
    differing_.reset();
  }

  /// Results of a study come from one solver version.
  void refuse_other_version(const StudyPlace& place) {
    bound(other_version_, place).bind(5, std::string_view(place.solver_version));
    if (other_version_.step()) {
      throw MergeRefused(fmt::format(
          "its results of study {} come from solver version {}, those that are there from {}: "
          "`oblique rename` gives one of the studies another name",
          place.name, other_version_.text(0), place.solver_version));
    }
    other_version_.reset();
  }

  sqlite3* database_;
  Merged& merged_;
  Statement outside_;
  Statement part_;
  Statement differing_;
  Statement other_version_;
  Statement remove_failed_;
  Statement insert_;
  std::int64_t first_ = -1;
  std::int64_t last_ = -1;
  std::uint64_t looked_at_ = 0;
  std::uint64_t expected_ = 0;
};

/// Copies which failed points were retried, counts rows again, and sets the state of studies that
/// have become complete or are no longer.
void settle_studies(sqlite3* database, const std::vector<StudyPlace>& places) {
  execute(database,
          "INSERT INTO main.retries (study_id, first_point, points, attempt, retried_at)"
          " SELECT p.target, r.first_point, r.points, r.attempt, r.retried_at"
          " FROM source.retries AS r JOIN temp.studies_places AS p ON p.source = r.study_id"
          " WHERE (p.target, r.first_point, r.points, r.attempt, r.retried_at) NOT IN"
          " (SELECT study_id, first_point, points, attempt, retried_at FROM main.retries)"
          " ORDER BY r.rowid");
  Statement set(database,
                "UPDATE main.studies SET state = CASE WHEN points = ?2 THEN 'done' ELSE 'running'"
                " END, changed_at = strftime('%Y-%m-%dT%H:%M:%fZ', 'now')"
                " WHERE study_id = ?1 AND (state = 'done') <> (points = ?2)");
  for (const StudyPlace& place : places) {
    const std::uint64_t rows = count_rows_again(database, place.id);
    set.bind(1, place.id);
    set.bind(2, rows);
    set.run();
  }
}

}  // namespace

struct Merger::Parts {
  explicit Parts(const std::string& file) : target(file), path(file) {}

  /// A connection to the target, with the database at `copy` attached as `source`.
  DatabaseHandle connect(const std::string& copy) const {
    DatabaseHandle database = open_database(path, SQLITE_OPEN_READWRITE);
    add_row_checksum(database.get());
    // The store makes the checkpoints; pages that do not fit into so many KiB go to the log.
    execute(database.get(), "PRAGMA wal_autocheckpoint = 0");
    execute(database.get(), "PRAGMA synchronous = FULL");
    execute(database.get(), "PRAGMA cache_size = -65536");
    sqlite3_db_config(database.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
    Statement attach(database.get(), "ATTACH ? AS source");
    attach.bind(1, std::string_view(copy));
    attach.run();
    return database;
  }

  Store target;  // has the schema and the lock
  std::string path;
};

Merger::Merger(const std::string& target) : parts_(std::make_unique<Parts>(target)) {}
Merger::~Merger() = default;

Merged Merger::merge(const std::string& source, const MergeSettings& settings,
                     const Progress& progress) {
  const DraftFile copy(parts_->path + ".merging");
  const std::string remark = copy_into(copy, source, copy.path());
  Merged merged;
  if (!remark.empty()) {
    merged.remarks.push_back(remark);
  }
  try {
    check_source(copy.path());
    const DatabaseHandle database = parts_->connect(copy.path());
    Transaction transaction(database.get());
    const auto places = place_studies(database.get(), settings, merged);
    place_references(database.get());
    place_studies_by_sql(database.get(), places);
    place_origins(database.get());
    make_incoming_view(database.get());
    RowMerge(database.get(), merged).run(places, progress);
    settle_studies(database.get(), places);
    parts_->target.check();
    transaction.commit();
  } catch (const MergeRefused& error) {
    throw MergeRefused(fmt::format("{} was not merged: {}", source, error.what()));
  } catch (const StorageGone&) {
    throw;
  } catch (const StorageError& error) {
    throw StorageError(fmt::format("{} was not merged: {}", source, error.what()));
  }
  parts_->target.check();
  return merged;
}

bool Merger::finish() {
  return parts_->target.merge_log();
}

}  // namespace oblique::server
