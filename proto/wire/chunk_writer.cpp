#include "proto/wire/chunk_writer.h"

#include <stdexcept>
#include <utility>

#include "proto/wire/chunk_rows.h"

namespace oblique::protocol {
namespace {

/// What a value costs in a chunk beside its own bytes: its kind, and the length of a text.
constexpr std::uint64_t kKindBytes = 1;
constexpr std::uint64_t kLengthBytes = 2;

}  // namespace

ChunkWriter::ChunkWriter(std::vector<std::string> columns)
    : columns_(std::move(columns)), kinds_(columns_.size()) {
  (void)take();
}

ColumnPart& ChunkWriter::begin(CellKind kind) {
  if (column_ >= columns_.size()) {
    throw std::logic_error("a row has more values than there are columns");
  }
  kinds_[column_] += static_cast<char>(kind);
  bytes_ += kKindBytes;
  return *chunk_.mutable_parts(static_cast<int>(column_++));
}

void ChunkWriter::integer(std::int64_t value) {
  begin(CellKind::kInteger).add_integers(value);
  bytes_ += sizeof value;
}

void ChunkWriter::real(double value) {
  begin(CellKind::kReal).add_reals(value);
  bytes_ += sizeof value;
}

void ChunkWriter::text(std::string_view value) {
  ColumnPart& part = begin(CellKind::kText);
  part.add_text_bytes(static_cast<std::uint32_t>(value.size()));
  part.mutable_texts()->append(value);
  bytes_ += value.size() + kLengthBytes;
}

void ChunkWriter::cell(const Cell& value) {
  switch (value.kind) {
    case CellKind::kNull:
      null();
      break;
    case CellKind::kInteger:
      integer(value.integer);
      break;
    case CellKind::kReal:
      real(value.real);
      break;
    case CellKind::kText:
      text(value.text);
      break;
  }
}

void ChunkWriter::end_row() {
  if (column_ != columns_.size()) {
    throw std::logic_error("a row has fewer values than there are columns");
  }
  column_ = 0;
  ++rows_;
}

QueryReply ChunkWriter::take() {
  for (std::size_t i = 0; i < kinds_.size() && chunk_.parts_size() > 0; ++i) {
    std::string& kinds = kinds_[i];
    if (kinds.find_first_not_of(kinds.substr(0, 1)) == std::string::npos && !kinds.empty()) {
      kinds.resize(1);
    }
    *chunk_.mutable_parts(static_cast<int>(i))->mutable_kinds() = std::exchange(kinds, {});
  }
  chunk_.set_chunk_rows(rows_);
  QueryReply taken = std::exchange(chunk_, {});
  for (const std::string& column : columns_) {
    chunk_.add_columns(column);
    chunk_.add_parts();
  }
  column_ = 0;
  rows_ = 0;
  bytes_ = 0;
  return taken;
}

QueryReply as_chunk(const QueryReply& whole) {
  ChunkWriter writer({whole.columns().begin(), whole.columns().end()});
  for (const Row& row : whole.rows()) {
    for (const Value& value : row.values()) {
      switch (value.kind_case()) {
        case Value::kInteger:
          writer.integer(value.integer());
          break;
        case Value::kReal:
          writer.real(value.real());
          break;
        case Value::kText:
          writer.text(value.text());
          break;
        case Value::KIND_NOT_SET:
          writer.null();
          break;
      }
    }
    writer.end_row();
  }
  QueryReply chunk = writer.take();
  chunk.set_chunk(1);
  chunk.set_ends(true);
  return chunk;
}

void append_rows(const QueryReply& chunk, QueryReply& whole) {
  *whole.mutable_columns() = chunk.columns();
  ChunkRows rows(chunk);
  while (rows.next()) {
    Row& row = *whole.add_rows();
    for (std::size_t i = 0; i < rows.columns(); ++i) {
      const Cell& cell = rows.cell(i);
      Value& value = *row.add_values();
      switch (cell.kind) {
        case CellKind::kNull:
          break;
        case CellKind::kInteger:
          value.set_integer(cell.integer);
          break;
        case CellKind::kReal:
          value.set_real(cell.real);
          break;
        case CellKind::kText:
          value.set_text(std::string(cell.text));
          break;
      }
    }
  }
}

QueryReply as_rows(const QueryReply& chunk) {
  QueryReply whole;
  append_rows(chunk, whole);
  return whole;
}

}  // namespace oblique::protocol
