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

/// The columns of `results`, except `status`, which SQLite computes, and the checksum.
std::span<const std::string_view> result_columns();
/// The columns that come from the solver. They are NULL in a failed row.
std::span<const std::string_view> output_columns();
/// The outputs that every solved row has.
std::span<const std::string_view> required_outputs();
/// The columns of `models`, except the number and the checksum.
std::span<const std::string_view> model_columns();

/// SQL expressions for the checksum of a row, over the columns of the table.
std::string result_checksum_sql();
std::string model_checksum_sql();
inline constexpr const char* kStudyChecksum =
    "row_checksum(study_id, recipe, points, errors, created_at)";

/// Inserts rows into `results`, with their checksums.
class ResultInsert {
 public:
  /// The connection must outlive this.
  explicit ResultInsert(sqlite3* database);

  /// Inserts the row of a result of `change` unless its point has one. `inputs` are those with
  /// which it was solved. Throws StorageError, also for a row that breaks a rule of the table.
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
  solver::CaseResult outputs_;        // kept to reuse its memory
  int next_ = 0;                      // number of the next parameter
  std::array<std::string, 5> lists_;  // texts of the lists; kept to reuse their memory
};

/// The rows of `models`, found by the model's canonical text (proto/recipe/model_message.h).
class ModelRows {
 public:
  /// The connection must outlive this.
  explicit ModelRows(sqlite3* database);

  /// The number of the model's row; 0: there is none. Throws StorageError.
  std::int64_t find(const solver::ModelParameters& model);
  /// The same; inserts the row if there is none.
  std::int64_t find_or_insert(const solver::ModelParameters& model);

 private:
  std::int64_t find(std::string_view definition);

  Statement find_;
  Statement insert_;
};

}  // namespace oblique::server
