#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "proto/oblique.pb.h"

// Rows of an answer in chunks. A chunk is a QueryReply; its cells follow each other, row by row.
namespace oblique::protocol {

/// Codes of the kinds of cells in QueryReply.cells.
enum class CellKind : char { kNull = 0, kInteger = 1, kReal = 2, kText = 3 };

/// A value of a row. Besides `kind`, only the member for this kind is valid.
struct Cell {
  CellKind kind = CellKind::kNull;
  std::int64_t integer = 0;
  double real = 0.0;
  std::string_view text = {};
};

/// A value that owns its text; std::monostate stands for NULL.
using Value = std::variant<std::monostate, std::int64_t, double, std::string>;
using Row = std::vector<Value>;

/// A short answer that is kept as a whole.
struct Table {
  std::vector<std::string> columns;
  std::vector<Row> rows = {};
};

Value value_of(const Cell& cell);

/// Returns whether the cells of a chunk are complete and make the stated number of rows. Received
/// chunks must be checked before any other use.
bool is_sound(const QueryReply& chunk);

/// Iterates over the rows of a sound chunk. The chunk must not change meanwhile.
class ChunkRows {
 public:
  explicit ChunkRows(const QueryReply& chunk);

  /// Moves to the next row, at the first call to the first row. Returns false after the last row.
  bool next();
  std::size_t columns() const { return cells_.size(); }
  /// Returns the value of a column in the current row.
  const Cell& cell(std::size_t column) const { return cells_[column]; }

 private:
  std::string_view rest_;  ///< cells that are not read yet
  std::vector<Cell> cells_;
  std::uint64_t rows_left_;
};

/// Collects rows into chunks. Values must be added in the order of the columns.
class ChunkWriter {
 public:
  explicit ChunkWriter(std::vector<std::string> columns) : columns_(std::move(columns)) {}

  void null() { cell({}); }
  void integer(std::int64_t value) { cell({.kind = CellKind::kInteger, .integer = value}); }
  void real(double value) { cell({.kind = CellKind::kReal, .real = value}); }
  void text(std::string_view value) { cell({.kind = CellKind::kText, .text = value}); }
  void cell(const Cell& value);
  /// Ends a row, which must have a value for every column.
  void end_row() { ++rows_; }

  /// Returns the size of the cells that were added since the last `take` [bytes].
  std::uint64_t bytes() const { return cells_.size(); }

  /// Returns the rows added since the last call. The caller must number the chunk and mark the last
  /// one.
  QueryReply take();

 private:
  std::vector<std::string> columns_;
  std::string cells_;
  std::uint64_t rows_ = 0;
};

/// Encodes the table as an answer of one chunk.
QueryReply chunk_of(const Table& table);

/// Appends the rows of a sound chunk and sets the columns.
void append_rows(const QueryReply& chunk, Table& table);

}  // namespace oblique::protocol
