#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "worker/solver/model/trace.h"

namespace oblique::solver {

/// Vectors at links or nodes, numbered from 0 at the pin. Each vector has two columns, x and y.
struct TraceVectors {
  std::vector<double> TraceRow::*values;
  bool of_links;  ///< true: at links; false: at nodes
};

/// A column of a trace, or the columns of vectors at all links or nodes. For vectors, `name`
/// contains the names of x and y, separated by a space; `{}` stands for the number of the link or
/// node.
struct TraceColumn {
  std::string_view name;
  std::string_view unit;     ///< SI; empty for texts
  std::string_view meaning;  ///< in one line; says which direction is positive
  std::variant<double TraceRow::*, std::string TraceRow::*, TraceVectors> value;
};

/// All columns, in the order of files and messages.
std::span<const TraceColumn> trace_columns();

struct TraceShape {
  std::size_t links = 0;
  std::size_t nodes = 0;  ///< 0: without positions

  bool operator==(const TraceShape&) const = default;
};

TraceShape trace_shape(std::size_t links, std::size_t elements_per_link, bool with_nodes);

std::vector<std::string> trace_headings(const TraceShape& shape);

/// The states of a contact and of the fall; the index is the code in messages.
inline constexpr std::array<std::string_view, 5> kTraceStates{"SC", "SR", "sC", "sR", kFalling};
inline constexpr std::uint8_t kFallingCode = 4;
/// `state` must be one of kTraceStates.
std::uint8_t code_of_state(std::string_view state);

/// Number of values in a row, without the state.
std::size_t trace_numbers(const TraceShape& shape);
/// Appends the numbers of a row in the order of the columns.
void append_numbers(const TraceRow& row, std::vector<double>& numbers);
/// The row with this state and these trace_numbers() values.
TraceRow trace_row(const TraceShape& shape, std::span<const double> numbers,
                   std::string_view state);

}  // namespace oblique::solver
