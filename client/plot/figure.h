#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "client/service/source.h"
#include "proto/wire/chunk.h"

namespace oblique::client::plot {

struct Range {
  double from;
  double to;

  bool operator==(const Range&) const = default;
};

/// The smallest range with all finite values, or all positive ones. {0, 1} or {0.1, 1} if there are
/// none.
Range range_of(const std::vector<double>& values, bool positive_only = false);
Range united(const Range& one, const Range& other);

/// An axis of a panel, or a colour scale.
struct FigureAxis {
  std::string label = {};  ///< including the unit: "duration of contact [\u00b5s]"
  std::string name = {};   ///< column of results
  Range range{0.0, 1.0};
  bool is_logarithmic = false;
  double per_unit = 1.0;  ///< shown value of 1 in SI units

  /// Sets the range to that of the values, extended at both ends by a share of it. A single value
  /// gets room around it. A range that does not contain 0 is not extended across 0.
  void span(const Range& values, double wider_by = 0.0);
  /// Position on the axis: 0 at the start of the range, 1 at its end; NaN has none.
  double share_of(double value) const;
  double value_at(double share) const;
};

/// The axis of a column or key with SI unit `unit` (empty: none or unknown). Short times, slides
/// and similar quantities have the units of tables.
FigureAxis axis_of(const std::string& name, const std::string& unit);

/// A value with name and unit: "H = 1 m".
std::string shown_value(const FigureAxis& axis, double value);

/// A line through points in order, or the points alone. NaN is a gap.
struct Curve {
  /// kBorder: a dark line, whatever `stroke` is.
  enum class Mark { kLine, kLineAndMarks, kDots, kDiamonds, kBorder };
  std::string name = {};  ///< in the key; empty: no entry
  std::vector<double> x = {};
  std::vector<double> y = {};
  std::size_t stroke = 0;         ///< number of colour, dash pattern and mark
  std::optional<double> by = {};  ///< value of Panel::by_name on this line
  /// Values of the points on the colour scale; empty: the colour of `stroke`.
  std::vector<double> colours = {};
  Mark mark = Mark::kLine;
};

/// A shaded interval of the horizontal axis.
struct Span {
  enum class Kind { kCompression, kRestitution, kStick };
  double from;
  double to;
  Kind kind;
};

enum class CellState : std::uint8_t {
  kSolved,
  kNoResult,  ///< not solved yet
  kFiltered,  ///< has a result that the condition excludes
  kFailed,
  kNoValue,  ///< solved, but the output is missing or cannot be drawn
  kNoPoint,  ///< the study has no such point
};

/// A category of cells, for example a mode.
struct Category {
  std::string name = {};
  std::uint64_t points = 0;
  bool is_other = false;  ///< stands for all categories without an entry of their own
};

/// The cells along an axis.
struct CellAxis {
  std::vector<double> values = {};  ///< values of the cells, ascending
  std::vector<double> edges = {};   ///< one more than cells
};

/// Cells by rows from the lowest. With categories the values are their numbers.
struct Cells {
  std::string name = {};  ///< column of the values
  CellAxis x = {};
  CellAxis y = {};
  std::vector<double> values = {};  ///< NaN unless the state is kSolved
  std::vector<CellState> states = {};
  std::vector<std::string> names = {};  ///< texts of the categories; empty: the cells have numbers
  std::vector<Category> categories = {};

  std::size_t columns() const { return x.values.size(); }
  std::size_t rows() const { return y.values.size(); }
  std::uint64_t count(CellState state) const;
};

/// Bars between edges, or below each other if they have names.
struct Bars {
  std::vector<double> edges = {};
  std::vector<double> heights = {};
  std::vector<std::string> names = {};
  std::vector<Range> intervals =
      {};  ///< of the heights of named bars, NaN: none; empty: no bar has one
};

/// Counts values in bins of one round width, or on a logarithmic axis of equal ratios.
Bars binned(const std::vector<double>& values, const FigureAxis& axis);

struct Panel {
  std::string title = {};
  FigureAxis x = {};
  FigureAxis y = {};
  bool has_equal_aspect = false;  ///< equal scale of x and y
  bool has_key = true;
  std::string by_name = {};  ///< column whose value distinguishes curves
  std::vector<Span> spans = {};
  std::optional<Cells> cells = {};
  std::optional<Bars> bars = {};
  std::vector<Curve> curves = {};
};

/// In pixels.
struct Size {
  double width = 760.0;
  double height = 520.0;
};

struct Figure {
  std::string title = {};
  std::string subtitle = {};
  std::vector<Panel> panels = {};  ///< by rows
  std::size_t columns = 1;
  Size panel_size = {};                    ///< default size
  std::optional<FigureAxis> colours = {};  ///< colour scale
  bool is_empty = false;                   ///< there is no value to draw
  std::vector<std::string> notes = {};     ///< sentences below the picture
};

/// Edges halfway between ascending values; a single value gets room around it.
std::vector<double> edges_between(const std::vector<double>& values, bool is_logarithmic);

/// Number of the interval between ascending edges that contains the value, from 0. An edge belongs
/// to the interval above it, the last edge to the last interval. SIZE_MAX: none.
std::size_t interval_of(const std::vector<double>& edges, double value);

struct AnswerColumn {
  std::string name;
  std::string unit;                             ///< SI unit; empty: none or unknown
  std::vector<double> numbers = {};             ///< value of each row; NaN: NULL or a text
  std::vector<std::string> words = {};          ///< the different texts
  std::vector<std::uint32_t> word_of_row = {};  ///< empty if the column has no text
  std::unordered_map<std::string, std::uint32_t> number_of_word = {};
  static constexpr std::uint32_t kNoWord = UINT32_MAX;

  void add(const protocol::Cell& cell);
  bool has_texts() const { return !words.empty(); }
  std::uint32_t word(std::size_t row) const {
    return word_of_row.empty() ? kNoWord : word_of_row[row];
  }
  /// Whether a row has no value; a number in a column with texts is none.
  bool is_null(std::size_t row) const;
};
using Answer = std::vector<AnswerColumn>;

/// Maximum number of rows; a picture of more needs a narrower query.
inline constexpr std::size_t kMaxRows = 20'000'000;

/// Reads all rows of an answer: 8 bytes per value. Throws what the stream throws, and
/// std::runtime_error for more than kMaxRows.
Answer read_columns(RowStream& stream);

/// Cells around the values of a study, and equal cells for scattered points.
CellAxis cells_around(const std::vector<double>& values, bool is_logarithmic);
CellAxis cells_between(const FigureAxis& axis, std::size_t cells);

/// Values of an axis of cells: those of the study, which ascend, and others in the rows.
std::vector<double> axis_values(std::vector<double> of_study, const AnswerColumn& column);

struct Gathered {
  Cells cells;
  std::vector<std::uint64_t> counts = {};                    ///< points with a value by cell
  std::map<std::string, std::uint64_t> points_of_name = {};  ///< number of points with each text
  std::uint64_t points = 0;                                  ///< rows that are in a cell
  std::uint64_t most_in_a_cell = 0;                          ///< counts only rows with a value
};

/// Groups rows of x, y, value and status (optional). One cell per (x, y). Several rows are
/// averaged; for text the most frequent value is taken. Cells without a row have no result.
Gathered gathered_in(const Answer& answer, const CellAxis& x, const CellAxis& y);

/// Marks cells without a row that have one in an answer of x and y as excluded by the condition.
void mark_filtered(Cells& cells, const Answer& answer);

struct GatheredLines {
  std::vector<Curve> curves = {};     ///< lines with their value of `by`
  std::uint64_t gaps = 0;             ///< number of gaps
  std::uint64_t most_at_a_place = 0;  ///< counts only rows with a value
};

/// Groups rows of x, y and optionally the value that distinguishes lines. Lines are sorted by x;
/// several rows at one x are averaged. Rows without a value are gaps, and so are `x_values` between
/// the ends of a line that have no row.
GatheredLines gathered_lines(const Answer& answer, const std::vector<double>& x_values);

}  // namespace oblique::client::plot
