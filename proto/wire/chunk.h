#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "proto/oblique.pb.h"

// Rows of an answer in chunks. A chunk is a QueryReply, whose cells follow each other.
namespace oblique::protocol {

/// Codes in QueryReply.cells.
enum class CellKind : char { kNull = 0, kInteger = 1, kReal = 2, kText = 3 };

/// One value of a row. Only the member of its kind is valid.
struct Cell {
  CellKind kind = CellKind::kNull;
  std::int64_t integer = 0;
  double real = 0.0;
  std::string_view text = {};
};

/// A value that owns its text; std::monostate stands for NULL.
using Value = std::variant<std::monostate, std::int64_t, double, std::string>;
using Row = std::vector<Value>;

/// A short answer as a whole.
struct Table {
  std::vector<std::string> columns;
  std::vector<Row> rows = {};
};

Value value_of(const Cell& cell);

/// Whether a chunk contains the cells of as many rows as it states. Check received chunks before
/// any other use.
bool is_sound(const QueryReply& chunk);

/// Iterates over the rows of a sound chunk, which must not change meanwhile.
class ChunkRows {
 public:
  explicit ChunkRows(const QueryReply& chunk);

  /// Moves to the next row, at first to the first one; false after the last.
  bool next();
  std::size_t columns() const { return cells_.size(); }
  /// The value of a column in the current row.
  const Cell& cell(std::size_t column) const { return cells_[column]; }

 private:
  std::string_view rest_;  ///< cells that are not read yet
  std::vector<Cell> cells_;
  std::uint64_t rows_left_;
};

/// Collects rows into chunks, value by value in the order of the columns.
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

  /// Size of the cells since the last `take` [bytes].
  std::uint64_t bytes() const { return cells_.size(); }

  /// Returns the rows since the last call. The caller numbers the chunk and marks the last one.
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
