#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "proto/recipe/point_table.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"
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

/// An SQL expression over the columns of `results` for the checksum of a row (row_checksum.h).
std::string result_checksum_sql();
/// The same for `studies`.
std::string study_checksum_sql();

/// A row of `results`. Objects that it refers to must live until it is inserted.
struct ResultRow {
  std::uint64_t study_id;
  std::uint64_t point;
  std::int64_t model_id;
  protocol::Point inputs;
  const solver::CaseResult* result;  ///< nullptr: it failed
  std::string_view error;            ///< why it failed
  std::uint64_t worker_id;           ///< 0: NULL
  std::uint32_t attempt;
  std::string_view solved_at;  ///< UTC, ISO 8601
};

/// Inserts rows into `results`, with their checksums.
class ResultInsert {
 public:
  /// The connection must outlive this.
  explicit ResultInsert(sqlite3* database);

  /// Inserts the row unless its point has one, and returns whether it did. Any other conflict is an
  /// error. Throws StorageError.
  bool run(const ResultRow& row);

 private:
  void put(std::string_view text);
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void put(Number value);
  void put_null();
  template <class T>
  void put_fields(const solver::CaseResult& result);
  void put_lists(const solver::CaseResult& result);

  sqlite3* database_;
  Statement insert_;
  RowChecksum checksum_;
  int next_ = 0;                      // number of the next parameter
  std::array<std::string, 5> lists_;  // texts of the lists; kept to reuse their memory
};

/// A statement that inserts a model unless one has the same definition, the model's canonical text
/// (proto/recipe/canonical.h). `bind_model` binds its parameters.
std::string insert_model_sql();
void bind_model(Statement& insert, const solver::ModelParameters& model,
                std::string_view definition);

}  // namespace oblique::server
