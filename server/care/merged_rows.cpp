#include "server/care/merged_rows.h"

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/care/merge_source.h"
#include "server/care/table_columns.h"
#include "server/store/rows/packed_row.h"
#include "server/store/rows/row_columns.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostRemarks = 10;
constexpr std::uint64_t kRowsBetweenReports = 4096;

/// Columns of `packed_results`, counted once.
struct Columns {
  int study_id = packed_column("study_id");
  int point = packed_column("point");
  int model_id = packed_column("model_id");
  int error = packed_column("error");
  int worker = packed_column("worker");
};

bool is_null(const PackedValue& value) {
  return value.type == PackedValue::Type::kNull;
}

/// What the solver makes of a point, however long that took it.
struct Output {
  int column;  ///< of `packed_results`
  std::string_view shown;
};

std::vector<Output> compared_outputs() {
  std::vector<Output> outputs;
  for (const std::string_view name : packed_outputs()) {
    if (name != "wall") {
      outputs.push_back({packed_column(name), shown_name(name)});
    }
  }
  return outputs;
}

/// Those that are others in both rows.
std::vector<std::string> differing_outputs(const std::vector<Output>& outputs, const PackedRow& a,
                                           const PackedRow& b) {
  std::vector<std::string> differing;
  for (const Output& output : outputs) {
    if (a.at(output.column) != b.at(output.column)) {
      differing.emplace_back(output.shown);
    }
  }
  return differing;
}

class RowMerge {
 public:
  RowMerge(sqlite3* source, sqlite3* target, StudyPlaces& places, Merged& merged)
      : places_(places),
        merged_(merged),
        deleted_(deleted_studies(source)),
        source_(source, target, places),
        insert_(target),
        remove_(target, "DELETE FROM packed_results WHERE study_id = ? AND point = ?"),
        known_(target, fmt::format("SELECT {}, (SELECT w.solver_version FROM workers AS w"
                                   " WHERE w.worker_id = packed_results.worker)"
                                   " FROM packed_results WHERE study_id = ? AND point = ?",
                                   fmt::join(packed_columns(), ", "))) {}

  void run(const Merger::Progress& progress) {
    const std::uint64_t rows = source_.rows();
    std::uint64_t looked_at = 0;
    while (source_.next()) {
      take_row();
      if (++looked_at % kRowsBetweenReports == 0) {
        progress(looked_at, std::max(rows, looked_at));
      }
    }
    progress(looked_at, looked_at);
  }

 private:
  static std::uint64_t whole(const PackedRow& row, int column) {
    return static_cast<std::uint64_t>(row.at(column).whole);
  }

  void take_row() {
    PackedRow& row = source_.row();
    const std::uint64_t point = whole(row, columns_.point);
    const auto found = places_.find(whole(row, columns_.study_id));
    if (found == places_.end() && deleted_.contains(whole(row, columns_.study_id))) {
      return;  // the server there has not come to it yet
    }
    if (!source_.is_sound() || found == places_.end() || point >= found->second.points_in_source) {
      throw StorageError(
          fmt::format("the result of point {} of study number {} is not as it was stored: `oblique "
                      "check` tells "
                      "more, and `oblique backup --salvage` saves what can be merged",
                      point, whole(row, columns_.study_id)));
    }
    StudyPlace& place = found->second;
    row.at(columns_.study_id).whole = static_cast<std::int64_t>(place.id);
    source_.take_texts();
    if (place.is_new || is_wanted(place, point)) {
      check_version(place);
      source_.take_references();
      insert_.run(row, source_.has_checksum());
      ++place.rows_changed;
      ++merged_.results_added;
    }
  }

  /// Whether a study that was there lacks the row; one of a failed point is taken away for it.
  bool is_wanted(const StudyPlace& place, std::uint64_t point) {
    known_.bind(1, place.id);
    known_.bind(2, point);
    if (!known_.step()) {
      known_.reset();
      return true;
    }
    there_.read(known_, 0);
    const bool is_solved = is_null(source_.row().at(columns_.error));
    const bool was_solved = is_null(there_.at(columns_.error));
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
    std::vector<std::string> differing = differing_outputs(outputs_, source_.row(), there_);
    if (known_.text(known_.columns() - 1) != source_.solver_version()) {
      differing.insert(differing.begin(), "solver_version");
    }
    if (!differing.empty() && ++merged_.results_differing <= kMostRemarks) {
      merged_.remarks.push_back(fmt::format("study {}, point {} differs in {}", place.name, point,
                                            fmt::join(differing, ", ")));
    }
  }

  /// Results of a study come from one solver, unless it was said that they need not.
  void check_version(const StudyPlace& place) const {
    const std::string& version = source_.solver_version();
    if (place.mixes_versions || place.solver_version.empty() || version.empty() ||
        version == place.solver_version) {
      return;
    }
    throw MergeRefused(fmt::format(
        "its results of study {} come from solver version {}, those that are there from {}: "
        "--mix-versions unites them all the same",
        place.name, version, place.solver_version));
  }

  const Columns columns_;
  const std::vector<Output> outputs_ = compared_outputs();
  StudyPlaces& places_;
  Merged& merged_;
  const std::set<std::uint64_t> deleted_;
  MergeSource source_;
  RowInsert insert_;
  Statement remove_;
  Statement known_;
  PackedRow there_;
};

}  // namespace

void merge_rows(sqlite3* source, sqlite3* target, StudyPlaces& places, Merged& merged,
                const Merger::Progress& progress) {
  RowMerge(source, target, places, merged).run(progress);
}

}  // namespace oblique::server
