#include "server/maintenance/merge.h"

#include <algorithm>
#include <memory>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "server/database/database_file.h"
#include "server/database/sqlite.h"
#include "server/maintenance/backup.h"
#include "server/store/completed_ranges.h"
#include "server/store/result_rows.h"
#include "server/store/schema.h"
#include "server/study/study_table.h"

namespace oblique::server {
namespace {

struct StudyRow {
  std::uint64_t id;
  std::string name;
  StudyTable table;
};

constexpr const char* kStudyColumns = "study_id, name, recipe, points";

StudyRow study_in(const Statement& row) {
  return {row.number(0), row.text(1), StudyTable(row.text(2), row.number(3))};
}

// In the statements below, ?1 is the study's number in the source and ?2 its number in the target.

/// Selects points that are solved in both databases and differ in outputs other than `wall_s`.
std::string differing_sql() {
  const auto outputs = [](const char* table) {
    std::string names;
    for (const std::string_view name : output_columns()) {
      names +=
          name == "wall_s" ? "" : fmt::format("{}{}.{}", names.empty() ? "" : ", ", table, name);
    }
    return names;
  };
  return fmt::format(
      "SELECT i.point FROM source.results AS i"
      " CROSS JOIN main.results AS t ON t.study_id = ?2 AND t.point = i.point"
      " WHERE i.study_id = ?1 AND i.error IS NULL AND t.error IS NULL AND ({}) IS NOT ({})",
      outputs("i"), outputs("t"));
}

constexpr const char* kRemoveFailed =
    "DELETE FROM main.results WHERE study_id = ?2 AND error IS NOT NULL AND point IN"
    " (SELECT i.point FROM source.results AS i WHERE i.study_id = ?1 AND i.error IS NULL)";

std::string insert_sql() {
  std::vector<std::string> values;
  for (const std::string_view name : result_columns()) {
    values.push_back(name == "study_id"    ? "?2"
                     : name == "model_id"  ? "m.target"
                     : name == "worker_id" ? "w.target"
                                           : fmt::format("i.{}", name));
  }
  return fmt::format(
      "INSERT INTO main.results ({0}, checksum)"
      " SELECT {1}, CASE WHEN i.checksum IS NOT NULL THEN row_checksum({1}) END"
      " FROM source.results AS i CROSS JOIN temp.model_map AS m ON m.source = i.model_id"
      " LEFT JOIN temp.worker_map AS w ON w.source = i.worker_id WHERE i.study_id = ?1"
      " ON CONFLICT (study_id, point) DO NOTHING",
      fmt::join(result_columns(), ", "), fmt::join(values, ", "));
}

/// Merges one source. The caller provides the transaction.
class SourceMerge {
 public:
  /// `database` is the connection to the target. `source` must be attached to it.
  SourceMerge(sqlite3* database, sqlite3* source, const std::string& rename_prefix, Merged& merged)
      : database_(database), source_(source), rename_prefix_(rename_prefix), merged_(merged) {}

  void run() {
    // for each study of the source: its number there, and the study in the target
    std::vector<std::pair<std::uint64_t, StudyRow>> places;
    Statement list(source_, fmt::format("SELECT {} FROM studies ORDER BY study_id", kStudyColumns));
    while (list.step()) {
      const StudyRow study = study_in(list);
      places.emplace_back(study.id, place_of(study));
    }
    copy_models_and_workers();
    Statement count(source_, "SELECT count(*) FROM results WHERE study_id = ?");
    for (const auto& [source_id, target] : places) {
      count.reset();
      count.bind_all(source_id);
      count.step();
      merge_rows(source_id, target, count.number(0));
      finish(source_id, target);
    }
  }

 private:
  /// Returns the target's study for the source's `study`. Tries the name of `study`, and then the
  /// name with the prefix. If the target has no study of that name, creates it. If one recipe
  /// begins with the other, unites the studies.
  StudyRow place_of(const StudyRow& study) {
    std::string conflict;
    for (const std::string& name : {study.name, rename_prefix_ + study.name}) {
      Statement find(database_,
                     fmt::format("SELECT {} FROM main.studies WHERE name = ?", kStudyColumns));
      find.bind_all(name);
      if (!find.step()) {
        return add(study, name);
      }
      const StudyRow known = study_in(find);
      const Growth growth = known.table.growth_to(study.table);
      if (growth.kind != Growth::Kind::kOther) {
        return unite(study, known, growth);
      }
      conflict = fmt::format("there is a study called \"{}\" with another recipe ({})", name,
                             growth.difference);
    }
    std::ranges::replace(conflict, '\n', ';');
    throw MergeRefused(conflict +
                       (rename_prefix_.empty()
                            ? ". Use --rename-prefix PREFIX to give such studies other names"
                            : ". Use another --rename-prefix"));
  }

  StudyRow add(const StudyRow& study, const std::string& name) {
    if (const std::string error = protocol::study_name_error(name); !error.empty()) {
      throw MergeRefused(error);
    }
    ++merged_.studies_added;
    execute_with(
        database_,
        fmt::format("INSERT INTO main.studies (study_id, name, recipe, points, errors, state,"
                    " created_at, changed_at, priority, checksum)"
                    " SELECT n.id, ?1, recipe, points, errors, state, created_at, changed_at,"
                    " priority, row_checksum(n.id, recipe, points, errors, created_at)"
                    " FROM source.studies, (SELECT 1 + {} AS id) AS n WHERE study_id = ?2",
                    kLastStudyId),
        name, study.id);
    return {static_cast<std::uint64_t>(sqlite3_last_insert_rowid(database_)), name, study.table};
  }

  StudyRow unite(const StudyRow& study, const StudyRow& known, const Growth& growth) {
    ++merged_.studies_united;
    refuse_other_version(study.id, known);
    if (growth.kind != Growth::Kind::kLonger) {
      return known;
    }
    ++merged_.studies_grown;
    execute_with(database_,
                 "UPDATE main.studies SET recipe = ?2, points = ?3,"
                 " checksum = row_checksum(study_id, ?2, ?3, errors, created_at)"
                 " WHERE study_id = ?1",
                 known.id, Blob{study.table.recipe_bytes()}, study.table.size());
    return {known.id, known.name, study.table};
  }

  /// All results of a study must come from the same solver version.
  void refuse_other_version(std::uint64_t source_id, const StudyRow& known) const {
    Statement other(database_,
                    "SELECT theirs.solver_version, ours.solver_version"
                    " FROM (SELECT solver_version FROM main.results CROSS JOIN main.workers"
                    " USING (worker_id) WHERE study_id = ?1 ORDER BY point LIMIT 1) AS ours"
                    " CROSS JOIN source.results AS r CROSS JOIN source.workers AS theirs"
                    " USING (worker_id) WHERE r.study_id = ?2"
                    " AND theirs.solver_version <> ours.solver_version LIMIT 1");
    other.bind_all(known.id, source_id);
    if (other.step()) {
      throw MergeRefused(fmt::format(
          "its results of study {} come from solver version {}, those of the target from {}: "
          "rename one of the studies (`oblique rename`)",
          known.name, other.text(0), other.text(1)));
    }
  }

  /// Copies missing models and workers. Makes the temporary tables `model_map` and `worker_map`,
  /// which map numbers in the source to numbers in the target.
  void copy_models_and_workers() const {
    const auto copy = [&](const std::string& name, const std::string& columns,
                          const std::string& identity) {
      execute(database_,
              fmt::format(
                  "INSERT INTO main.{0}s ({1}) SELECT {1} FROM source.{0}s"
                  " WHERE ({2}) NOT IN (SELECT {2} FROM main.{0}s) GROUP BY {2};"
                  "DROP TABLE IF EXISTS temp.{0}_map;"
                  "CREATE TEMP TABLE {0}_map (source INTEGER PRIMARY KEY, target INTEGER NOT NULL);"
                  "INSERT INTO temp.{0}_map SELECT s.{0}_id, min(t.{0}_id) FROM source.{0}s AS s"
                  " JOIN main.{0}s AS t USING ({2}) GROUP BY s.{0}_id;",
                  name, columns, identity));
    };
    copy("model", fmt::format("{}, checksum", fmt::join(model_columns(), ", ")), "definition");
    const std::string worker = "name, threads, solver_version, instruction_set, joined_at";
    copy("worker", worker, worker);
  }

  void merge_rows(std::uint64_t source_id, const StudyRow& target, std::uint64_t rows) {
    Statement differing(database_, differing_sql());
    differing.bind_all(source_id, target.id);
    note_differing(differing, target.name);
    const auto changed_by = [&](const std::string& sql) {
      execute_with(database_, sql, source_id, target.id);
      return static_cast<std::uint64_t>(sqlite3_changes64(database_));
    };
    merged_.failures_replaced += changed_by(kRemoveFailed);
    const std::uint64_t added = changed_by(insert_sql());
    merged_.results_added += added;
    merged_.results_known += rows - added;
  }

  void note_differing(Statement& differing, const std::string& study) {
    constexpr std::size_t kMaxRemarks = 10;
    while (differing.step()) {
      if (++merged_.results_differing <= kMaxRemarks) {
        merged_.remarks.push_back(fmt::format("study {}, point {}: the solved outputs differ",
                                              study, differing.number(0)));
      }
    }
  }

  void finish(std::uint64_t source_id, const StudyRow& target) {
    CompletedRanges ranges(database_);
    completed_points(source_, source_id).for_each([&](const Interval& points) {
      ranges.add(target.id, points);
    });
    ranges.flush();
    // If another program deleted rows of the source, the source's ranges do not match its rows.
    execute_with(database_,
                 "UPDATE main.studies SET counted = 0 WHERE study_id = ?1 AND EXISTS"
                 " (SELECT 1 FROM source.studies WHERE study_id = ?2 AND NOT counted)",
                 target.id, source_id);
    count_completed_points(database_);
    update_counts_and_state(database_, target.id);
  }

  sqlite3* database_;
  sqlite3* source_;
  const std::string& rename_prefix_;
  Merged& merged_;
};

}  // namespace

Merged Merger::merge(const std::string& source, const std::string& rename_prefix) {
  const DraftFile copy(path_ + ".merging");
  const auto faults = copy_into(copy, source, copy.path());
  Merged merged;
  try {
    if (!faults.empty()) {
      throw StorageError(faults.front() +
                         ": `oblique check` lists all faults, and `oblique backup --salvage` makes "
                         "a file that can be merged");
    }
    const DatabaseHandle opened = open_database(copy.path(), SQLITE_OPEN_READONLY);
    execute_with(target_.connection(), "ATTACH ? AS source", copy.path());
    const auto detach = [](sqlite3* database) {
      sqlite3_exec(database, "DETACH source", nullptr, nullptr, nullptr);
    };
    const std::unique_ptr<sqlite3, decltype(detach)> attached(target_.connection(), detach);
    // Limits the memory of the transaction: SQLite writes pages beyond this cache to the log.
    execute(target_.connection(), "PRAGMA main.cache_size = -65536");
    target_.write([&] {
      SourceMerge(target_.connection(), opened.get(), rename_prefix, merged).run();
      target_.check();
    });
  } catch (const MergeRefused& error) {
    throw MergeRefused(fmt::format("{} was not merged: {}", source, error.what()));
  } catch (const StorageGone&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw StorageError(fmt::format("{} was not merged: {}", source, error.what()));
  }
  return merged;
}

}  // namespace oblique::server
