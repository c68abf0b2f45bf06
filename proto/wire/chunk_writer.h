#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/wire/cell.h"

namespace oblique::protocol {

/// Gathers rows into chunks. A row is written value by value, from the first column to the last,
/// and then ended.
class ChunkWriter {
 public:
  explicit ChunkWriter(std::vector<std::string> columns);

  void null() { begin(CellKind::kNull); }
  void integer(std::int64_t value);
  void real(double value);
  void text(std::string_view value);
  void cell(const Cell& value);
  /// Throws std::logic_error when the row does not have as many values as there are columns.
  void end_row();

  /// Whole rows since the last `take`.
  std::uint64_t rows() const { return rows_; }
  /// About the bytes of the chunk, the row that is being written included.
  std::uint64_t bytes() const { return bytes_; }

  /// The chunk of the rows written since the last call. Number and end are the caller's to set.
  QueryReply take();

 private:
  ColumnPart& begin(CellKind kind);

  std::vector<std::string> columns_;
  QueryReply chunk_;
  std::vector<std::string> kinds_;  // by column, a byte a row
  std::size_t column_ = 0;          // where the next value goes
  std::uint64_t rows_ = 0;
  std::uint64_t bytes_ = 0;
};

/// The same rows as a chunk, which is the last one, of an answer that came whole.
QueryReply as_chunk(const QueryReply& whole);

/// Appends the rows of a chunk, each as a message, and sets the columns. `chunk` is sound
/// (chunk_rows.h).
void append_rows(const QueryReply& chunk, QueryReply& whole);

/// The same for a single chunk.
QueryReply as_rows(const QueryReply& chunk);

}  // namespace oblique::protocol
