#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "client/plot/figure.h"
#include "client/service/source.h"
#include "proto/wire/chunk.h"

namespace oblique::client::plot {

/// One column of an answer, held for drawing.
struct AnswerColumn {
  std::string name;
  std::string unit;                             ///< SI; empty: none, or not known
  std::vector<double> numbers = {};             ///< of each row; NaN: NULL, or a text
  std::vector<std::string> words = {};          ///< the different texts
  std::vector<std::uint32_t> word_of_row = {};  ///< empty: there is no text in it
  std::unordered_map<std::string, std::uint32_t> number_of_word = {};
  static constexpr std::uint32_t kNoWord = UINT32_MAX;

  void add(const protocol::Cell& cell);
  bool has_texts() const { return !words.empty(); }
  std::uint32_t word(std::size_t row) const {
    return word_of_row.empty() ? kNoWord : word_of_row[row];
  }
  /// Whether a row has no value; in a column with texts numbers are none.
  bool is_null(std::size_t row) const;
};
using Answer = std::vector<AnswerColumn>;

/// More rows are not held: a picture of them wants a narrower query.
inline constexpr std::size_t kMostRows = 20'000'000;

/// All rows of an answer: 8 bytes a value. Throws what the stream throws, and std::runtime_error
/// for more than kMostRows.
Answer read_columns(RowStream& stream);

/// Cells around the values of a study, or of equal size for scattered points.
CellAxis cells_around(const std::vector<double>& values, bool is_logarithmic);
CellAxis cells_between(const FigureAxis& axis, std::size_t cells);

/// The values of an axis of cells: those of the study, which rise, and others that rows have.
std::vector<double> axis_values(std::vector<double> of_study, const AnswerColumn& column);

/// The rows in cells.
struct Gathered {
  Cells cells;
  std::vector<std::uint64_t> counts = {};                    ///< points with a value of each cell
  std::map<std::string, std::uint64_t> points_of_name = {};  ///< in all cells, of texts
  std::uint64_t points = 0;                                  ///< rows that are in a cell
  std::uint64_t most_in_a_cell = 0;                          ///< of them, of those with a value
};

/// Gathers rows of x, y, value and status, which may be missing. One cell per (x, y); several rows
/// are averaged, of texts the most frequent is taken. Cells without a row have no result.
Gathered gathered_in(const Answer& answer, const CellAxis& x, const CellAxis& y);

/// Marks cells without a row that have one in an answer of x and y as left out by the condition.
void mark_filtered(Cells& cells, const Answer& answer);

/// Rows as lines.
struct GatheredLines {
  std::vector<Curve> curves = {};     ///< with `by`
  std::uint64_t gaps = 0;             ///< places without a value
  std::uint64_t most_at_a_place = 0;  ///< rows with a value
};

/// Gathers rows of x, y and perhaps the value that tells lines apart. Lines are by rising x;
/// several rows at one x are averaged. Rows without a value are gaps, and so are `x_values` without
/// a row between the ends of a line.
GatheredLines gathered_lines(const Answer& answer, const std::vector<double>& x_values);

}  // namespace oblique::client::plot
