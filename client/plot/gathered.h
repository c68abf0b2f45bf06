#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/plot/figure.h"
#include "client/service/source.h"

namespace oblique::client::plot {

/// One column of an answer, held for drawing.
struct AnswerColumn {
  std::string name;
  std::string unit;                             ///< SI; empty: none, or not known
  std::vector<double> numbers = {};             ///< of each row; NaN: NULL, or a text
  std::vector<std::string> words = {};          ///< the different texts
  std::vector<std::uint32_t> word_of_row = {};  ///< empty: there is no text in it
  static constexpr std::uint32_t kNoWord = UINT32_MAX;

  bool has_texts() const { return !words.empty(); }
  /// Whether a row has neither a number nor a text.
  bool is_null(std::size_t row) const;
  /// "" where the row has no text.
  const std::string& text(std::size_t row) const;
};

/// More rows are not held: a picture of them wants a narrower question.
inline constexpr std::size_t kMostRows = 20'000'000;

/// All rows of an answer: 8 bytes a value. Throws what the stream throws, and std::runtime_error
/// for more than kMostRows.
std::vector<AnswerColumn> read_columns(RowStream& stream);

/// Rows for a map: where each lies, its value there, and whether it failed.
struct MapRows {
  const AnswerColumn& x;
  const AnswerColumn& y;
  const AnswerColumn& value;
  const AnswerColumn& status;
};

/// The rows in cells.
struct Gathered {
  Cells cells;
  std::vector<std::uint64_t> counts = {};                    ///< points with a value of each cell
  std::map<std::string, std::uint64_t> points_of_name = {};  ///< in all cells, of texts
  std::uint64_t points = 0;                                  ///< rows that are in a cell
  std::uint64_t most_in_a_cell = 0;                          ///< of them, of those with a value
  std::uint64_t mixed_cells = 0;  ///< cells whose points have different texts
};

/// The values of an axis of cells: those of the study, and others that rows have.
std::vector<double> axis_values(std::vector<double> of_study, const AnswerColumn& column);

/// One cell per (x, y); several rows are averaged, of texts the most frequent is taken.
Gathered gathered_on(const MapRows& rows, const std::vector<double>& x_values,
                     const std::vector<double>& y_values, bool is_x_logarithmic,
                     bool is_y_logarithmic);

/// Marks cells without a row in which `x` and `y` have one as left out by the condition. The cells
/// stand for values.
void mark_filtered(Cells& cells, const AnswerColumn& x, const AnswerColumn& y);

/// Cells of equal size, so many along each scale, for scattered points. Cells without a row have no
/// point.
Gathered gathered_in_bins(const MapRows& rows, const Scale& x, std::size_t x_cells, const Scale& y,
                          std::size_t y_cells);

/// Rows as lines.
struct GatheredLines {
  std::vector<Curve> curves = {};     ///< with `by`
  std::uint64_t gaps = 0;             ///< places without a value
  std::uint64_t most_at_a_place = 0;  ///< rows with a value
};

/// One line per value of `by` (nullptr: one line), by rising x; several rows at one x are averaged.
/// Rows without a value are gaps, and so are `x_values` without a row between the ends of a line.
GatheredLines gathered_lines(const AnswerColumn& x, const AnswerColumn& y, const AnswerColumn* by,
                             const std::vector<double>& x_values);

}  // namespace oblique::client::plot
