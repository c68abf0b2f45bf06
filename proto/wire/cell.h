#pragma once

#include <cstdint>
#include <string_view>

namespace oblique::protocol {

/// What a value is; as in ColumnPart.kinds.
enum class CellKind : char { kNull = 0, kInteger = 1, kReal = 2, kText = 3 };

/// One value of a row. Of the last three the one that its kind names counts.
struct Cell {
  CellKind kind = CellKind::kNull;
  std::int64_t integer = 0;
  double real = 0.0;
  std::string_view text = {};
};

}  // namespace oblique::protocol
