#include "proto/wire/chunk.h"

#include <bit>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace oblique::protocol {
namespace {

static_assert(std::endian::native == std::endian::little, "cells are copied as they are in memory");

template <class Number>
void append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

/// Moves a number from the beginning of `bytes`; false when these are too few.
template <class Number>
bool take(std::string_view& bytes, Number& number) {
  if (bytes.size() < sizeof number) {
    return false;
  }
  std::memcpy(&number, bytes.data(), sizeof number);
  bytes.remove_prefix(sizeof number);
  return true;
}

/// Moves a cell from the beginning of `bytes`; false when there is no whole one.
bool take_cell(std::string_view& bytes, Cell& cell) {
  if (!take(bytes, cell.kind)) {
    return false;
  }
  std::uint32_t length = 0;
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

Cell cell_of(const Value& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    return {.kind = CellKind::kInteger, .integer = *integer};
  }
  if (const auto* real = std::get_if<double>(&value)) {
    return {.kind = CellKind::kReal, .real = *real};
  }
  const auto* text = std::get_if<std::string>(&value);
  return text == nullptr ? Cell{} : Cell{.kind = CellKind::kText, .text = *text};
}

}  // namespace

Value value_of(const Cell& cell) {
  switch (cell.kind) {
    case CellKind::kInteger:
      return cell.integer;
    case CellKind::kReal:
      return cell.real;
    case CellKind::kText:
      return std::string(cell.text);
    case CellKind::kNull:
      break;
  }
  return {};
}

bool is_sound(const QueryReply& chunk) {
  const auto columns = static_cast<std::uint64_t>(chunk.columns_size());
  std::string_view rest = chunk.cells();
  if (columns == 0 || chunk.chunk_rows() > rest.size() / columns) {  // a cell has a byte at least
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

ChunkWriter::ChunkWriter(std::vector<std::string> columns) : columns_(std::move(columns)) {}

void ChunkWriter::cell(const Cell& value) {
  if (column_++ >= columns_.size()) {
    throw std::logic_error("a row has more values than there are columns");
  }
  cells_.push_back(static_cast<char>(value.kind));
  switch (value.kind) {
    case CellKind::kNull:
      break;
    case CellKind::kInteger:
      append(cells_, value.integer);
      break;
    case CellKind::kReal:
      append(cells_, value.real);
      break;
    case CellKind::kText:
      append(cells_, static_cast<std::uint32_t>(value.text.size()));
      cells_.append(value.text);
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
  QueryReply chunk;
  chunk.mutable_columns()->Assign(columns_.begin(), columns_.end());
  chunk.set_cells(std::exchange(cells_, {}));
  chunk.set_chunk_rows(std::exchange(rows_, 0));
  column_ = 0;
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
