#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/plot/data/answer_columns.h"
#include "client/plot/figures/charts.h"
#include "client/plot/figures/figure.h"

namespace oblique::client::plot {

/// Rows of a question for a map: where each lies, what it has there, and whether it failed.
struct MapRows {
  const AnswerColumn& x;
  const AnswerColumn& y;
  const AnswerColumn& value;
  const AnswerColumn& status;
};

/// The rows in cells.
struct GatheredCells {
  Cells cells;
  std::vector<std::string> names = {};  ///< of the cells, where the values are texts
  bool has_names = false;
  std::map<std::string, std::uint64_t> points_of_name = {};  ///< in all cells
  std::uint64_t points = 0;                                  ///< rows that are in a cell
  std::uint64_t most_in_a_cell = 0;                          ///< of them, of those with a value
  std::uint64_t mixed_cells = 0;  ///< cells whose points have different texts
};

/// The values of an axis of cells: those of the study, and others that rows have.
std::vector<double> axis_values(std::vector<double> of_study, const AnswerColumn& column);

/// A cell a pair of values; several rows in a cell give their mean, of texts that which most have.
GatheredCells gathered_on(const MapRows& rows, const std::vector<double>& x_values,
                          const std::vector<double>& y_values, bool is_x_logarithmic,
                          bool is_y_logarithmic);

/// Cells without a row in which `x` and `y` have one: the condition leaves that out. The cells
/// stand for values.
void mark_filtered(Cells& cells, const AnswerColumn& x, const AnswerColumn& y);

/// Cells of equal size over all rows, so many along each axis, for what lies scattered.
GatheredCells gathered_in_bins(const MapRows& rows, std::size_t x_cells, std::size_t y_cells,
                               bool is_x_logarithmic, bool is_y_logarithmic);

/// Rows as lines.
struct GatheredLines {
  std::vector<Series> series = {};
  std::uint64_t gaps = 0;             ///< places without a value
  std::uint64_t most_at_a_place = 0;  ///< rows with a value
};

/// One line a value of `by` (nullptr: one line), each by rising x; several rows at one x give their
/// mean. Rows without a value are gaps, and so are the `x_values` between the ends of a line that
/// have no row.
GatheredLines gathered_lines(const AnswerColumn& x, const AnswerColumn& y, const AnswerColumn* by,
                             const std::vector<double>& x_values);

}  // namespace oblique::client::plot
