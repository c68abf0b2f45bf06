#include "server/care/merged_rows.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/care/merged_references.h"
#include "server/care/table_columns.h"
#include "server/store/result_row.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostRemarks = 10;
constexpr std::uint64_t kRowsBetweenReports = 4096;

/// "?1, ?2, ..., ?count".
std::string numbered_marks(std::size_t count) {
  std::string text = "?1";
  for (std::size_t i = 2; i <= count; ++i) {
    text += fmt::format(", ?{}", i);
  }
  return text;
}

/// The columns of a row of the present schema, and where they stand in what is read.
struct RowColumns {
  /// `read` has two columns before them.
  static constexpr int kBefore = 2;

  std::vector<std::string> names;

  RowColumns() {
    for (const std::string_view name : result_columns(kSchemaVersion)) {
      names.emplace_back(name);
    }
  }
  /// Of what is bound, from 1.
  int bound(std::string_view name) const {
    return 1 + static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
  }
  int read(std::string_view name) const { return bound(name) - 1 + kBefore; }

  std::string select_sql(sqlite3* source) const {
    const auto there = columns_of(source, "results");
    const auto has = [&](const std::string& name) {
      return std::find(there.begin(), there.end(), name) != there.end();
    };
    std::string columns = has("checksum") ? "checksum IS NOT NULL" : "0";
    for (const std::string& name : names) {
      columns += ", " + (has(name) ? name : "NULL");
    }
    // One list that no JSON is would fail every query of the views that unfold it.
    std::string sound = result_soundness_sql(schema_of(source));
    for (const solver::ResultList* list : solver::result_lists()) {
      const std::string column(list->column);
      if (has(column)) {
        sound += fmt::format(" AND ({0} IS NULL OR json_valid({0}))", column);
      }
    }
    return fmt::format("SELECT {}, {}, rowid FROM results ORDER BY rowid", sound, columns);
  }
  /// The last parameter says whether the row gets a checksum: one of a row that had none would say
  /// that it was never changed.
  std::string insert_sql() const {
    const std::string marks = numbered_marks(names.size());
    return fmt::format(
        "INSERT INTO results ({}, checksum) VALUES ({}, CASE WHEN ?{} THEN row_checksum({}) END)",
        fmt::join(names, ", "), marks, names.size() + 1, marks);
  }
};

/// What the solver makes of a point, however long that took it.
std::vector<std::string> compared_columns(int schema) {
  auto names = output_columns(std::min(schema, kSchemaVersion));
  std::erase(names, "wall_s");
  std::sort(names.begin(), names.end());
  return names;
}

class RowMerge {
 public:
  RowMerge(sqlite3* source, sqlite3* target, StudyPlaces& places, Merged& merged)
      : places_(places),
        merged_(merged),
        compared_(compared_columns(schema_of(source))),
        models_(source, target),
        workers_(source, target),
        read_(source, columns_.select_sql(source)),
        insert_(target, columns_.insert_sql()),
        remove_(target, "DELETE FROM results WHERE study_id = ? AND point = ?"),
        known_(target, known_sql()) {
    Statement last(source, "SELECT max(rowid) FROM results");
    rows_ = last.step() ? static_cast<std::uint64_t>(last.integer(0)) : 0;
  }

  void run(const Merger::Progress& progress) {
    std::uint64_t looked_at = 0;
    while (read_.step()) {
      take_row();
      if (++looked_at % kRowsBetweenReports == 0) {
        progress(number(read_.columns() - 1), rows_);
      }
    }
    progress(rows_, rows_);
  }

 private:
  std::uint64_t number(int column) const {
    return static_cast<std::uint64_t>(read_.integer(column));
  }

  /// A query that is given a row and says of the one that the target has: its status, and of each
  /// compared column whether both have the same.
  std::string known_sql() const {
    std::string sql = "SELECT status, solver_version IS ?3";
    for (std::size_t i = 0; i < compared_.size(); ++i) {
      // Rows may lack what a later schema brought.
      sql += fmt::format(", {0} IS ?{1} OR ?{1} IS NULL OR {0} IS NULL", compared_[i], i + 4);
    }
    return sql + " FROM results WHERE study_id = ?1 AND point = ?2";
  }

  void take_row() {
    const std::uint64_t point = number(columns_.read("point"));
    const auto found = places_.find(number(columns_.read("study_id")));
    if (read_.integer(0) == 0 || found == places_.end() || point >= found->second.points) {
      throw StorageError(fmt::format(
          "the result of point {} in row {} is not as it was stored: `oblique check` tells more, "
          "and `oblique backup --salvage` saves what can be merged",
          point, number(read_.columns() - 1)));
    }
    StudyPlace& place = found->second;
    if (place.is_new || is_wanted(place, point)) {
      insert(place);
    }
  }

  /// Whether a study that was there lacks the row; one of a failed point is taken away for it.
  bool is_wanted(const StudyPlace& place, std::uint64_t point) {
    known_.bind(1, place.id);
    known_.bind(2, point);
    known_.bind_column(3, read_, columns_.read("solver_version"));
    for (std::size_t i = 0; i < compared_.size(); ++i) {
      known_.bind_column(static_cast<int>(i) + 4, read_, columns_.read(compared_[i]));
    }
    if (!known_.step()) {
      known_.reset();
      return true;
    }
    const bool is_solved = read_.text(columns_.read("status")) == "solved";
    const bool was_solved = known_.text(0) == "solved";
    if (is_solved && was_solved) {
      compare(place, point);
    }
    known_.reset();
    if (!is_solved || was_solved) {
      ++merged_.results_known;
      return false;
    }
    ++merged_.failures_replaced;
    remove_.bind(1, place.id);
    remove_.bind(2, point);
    remove_.run();
    return true;
  }

  /// Both solved it.
  void compare(const StudyPlace& place, std::uint64_t point) {
    std::vector<std::string> differing;
    for (int column = 1; column < known_.columns(); ++column) {
      if (known_.integer(column) == 0) {
        differing.push_back(column == 1 ? "solver_version"
                                        : compared_[static_cast<std::size_t>(column) - 2]);
      }
    }
    if (differing.empty()) {
      return;
    }
    if (++merged_.results_differing <= kMostRemarks) {
      merged_.remarks.push_back(fmt::format("study {}, point {} differs in {}", place.name, point,
                                            fmt::join(differing, ", ")));
    }
  }

  void insert(StudyPlace& place) {
    check_version(place);
    for (int i = 0; i < static_cast<int>(columns_.names.size()); ++i) {
      insert_.bind_column(i + 1, read_, i + RowColumns::kBefore);
    }
    insert_.bind(columns_.bound("study_id"), place.id);
    insert_.bind(columns_.bound("model_id"),
                 models_.in_target(read_.integer(columns_.read("model_id"))));
    if (const int worker = columns_.read("worker"); !read_.is_null(worker)) {
      insert_.bind(columns_.bound("worker"), workers_.in_target(read_.integer(worker)));
    }
    insert_.bind_column(static_cast<int>(columns_.names.size()) + 1, read_, 1);
    insert_.run();
    ++place.rows_changed;
    ++merged_.results_added;
  }

  /// Results of a study come from one solver, unless it was said that they need not.
  void check_version(const StudyPlace& place) const {
    const int column = columns_.read("solver_version");
    if (place.mixes_versions || place.solver_version.empty() || read_.is_null(column) ||
        read_.text(column) == place.solver_version) {
      return;
    }
    throw MergeRefused(fmt::format(
        "its results of study {} come from solver version {}, those that are there from {}: "
        "--mix-versions unites them all the same",
        place.name, read_.text(column), place.solver_version));
  }

  StudyPlaces& places_;
  Merged& merged_;
  const RowColumns columns_;
  const std::vector<std::string> compared_;
  MergedModels models_;
  MergedWorkers workers_;
  Statement read_;
  Statement insert_;
  Statement remove_;
  Statement known_;
  std::uint64_t rows_ = 0;
};

}  // namespace

void merge_rows(sqlite3* source, sqlite3* target, StudyPlaces& places, Merged& merged,
                const Merger::Progress& progress) {
  RowMerge(source, target, places, merged).run(progress);
}

}  // namespace oblique::server
