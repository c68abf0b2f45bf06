#include "server/maintenance/check.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "server/database/database_file.h"
#include "server/store/completed_ranges.h"
#include "server/store/result_rows.h"
#include "server/store/schema.h"
#include "server/study/study_table.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMaxOfAKind = 20;

void append(std::vector<std::string>& to, sqlite3* database, const std::string& sql) {
  Statement rows(database, sql);
  for (std::size_t i = 0; i < kMaxOfAKind && rows.step(); ++i) {
    to.push_back(rows.text(0));
  }
}

/// The columns that `recipe_fault` reads. They must be the first columns of a row.
constexpr const char* kRecipeColumns = "point, model_id, H, mu, e";

/// Checks studies one after another, each with all its rows in one pass.
class StudyCheck {
 public:
  StudyCheck(sqlite3* database, Diagnosis& found)
      : database_(database),
        found_(found),
        studies_(database, fmt::format("SELECT study_id, name, recipe, points, state, priority,"
                                       " max(length(created_at), length(changed_at)),"
                                       " checksum <> {}, left_out, counted FROM studies"
                                       " ORDER BY study_id",
                                       kStudyChecksum)),
        rows_(database, fmt::format("SELECT {}, checksum IS NULL, coalesce({},"
                                    " CASE WHEN model_id NOT IN (SELECT model_id FROM models)"
                                    " THEN 'its model does not exist'"
                                    " WHEN worker_id IS NOT NULL AND worker_id NOT IN"
                                    " (SELECT worker_id FROM workers)"
                                    " THEN 'its worker does not exist' END)"
                                    " FROM results WHERE study_id = ? ORDER BY point",
                                    kRecipeColumns, row_fault_sql())),
        definition_(database, "SELECT definition FROM models WHERE model_id = ?") {}

  void run() {
    while (studies_.step()) {
      name_ = studies_.text(1);
      if (studies_.integer(7) != 0) {
        add_fault("its number, recipe or size was changed after it was stored");
      }
      check_terms();
      const StudyTable table = read_table();
      check_completed(table, check_rows(table));
    }
    for (const auto* faults : {&study_faults_, &row_faults_}) {
      const auto count = static_cast<std::ptrdiff_t>(std::min(faults->size(), kMaxOfAKind));
      found_.faults.insert(found_.faults.end(), faults->begin(), faults->begin() + count);
    }
    if (without_checksum_ > 0) {
      found_.remarks.push_back(fmt::format(
          "{} of {} results have no checksum, so a flipped bit in them may not be found",
          without_checksum_, all_rows_));
    }
  }

 private:
  void add_fault(const std::string& fault) {
    study_faults_.push_back(fmt::format("study {}, {}: {}", studies_.integer(0), name_, fault));
  }

  /// Reports values that a server never stores. They could prevent its start or the display of a
  /// study.
  void check_terms() {
    constexpr std::int64_t kLongestTime = 64;
    for (const std::string& error :
         {protocol::study_name_error(name_), protocol::priority_error(studies_.integer(5)),
          std::string(studies_.integer(6) > kLongestTime ? "its times are not valid" : "")}) {
      if (!error.empty()) {
        add_fault(error);
      }
    }
  }

  StudyTable read_table() {
    StudyTable table(studies_.text(2), studies_.number(3));
    try {
      (void)table.get();
    } catch (const std::runtime_error& error) {
      add_fault(fmt::format("its recipe cannot be read: {}", error.what()));
    }
    return table;
  }

  IntervalSet check_rows(const StudyTable& table) {
    constexpr int kNoChecksum = 5;
    constexpr int kFault = 6;
    IntervalSet points;
    equal_models_ = {0, -1};
    rows_.bind(1, studies_.integer(0));
    while (rows_.step()) {
      points.insert(rows_.number(0));
      ++all_rows_;
      without_checksum_ += rows_.integer(kNoChecksum) != 0 ? 1U : 0U;
      std::string fault = rows_.text(kFault);
      if (fault.empty() && table.is_made()) {
        fault = recipe_fault(*table.get());
      }
      if (!fault.empty() && row_faults_.size() < kMaxOfAKind) {
        row_faults_.push_back(
            fmt::format("study {}, point {}: {}", name_, rows_.integer(0), fault));
      }
    }
    rows_.reset();
    return points;
  }

  /// Returns the first difference between the current row and the recipe, as a part of a sentence;
  /// empty if they agree. Compares point, H, mu, e and model, with the tolerance of is_close
  /// (proto/recipe/point_table.h), because another machine computed the values. Fast for rows in
  /// the order of their points.
  std::string recipe_fault(const protocol::PointTable& table) {
    if (rows_.number(0) >= table.size()) {  // negative numbers become large unsigned ones
      return "the study has no such point";
    }
    const protocol::Point point = table.point(rows_.number(0));
    int column = 2;
    for (const auto& [key, value] :
         {std::pair("H", point.H_m), {"mu", point.mu}, {"e", point.e_star}}) {
      if (!protocol::is_close(rows_.real(column), value)) {
        return fmt::format("{} is {:.17g}, but the recipe has {:.17g}", key, rows_.real(column),
                           value);
      }
      ++column;
    }
    const std::pair models{point.model, rows_.integer(1)};
    if (models != equal_models_) {
      if (!is_model(rows_.integer(1), table.model(point.model))) {
        return "its model differs from that of the recipe";
      }
      equal_models_ = models;
    }
    return {};
  }

  bool is_model(std::int64_t model_id, const solver::ModelParameters& model) {
    definition_.reset();
    definition_.bind_all(model_id);
    return definition_.step() &&
           protocol::is_close(definition_.text(0), protocol::canonical_model(model));
  }

  /// Compares the ranges of completed points and the state of a study with its rows. Only a filter
  /// can complete a point without a row. If the column `counted` is 0, another program has deleted
  /// rows, and ranges and state may be outdated.
  void check_completed(const StudyTable& table, const IntervalSet& rows) {
    const bool is_counted = studies_.integer(9) != 0;
    const IntervalSet completed =
        is_counted ? completed_points(database_, studies_.number(0)) : rows;
    if (!is_counted) {
      found_.remarks.push_back(fmt::format(
          "study {}: another program deleted results; the next server counts them again", name_));
    }
    IntervalSet without_row = completed;
    rows.for_each([&](const Interval& range) { without_row.erase(range.begin, range.end); });
    const bool has_filter = table.is_made() && table->has_filter();
    if (rows.size() + without_row.size() != completed.size() ||
        (!without_row.empty() && !has_filter) ||
        (is_counted && without_row.size() != studies_.number(8))) {
      add_fault(fmt::format(
          "completed_ranges has {} points and results has {}, and they differ. UPDATE "
          "studies SET counted = 0 WHERE study_id = {} makes the next server count them",
          completed.size(), rows.size(), studies_.integer(0)));
    }
    const std::string state = studies_.text(4);
    if (completed.size() != table.size()) {
      (state == "done" && is_counted ? study_faults_ : found_.remarks)
          .push_back(fmt::format("study {} is {}: {} of {} points have a result", name_, state,
                                 completed.size(), table.size()));
    }
  }

  sqlite3* database_;
  Diagnosis& found_;
  Statement studies_;
  Statement rows_;
  Statement definition_;
  // the last pair of equal models: number in the recipe, id in the table `models`
  std::pair<std::uint64_t, std::int64_t> equal_models_{0, -1};
  std::string name_;  // name of the current study
  std::vector<std::string> study_faults_;
  std::vector<std::string> row_faults_;
  std::uint64_t all_rows_ = 0;
  std::uint64_t without_checksum_ = 0;
};

}  // namespace

std::vector<std::string> faults_of_pages(sqlite3* database) {
  std::vector<std::string> found;
  try {
    append(found, database, "PRAGMA integrity_check(20)");
    // SQLite omits the list of free pages from the check above if the newest element of the schema
    // is a view, for example of a user. It includes the list in the check of this table.
    append(found, database, "PRAGMA integrity_check(sqlite_schema)");
  } catch (const StorageError& error) {
    return {error.what()};  // the file is too damaged for SQLite's own check
  }
  std::erase(found, "ok");
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

std::string row_fault_sql() {
  std::vector<std::string> lists;
  for (const solver::ResultList* list : solver::result_lists()) {
    lists.push_back(fmt::format("json_valid(coalesce({}, '[]'))", list->column));
  }
  return fmt::format(
      "CASE WHEN checksum <> {} THEN 'its row was changed after it was stored'"
      " WHEN NOT ({}) THEN 'one of its lists cannot be read'"
      " WHEN error IS NULL AND ({} IS NULL) THEN 'it is solved, but outputs are missing'"
      " WHEN error IS NOT NULL AND coalesce({}) IS NOT NULL"
      " THEN 'it failed, but has outputs' END",
      result_checksum_sql(), fmt::join(lists, " AND "),
      fmt::join(required_outputs(), " IS NULL OR "), fmt::join(output_columns(), ", "));
}

Diagnosis diagnose_contents(sqlite3* database) {
  Diagnosis found;
  // A changed table may be defined with endless computations, so its rows are not read.
  const SchemaDifferences schema = compare_schema(database);
  std::ranges::transform(schema.lacking, std::back_inserter(found.faults), fault_of);
  if (!found.faults.empty()) {
    return found;  // the other checks need our tables and indices
  }
  for (const SchemaElement& other : schema.foreign) {
    found.remarks.push_back(fmt::format("the {} {} is of another program", other.type, other.name));
  }
  for (const std::string table : {"results", "completed_ranges", "reused_points"}) {
    append(found.faults, database,
           fmt::format("SELECT DISTINCT 'table {0}: refers to study number ' || study_id ||"
                       " ', which does not exist' FROM {0} WHERE study_id NOT IN"
                       " (SELECT study_id FROM studies UNION SELECT study_id FROM deletions)",
                       table));
  }
  append(found.faults, database,
         "SELECT 'table deletions: names study number ' || study_id || ', which exists'"
         " FROM deletions WHERE study_id IN (SELECT study_id FROM studies)");
  for (const auto& [row, checksum] :
       {std::pair("model", model_checksum_sql()), {"worker", std::string(kWorkerChecksum)}}) {
    append(found.faults, database,
           fmt::format("SELECT '{0} ' || {0}_id || ': it was changed after it was stored'"
                       " FROM {0}s WHERE checksum <> {1}",
                       row, checksum));
  }
  append(
      found.remarks, database,
      "SELECT count(*) || ' studies, models or workers have no checksum, so a flipped bit in them"
      " may not be found' FROM (SELECT checksum FROM studies UNION ALL SELECT checksum FROM models"
      " UNION ALL SELECT checksum FROM workers) WHERE checksum IS NULL HAVING count(*) > 0");
  append(found.remarks, database,
         "SELECT count(*) || ' results of deleted studies are left; the next server deletes them'"
         " FROM results WHERE study_id IN (SELECT study_id FROM deletions) HAVING count(*) > 0");
  StudyCheck(database, found).run();
  return found;
}

Diagnosis diagnose(const std::string& path) {
  const DatabaseHandle opened = open_stored(path);
  sqlite3* database = opened.get();
  std::array<char, 2> versions{};  // of the format, 1 or 2; SQLite writes to no later version
  std::ifstream(path, std::ios::binary).seekg(18).read(versions.data(), versions.size());
  if (std::ranges::any_of(versions, [](char version) { return version != 1 && version != 2; })) {
    return {{"bytes 18 and 19 of the file's header are damaged, so that nothing can be written"},
            {}};
  }
  if (auto faults = faults_of_pages(database); !faults.empty()) {
    return {std::move(faults), {}};  // with damaged pages, other checks mean nothing
  }
  execute(database, "BEGIN");  // one transaction, because a server may write meanwhile
  return diagnose_contents(database);
}

}  // namespace oblique::server
