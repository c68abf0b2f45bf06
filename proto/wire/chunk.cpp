#include "proto/wire/chunk.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace oblique::protocol {
namespace {

constexpr std::size_t kKinds = 4;
/// A value takes at least a byte while a chunk is made, so no sound chunk has more rows.
constexpr std::uint64_t kMostRows = std::uint64_t{1} << 24U;
/// What a value costs in a chunk besides its own bytes: its kind, and the length of a text.
constexpr std::uint64_t kKindBytes = 1;
constexpr std::uint64_t kLengthBytes = 2;

bool is_sound_part(const ColumnPart& part, std::uint64_t rows) {
  const std::string& kinds = part.kinds();
  const bool has_one_for_all = kinds.size() == 1 && rows != 1;
  if (!has_one_for_all && kinds.size() != rows) {
    return false;
  }
  std::array<std::uint64_t, kKinds> count{};
  for (const char kind : kinds) {
    const auto place = static_cast<unsigned char>(kind);
    if (place >= kKinds) {
      return false;
    }
    count.at(place) += has_one_for_all ? rows : 1;
  }
  const auto of = [&count](CellKind kind) { return count.at(static_cast<std::size_t>(kind)); };
  const std::uint64_t bytes =
      std::accumulate(part.text_bytes().begin(), part.text_bytes().end(), std::uint64_t{0});
  return static_cast<std::uint64_t>(part.integers_size()) == of(CellKind::kInteger) &&
         static_cast<std::uint64_t>(part.reals_size()) == of(CellKind::kReal) &&
         static_cast<std::uint64_t>(part.text_bytes_size()) == of(CellKind::kText) &&
         part.texts().size() == bytes;
}

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

bool is_sound(const QueryReply& chunk) {
  return chunk.parts_size() == chunk.columns_size() &&
         (chunk.chunk_rows() == 0 || chunk.parts_size() > 0) && chunk.chunk_rows() <= kMostRows &&
         std::all_of(chunk.parts().begin(), chunk.parts().end(), [&](const ColumnPart& part) {
           return is_sound_part(part, chunk.chunk_rows());
         });
}

ChunkRows::ChunkRows(const QueryReply& chunk)
    : cells_(static_cast<std::size_t>(chunk.columns_size())), rows_left_(chunk.chunk_rows()) {
  places_.reserve(cells_.size());
  for (const ColumnPart& part : chunk.parts()) {
    places_.push_back({part.kinds().data(), part.kinds().size() == 1 ? 0U : 1U,
                       part.integers().data(), part.reals().data(), part.text_bytes().data(),
                       part.texts().data()});
  }
}

bool ChunkRows::next() {
  if (rows_left_ == 0) {
    return false;
  }
  --rows_left_;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    Place& place = places_[i];
    Cell& cell = cells_[i];
    cell.kind = static_cast<CellKind>(*place.kind);
    place.kind += place.kind_step;
    switch (cell.kind) {
      case CellKind::kNull:
        break;
      case CellKind::kInteger:
        cell.integer = *place.integer++;
        break;
      case CellKind::kReal:
        cell.real = *place.real++;
        break;
      case CellKind::kText:
        cell.text = std::string_view(place.text, *place.text_bytes);
        place.text += *place.text_bytes++;
        break;
    }
  }
  return true;
}

ChunkWriter::ChunkWriter(std::vector<std::string> columns) : columns_(std::move(columns)) {
  (void)take();
}

ColumnPart& ChunkWriter::begin(CellKind kind) {
  if (column_ >= columns_.size()) {
    throw std::logic_error("a row has more values than there are columns");
  }
  ColumnPart& part = *chunk_.mutable_parts(static_cast<int>(column_++));
  part.mutable_kinds()->push_back(static_cast<char>(kind));
  bytes_ += kKindBytes;
  return part;
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
  for (ColumnPart& part : *chunk_.mutable_parts()) {
    std::string& kinds = *part.mutable_kinds();
    if (!kinds.empty() && kinds.find_first_not_of(kinds.front()) == std::string::npos) {
      kinds.resize(1);
    }
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
