#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/wire/cell.h"

namespace oblique::protocol {

/// Whether the columns of a chunk have the values that it says. One that came from outside may not,
/// and nothing else may be asked of it then.
bool is_sound(const QueryReply& chunk);

/// Goes through the rows of a sound chunk, which must stay as it is meanwhile.
class ChunkRows {
 public:
  explicit ChunkRows(const QueryReply& chunk);

  /// Goes to the next row, at first to the first; false behind the last.
  bool next();
  std::size_t columns() const { return cells_.size(); }
  /// Value of a column in the present row.
  const Cell& cell(std::size_t column) const { return cells_[column]; }

 private:
  /// Where a column stands.
  struct Place {
    const char* kind;
    std::size_t kind_step;  // 0: one kind for all
    const std::int64_t* integer;
    const double* real;
    const std::uint32_t* text_bytes;
    const char* text;
  };

  std::vector<Place> places_;
  std::vector<Cell> cells_;
  std::uint64_t rows_left_;
};

}  // namespace oblique::protocol
