#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/recipe/point_table.h"
#include "server/database/sqlite.h"
#include "server/store/changes.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"

// Rows of the tables `results` and `models`.
namespace oblique::server {

/// Returns the columns of `results`, except `status`, which SQLite computes, and `checksum`.
std::span<const std::string_view> result_columns();
/// Returns the columns with outputs of the solver. They are NULL in the row of a failed point.
std::span<const std::string_view> output_columns();
/// Returns the outputs that the row of every solved point must have.
std::span<const std::string_view> required_outputs();
/// Returns the columns of `models`, except model_id and checksum.
std::span<const std::string_view> model_columns();

/// Return SQL expressions that compute the checksum of a row from the other columns of its table.
std::string result_checksum_sql();
std::string model_checksum_sql();
inline constexpr const char* kStudyChecksum =
    "row_checksum(study_id, recipe, points, errors, created_at)";
inline constexpr const char* kWorkerChecksum =
    "row_checksum(name, threads, solver_version, instruction_set, joined_at)";

/// Inserts rows with checksums into `results`.
class ResultInsert {
 public:
  /// The connection must outlive this object.
  explicit ResultInsert(sqlite3* database);

  /// Inserts the row of a result in `change`, whose point has these `inputs`, unless the point has
  /// a row. Throws StorageError, also for a row that violates a constraint of the table.
  void run(const AddResults& change, const protocol::PointResult& result,
           const protocol::Point& inputs, std::int64_t model_id);

 private:
  void put(std::string_view text) { insert_.bind_lasting(next_++, text); }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void put(Number value) { insert_.bind(next_++, value); }
  void put_outputs(const solver::CaseResult& result);
  void put_lists(const solver::CaseResult& result);

  Statement insert_;
  solver::CaseResult outputs_;        // a member, so that its memory is reused
  int next_ = 0;                      // index of the next parameter to bind
  std::array<std::string, 5> lists_;  // JSON texts; a member, to reuse their memory
};

/// Finds and inserts rows of `models`. The key is the model's canonical text
/// (proto/recipe/model_message.h).
class ModelRows {
 public:
  /// The connection must outlive this object.
  explicit ModelRows(sqlite3* database);

  /// Returns the number of the model's row; 0 if there is no row. Throws StorageGone for a row that
  /// does not match its checksum, because new results must not refer to it.
  std::int64_t find(const solver::ModelParameters& model);
  /// Returns the number of the model's row. Inserts a missing row. Throws the errors of `find`.
  std::int64_t find_or_insert(const solver::ModelParameters& model);

 private:
  std::int64_t find(std::string_view definition);

  Statement find_;
  Statement insert_;
};

}  // namespace oblique::server
