#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/recipe/point_table.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"
#include "server/store/rows/stored_units.h"
#include "server/store/rows/text_numbers.h"
#include "worker/solver/model/case_result.h"

namespace oblique::server {

/// What stands in a row beside the outputs of the solver.
struct RowContext {
  std::uint64_t study_id;
  std::int64_t model_id;
  double accuracy;  ///< `accuracy_of` the model
  protocol::Point point;
  std::uint64_t number;     ///< of the point
  std::uint64_t worker_id;  ///< 0: NULL
  std::uint32_t attempt;
  std::string_view solved_at;  ///< UTC in ISO 8601; any other text is kept as it is
};

/// A value of a row, of one of SQLite's types.
struct PackedValue {
  enum class Type { kNull, kWhole, kReal, kText };
  Type type = Type::kNull;
  std::int64_t whole = 0;
  double real = 0.0;
  std::string text;  ///< keeps its room from row to row

  bool operator==(const PackedValue& other) const;
};

/// A row of `packed_results` without its checksum. One object takes one row after the other.
class PackedRow {
 public:
  PackedRow();

  /// Makes it the row of a solved point, or of a failed one when `result` is nullptr. Throws
  /// StorageError when a text cannot get a number.
  void pack(const RowContext& context, const solver::CaseResult* result, std::string_view error,
            TextNumbers& texts);
  /// Makes it what another statement's row has from that column on, in the order of
  /// packed_columns().
  void read(const Statement& row, int first);

  /// What its checksum must be.
  std::int64_t checksum(RowChecksum& sum) const;

  PackedValue& at(int column) { return values_[static_cast<std::size_t>(column)]; }
  const PackedValue& at(int column) const { return values_[static_cast<std::size_t>(column)]; }
  std::span<const PackedValue> values() const { return values_; }

 private:
  void pack_outputs(const solver::CaseResult& result, double accuracy, TextNumbers& texts);
  void pack_lists(const solver::CaseResult& result, const StoredDigits& digits);
  PackedValue& next() { return values_[next_++]; }

  std::vector<PackedValue> values_;
  std::size_t next_ = 0;
};

/// Puts rows into `packed_results`, with their checksums.
class RowInsert {
 public:
  explicit RowInsert(sqlite3* database);

  /// Inserts the row unless its point has one; any other conflict is an error. Says whether it did.
  /// Throws StorageError.
  bool run(const PackedRow& row, bool with_checksum = true);
  /// To be called when that threw and other rows are to follow.
  void give_up() { insert_.reset(); }

 private:
  sqlite3* database_;
  Statement insert_;
  RowChecksum checksum_;
};

}  // namespace oblique::server
