#include "server/maintenance/merge.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/written.h"
#include "server/database/draft_file.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"
#include "server/maintenance/backup.h"
#include "server/maintenance/check.h"
#include "server/maintenance/study_counts.h"
#include "server/store/completed_ranges.h"
#include "server/store/result_rows.h"
#include "server/store/schema.h"
#include "server/study/study_table.h"

namespace oblique::server {
namespace {

/// Opens the copy of a source. Throws StorageError for tables of another definition and for damaged
/// rows.
DatabaseHandle open_sound_source(const std::string& path) {
  // A value that a server stores was part of one message, so it cannot be longer.
  constexpr int kLongestValue = static_cast<int>(2 * protocol::kMaxFrameBytes);
  DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
  sqlite3_limit(database.get(), SQLITE_LIMIT_LENGTH, kLongestValue);
  add_row_checksum(database.get());
  if (const auto faults = diagnose_contents(database.get()).faults; !faults.empty()) {
    throw StorageError(faults.front() +
                       ": `oblique check` tells more, and `oblique backup --salvage` saves what "
                       "can be merged");
  }
  return database;
}

/// A row of `studies`.
struct StudyRow {
  std::uint64_t id;
  std::string name;
  StudyTable table;
};

constexpr const char* kStudyColumns = "study_id, name, recipe, points";

StudyRow study_in(const Statement& row) {
  return {static_cast<std::uint64_t>(row.integer(0)), row.text(1),
          StudyTable(row.text(2), static_cast<std::uint64_t>(row.integer(3)))};
}

/// A study of the source, and the study of the target to which its rows are copied.
struct StudyPlace {
  std::uint64_t source_id;
  StudyRow target;
  IntervalSet completed;  ///< points that were completed in the target or source
};

/// Inserts and grows studies of the target so that each study of the source has a place.
class StudyMerge {
 public:
  StudyMerge(sqlite3* database, sqlite3* source, const std::string& rename_prefix, Merged& merged)
      : database_(database), source_(source), rename_prefix_(rename_prefix), merged_(merged) {}

  /// Throws MergeRefused for a study that has no place in the target.
  std::vector<StudyPlace> run() {
    std::vector<StudyPlace> places;
    Statement list(source_, fmt::format("SELECT {} FROM studies ORDER BY study_id", kStudyColumns));
    while (list.step()) {
      const StudyRow study = study_in(list);
      StudyPlace place{study.id, place_of(study), {}};
      for (const auto& noted :
           {noted_points_of(database_, place.target.id), noted_points_of(source_, study.id)}) {
        noted.value_or(IntervalSet()).for_each([&](const Interval& range) {
          place.completed.insert(range.begin, range.end);
        });
      }
      places.push_back(std::move(place));
    }
    return places;
  }

 private:
  /// The study of the target for `study`: tries its own name, then the name with the prefix. A free
  /// name becomes a new study; a study of the same or a longer or shorter recipe is united with it.
  StudyRow place_of(const StudyRow& study) {
    std::string conflict;
    for (const std::string& name : {study.name, rename_prefix_ + study.name}) {
      Statement find(database_,
                     fmt::format("SELECT {} FROM main.studies WHERE name = ?", kStudyColumns));
      find.bind(1, std::string_view(name));
      if (!find.step()) {
        return add(study, name);
      }
      const StudyRow known = study_in(find);
      const Growth growth = growth_of(known, study);
      if (growth.kind != Growth::Kind::kOther) {
        return unite(study, known, growth);
      }
      conflict = fmt::format("there is a study called \"{}\" with another recipe ({})", name,
                             growth.difference);
    }
    std::replace(conflict.begin(), conflict.end(), '\n', ';');
    throw MergeRefused(conflict + (rename_prefix_.empty()
                                       ? ". --rename-prefix PREFIX gives such studies other names"
                                       : ". Another --rename-prefix gives other names"));
  }

  static Growth growth_of(const StudyRow& known, const StudyRow& study) {
    if (known.table.is_of_the_recipe_of(study.table)) {
      return {Growth::Kind::kSame, {}};
    }
    try {
      return known.table.growth_to(study.table);
    } catch (const std::runtime_error& error) {
      return {Growth::Kind::kOther, error.what()};
    }
  }

  StudyRow unite(const StudyRow& study, const StudyRow& known, const Growth& growth) {
    ++merged_.studies_united;
    refuse_other_version(study.id, known);
    if (growth.kind != Growth::Kind::kLonger) {
      return known;
    }
    ++merged_.studies_grown;
    Statement grow(database_,
                   "UPDATE main.studies SET recipe = ?2, points = ?3,"
                   " checksum = row_checksum(study_id, name, ?2, ?3, created_at)"
                   " WHERE study_id = ?1");
    grow.bind(1, known.id);
    grow.bind_blob(2, study.table.recipe_bytes());
    grow.bind(3, study.table.size());
    grow.run();
    return {known.id, known.name, study.table};
  }

  /// Results of a study come from one solver version.
  void refuse_other_version(std::uint64_t source_id, const StudyRow& known) const {
    Statement present(database_,
                      "SELECT w.solver_version FROM main.results AS r CROSS JOIN main.workers AS w"
                      " USING (worker_id) WHERE r.study_id = ? ORDER BY r.point LIMIT 1");
    present.bind(1, known.id);
    if (!present.step()) {
      return;
    }
    Statement other(source_,
                    "SELECT w.solver_version FROM results AS r CROSS JOIN workers AS w"
                    " USING (worker_id) WHERE r.study_id = ? AND w.solver_version <> ? LIMIT 1");
    other.bind(1, source_id);
    other.bind(2, std::string_view(present.text(0)));
    if (other.step()) {
      throw MergeRefused(fmt::format(
          "its results of study {} come from solver version {}, those that are there from {}: "
          "`oblique rename` gives one of the studies another name",
          known.name, other.text(0), present.text(0)));
    }
  }

  StudyRow add(const StudyRow& study, const std::string& name) {
    if (const std::string objection = protocol::objection_to_study_name(name); !objection.empty()) {
      throw MergeRefused(objection);
    }
    ++merged_.studies_added;
    Statement insert(
        database_,
        fmt::format("INSERT INTO main.studies (study_id, name, recipe, points, state, created_at,"
                    " changed_at, priority, checksum) SELECT n.id, ?1, recipe, points, state,"
                    " created_at, changed_at, priority,"
                    " row_checksum(n.id, ?1, recipe, points, created_at)"
                    " FROM source.studies, (SELECT 1 + {} AS id) AS n WHERE study_id = ?2",
                    last_study_id_sql()));
    insert.bind(1, std::string_view(name));
    insert.bind(2, study.id);
    insert.run();
    return {static_cast<std::uint64_t>(sqlite3_last_insert_rowid(database_)), name, study.table};
  }

  sqlite3* database_;
  sqlite3* source_;
  const std::string& rename_prefix_;
  Merged& merged_;
};

/// Copies the models and workers that the target lacks, and makes the temporary tables `model_map`
/// and `worker_map` from numbers of the source to those of the target.
void copy_models_and_workers(sqlite3* database) {
  const auto copy = [&](const std::string& name, const std::string& columns,
                        const std::string& identity) {
    execute(database,
            fmt::format(
                "INSERT INTO main.{0}s ({1}) SELECT {1} FROM source.{0}s"
                " WHERE ({2}) NOT IN (SELECT {2} FROM main.{0}s) GROUP BY {2};"
                "CREATE TEMP TABLE {0}_map (source INTEGER PRIMARY KEY, target INTEGER NOT NULL);"
                "INSERT INTO temp.{0}_map SELECT s.{0}_id, min(t.{0}_id) FROM source.{0}s AS s"
                " JOIN main.{0}s AS t USING ({2}) GROUP BY s.{0}_id;",
                name, columns, identity));
  };
  std::string model = "definition, lengths_m";
  for (const auto& key : solver::model_keys()) {
    model += ", " + std::string(key.name);
  }
  copy("model", model, "definition");
  const std::string worker = "name, threads, solver_version, instruction_set, joined_at";
  copy("worker", worker, worker);
}

/// Merges rows in parts. Parameters: ?1 the study's number in the source, ?4 in the target; points
/// above ?2 and up to ?3.
class RowMerge {
 public:
  RowMerge(sqlite3* database, Merged& merged)
      : database_(database),
        merged_(merged),
        part_(database,
              "SELECT count(*), max(point) FROM (SELECT point FROM source.results"
              " WHERE study_id = ?1 AND point > ?2 ORDER BY point LIMIT 4096)"),
        differing_(database, differing_sql()),
        remove_failed_(database,
                       fmt::format("DELETE FROM main.results WHERE study_id = ?4 AND point > ?2"
                                   " AND point <= ?3 AND error IS NOT NULL AND point IN"
                                   " (SELECT i.point FROM source.results AS i WHERE {}"
                                   " AND i.error IS NULL)",
                                   kPart)),
        insert_(database, insert_sql()) {}

  void run(const std::vector<StudyPlace>& places, const Merger::Progress& progress) {
    Statement count(database_,
                    "SELECT count(*) FROM source.results"
                    " WHERE study_id IN (SELECT study_id FROM source.studies)");
    count.step();
    const auto all_rows = static_cast<std::uint64_t>(count.integer(0));
    std::uint64_t looked_at = 0;
    for (const StudyPlace& place : places) {
      last_ = -1;
      while (const std::uint64_t rows = next_part(place)) {
        merge_part(place, rows);
        looked_at += rows;
        progress(looked_at, all_rows);
      }
    }
    progress(looked_at, all_rows);
  }

 private:
  static constexpr const char* kPart = "i.study_id = ?1 AND i.point > ?2 AND i.point <= ?3";

  /// Selects the points that are solved in both with different outputs, and the names of these
  /// outputs as ', NAME, NAME'. The time that the solver took is not compared.
  static std::string differing_sql() {
    std::string names;
    for (const std::string_view name : output_columns()) {
      if (name != "wall_s") {
        names += fmt::format("{0}CASE WHEN i.{1} IS NOT t.{1} THEN ', {1}' ELSE '' END",
                             names.empty() ? "" : " || ", name);
      }
    }
    return fmt::format(
        "SELECT point, names FROM (SELECT i.point, {} AS names FROM source.results AS i"
        " CROSS JOIN main.results AS t ON t.study_id = ?4 AND t.point = i.point"
        " WHERE {} AND i.error IS NULL AND t.error IS NULL) WHERE names <> ''",
        names, kPart);
  }

  static std::string insert_sql() {
    std::vector<std::string> values;
    for (const std::string_view name : result_columns()) {
      values.push_back(name == "study_id"    ? "?4"
                       : name == "model_id"  ? "m.target"
                       : name == "worker_id" ? "w.target"
                                             : fmt::format("i.{}", name));
    }
    return fmt::format(
        "INSERT INTO main.results ({0}, checksum)"
        " SELECT {1}, CASE WHEN i.checksum IS NOT NULL THEN row_checksum({1}) END"
        " FROM source.results AS i CROSS JOIN temp.model_map AS m ON m.source = i.model_id"
        " LEFT JOIN temp.worker_map AS w ON w.source = i.worker_id WHERE {2}"
        " ON CONFLICT (study_id, point) DO NOTHING",
        fmt::join(result_columns(), ", "), fmt::join(values, ", "), kPart);
  }

  /// Selects the next part. Returns its number of rows; 0: no rows are left.
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

  void merge_part(const StudyPlace& place, std::uint64_t rows) {
    note_differing(place);
    merged_.failures_replaced += changed_by(bound(remove_failed_, place));
    const std::uint64_t added = changed_by(bound(insert_, place));
    merged_.results_added += added;
    merged_.results_known += rows - added;
  }

  Statement& bound(Statement& statement, const StudyPlace& place) const {
    statement.bind(1, place.source_id);
    statement.bind(2, first_);
    statement.bind(3, last_);
    statement.bind(4, place.target.id);
    return statement;
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
        merged_.remarks.push_back(fmt::format("study {}, point {} differs in {}", place.target.name,
                                              differing_.integer(0), differing_.text(1).substr(2)));
      }
    }
    differing_.reset();
  }

  sqlite3* database_;
  Merged& merged_;
  Statement part_;
  Statement differing_;
  Statement remove_failed_;
  Statement insert_;
  std::int64_t first_ = -1;
  std::int64_t last_ = -1;
};

/// Copies the table `retries`, and counts the points of each study again.
void finish_studies(sqlite3* database, const std::vector<StudyPlace>& places) {
  Statement retries(
      database,
      "INSERT INTO main.retries (study_id, first_point, points, attempt, retried_at)"
      " SELECT ?2, first_point, points, attempt, retried_at FROM source.retries"
      " WHERE study_id = ?1 AND (first_point, points, attempt, retried_at) NOT IN"
      " (SELECT first_point, points, attempt, retried_at FROM main.retries WHERE study_id = ?2)"
      " ORDER BY source.retries.rowid");
  CompletedRanges ranges(database);
  for (const StudyPlace& place : places) {
    retries.bind(1, place.source_id);
    retries.bind(2, place.target.id);
    retries.run();
    // Completed points without a row are points that the filter leaves out.
    ranges.count_again(place.target.id, place.completed);
    count_reused_and_set_state(database, place.target.id);
    place.target.table.release();
  }
}

/// A connection to the target, with the database at `copy` attached as `source`.
DatabaseHandle connect(const std::string& target, const std::string& copy) {
  DatabaseHandle database = open_database(target, SQLITE_OPEN_READWRITE);
  add_row_checksum(database.get());
  // The store makes the checkpoints. Changed pages beyond the cache are written to the log.
  execute(database.get(), "PRAGMA wal_autocheckpoint = 0");
  execute(database.get(), "PRAGMA synchronous = FULL");
  execute(database.get(), "PRAGMA cache_size = -65536");
  sqlite3_db_config(database.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  Statement attach(database.get(), "ATTACH ? AS source");
  attach.bind(1, std::string_view(copy));
  attach.run();
  return database;
}

}  // namespace

Merged Merger::merge(const std::string& source, const MergeSettings& settings,
                     const Progress& progress) {
  const DraftFile copy(path_ + ".merging");
  const std::string remark = copy_into(copy, source, copy.path());
  Merged merged;
  if (!remark.empty()) {
    merged.remarks.push_back(remark);
  }
  try {
    const DatabaseHandle opened = open_sound_source(copy.path());
    const DatabaseHandle database = connect(path_, copy.path());
    Transaction transaction(database.get());
    const auto places =
        StudyMerge(database.get(), opened.get(), settings.rename_prefix, merged).run();
    copy_models_and_workers(database.get());
    RowMerge(database.get(), merged).run(places, progress);
    finish_studies(database.get(), places);
    target_.check();
    transaction.commit();
  } catch (const MergeRefused& error) {
    throw MergeRefused(fmt::format("{} was not merged: {}", source, error.what()));
  } catch (const StorageGone&) {
    throw;
  } catch (const StorageError& error) {
    throw StorageError(fmt::format("{} was not merged: {}", source, error.what()));
  }
  target_.check();
  return merged;
}

}  // namespace oblique::server
