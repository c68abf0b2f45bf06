#include "proto/wire/chunk.h"

#include <bit>
#include <cstring>
#include <utility>

namespace oblique::protocol {
namespace {

static_assert(std::endian::native == std::endian::little, "cells are copied as they are in memory");

template <class Number>
void append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

template <class Number>
bool take(std::string_view& bytes, Number& number) {
  if (bytes.size() < sizeof number) {
    return false;
  }
  std::memcpy(&number, bytes.data(), sizeof number);
  bytes.remove_prefix(sizeof number);
  return true;
}

/// Removes a cell from the beginning of `bytes`. Returns false if there is no complete cell.
bool take_cell(std::string_view& bytes, Cell& cell) {
  std::uint32_t length = 0;
  if (!take(bytes, cell.kind)) {
    return false;
  }
  switch (cell.kind) {
    case CellKind::kNull:
      return true;
    case CellKind::kInteger:
      return take(bytes, cell.integer);
    case CellKind::kReal:
      return take(bytes, cell.real);
    case CellKind::kText:
      if (!take(bytes, length) || bytes.size() < length) {
        return false;
      }
      cell.text = bytes.substr(0, length);
      bytes.remove_prefix(length);
      return true;
  }
  return false;
}

/// The alternatives of a Value are in the same order as the kinds of cells.
Cell cell_of(const Value& value) {
  Cell cell{.kind = static_cast<CellKind>(value.index())};
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    cell.integer = *integer;
  } else if (const auto* real = std::get_if<double>(&value)) {
    cell.real = *real;
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    cell.text = *text;
  }
  return cell;
}

}  // namespace

Value value_of(const Cell& cell) {
  return cell.kind == CellKind::kInteger ? Value(cell.integer)
         : cell.kind == CellKind::kReal  ? Value(cell.real)
         : cell.kind == CellKind::kText  ? Value(std::string(cell.text))
                                         : Value();
}

bool is_sound(const QueryReply& chunk) {
  const auto columns = static_cast<std::uint64_t>(chunk.columns_size());
  std::string_view rest = chunk.cells();
  if (columns == 0 || chunk.chunk_rows() > rest.size() / columns) {  // a cell has at least one byte
    return chunk.chunk_rows() == 0 && rest.empty();
  }
  Cell cell;
  for (std::uint64_t left = chunk.chunk_rows() * columns; left > 0; --left) {
    if (!take_cell(rest, cell)) {
      return false;
    }
  }
  return rest.empty();
}

ChunkRows::ChunkRows(const QueryReply& chunk)
    : rest_(chunk.cells()),
      cells_(static_cast<std::size_t>(chunk.columns_size())),
      rows_left_(chunk.chunk_rows()) {}

bool ChunkRows::next() {
  if (rows_left_ == 0) {
    return false;
  }
  --rows_left_;
  for (Cell& cell : cells_) {
    static_cast<void>(take_cell(rest_, cell));
  }
  return true;
}

void ChunkWriter::cell(const Cell& value) {
  append(cells_, value.kind);
  if (value.kind == CellKind::kInteger) {
    append(cells_, value.integer);
  } else if (value.kind == CellKind::kReal) {
    append(cells_, value.real);
  } else if (value.kind == CellKind::kText) {
    append(cells_, static_cast<std::uint32_t>(value.text.size()));
    cells_.append(value.text);
  }
}

QueryReply ChunkWriter::take() {
  QueryReply chunk;
  chunk.mutable_columns()->Assign(columns_.begin(), columns_.end());
  chunk.set_cells(std::exchange(cells_, {}));
  chunk.set_chunk_rows(std::exchange(rows_, 0));
  return chunk;
}

QueryReply chunk_of(const Table& table) {
  ChunkWriter writer(table.columns);
  for (const Row& row : table.rows) {
    for (const Value& value : row) {
      writer.cell(cell_of(value));
    }
    writer.end_row();
  }
  QueryReply chunk = writer.take();
  chunk.set_chunk(1);
  chunk.set_ends(true);
  return chunk;
}

void append_rows(const QueryReply& chunk, Table& table) {
  table.columns.assign(chunk.columns().begin(), chunk.columns().end());
  ChunkRows rows(chunk);
  while (rows.next()) {
    Row& row = table.rows.emplace_back();
    for (std::size_t i = 0; i < rows.columns(); ++i) {
      row.push_back(value_of(rows.cell(i)));
    }
  }
}

}  // namespace oblique::protocol
