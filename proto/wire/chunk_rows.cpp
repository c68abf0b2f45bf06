#include "proto/wire/chunk_rows.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace oblique::protocol {
namespace {

constexpr std::size_t kKinds = 4;
/// A value takes a byte at least while a chunk is made, and so no sound one has more.
constexpr std::uint64_t kMostRows = std::uint64_t{1} << 24U;

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

}  // namespace oblique::protocol
