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

/// Whether a picture can show the value. Sizes beyond 1e301 would overflow in gnuplot; a
/// logarithmic axis shows no value below 1e-300.
bool is_drawable(double value, bool is_logarithmic = false);

/// The smallest range that contains all drawable values. Returns {0, 1} or {0.1, 1} if there are
/// none.
Range range_of(const std::vector<double>& values, bool is_logarithmic = false);
Range united(const Range& one, const Range& other);

/// Whether all values in the range count as one value, because they differ by at most 1e-12 of
/// their size. Machines may round the same value differently by as much.
bool counts_as_one(const Range& range);

/// An axis of a panel, or a colour scale.
struct FigureAxis {
  std::string label = {};  ///< including the unit: "duration of contact [\u00b5s]"
  std::string name = {};   ///< column of results
  Range range{0.0, 1.0};
  bool is_logarithmic = false;
  double per_unit = 1.0;  ///< factor from SI units to shown units

  /// Sets the range to `values`, extended at both ends by the share `wider_by`. Values that count
  /// as one get a margin. A range that does not contain 0 is not extended across 0.
  void span(const Range& values, double wider_by = 0.0);
  /// Position on the axis, from 0 at its start to 1 at its end; NaN if the value has no position.
  double share_of(double value) const;
  double value_at(double share) const;
};

/// The axis of a column or key with SI unit `unit` (empty: none or unknown). Short times, slides
/// and similar quantities are shown in the same units as in tables.
FigureAxis axis_of(const std::string& name, const std::string& unit);

/// Formats a value with name and unit: "H = 1 m".
std::string shown_value(const FigureAxis& axis, double value, int digits = 6);

/// A line that connects points in order, or only the points. NaN leaves a gap.
struct Curve {
  /// kBorder is always a dark line, whatever `stroke` is.
  enum class Mark { kLine, kLineAndMarks, kDots, kDiamonds, kBorder };
  std::string name = {};  ///< entry in the legend; no entry if empty
  std::vector<double> x = {};
  std::vector<double> y = {};
  std::size_t stroke = 0;         ///< index of the colour, dash pattern and mark
  std::optional<double> by = {};  ///< value of the column Panel::by_name on this line
  /// Values that colour the points by the colour scale; if empty, `stroke` gives the colour.
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
  kFiltered,  ///< has a result, but the condition excludes it
  kFailed,
  kNoValue,  ///< solved, but the output is missing or cannot be drawn
  kNoPoint,  ///< the study has no such point
};

/// A category of cells, for example a contact mode.
struct Category {
  std::string name = {};
  std::uint64_t points = 0;
  bool is_other = false;  ///< stands for all categories that have no entry of their own
};

/// Positions of the cells along an axis.
struct CellAxis {
  std::vector<double> values = {};  ///< values of the cells, ascending
  std::vector<double> edges = {};   ///< edges of the cells: one more than values
};

/// Cells of a map, row by row from the lowest. With categories, values are category numbers.
struct Cells {
  std::string name = {};  ///< column that gives the values
  CellAxis x = {};
  CellAxis y = {};
  std::vector<double> values = {};  ///< NaN unless the state is kSolved
  std::vector<CellState> states = {};
  std::vector<std::string> names = {};  ///< names of the categories; empty: the values are numbers
  std::vector<Category> categories = {};

  std::size_t columns() const { return x.values.size(); }
  std::size_t rows() const { return y.values.size(); }
  std::uint64_t count(CellState state) const;
};

/// Vertical bars between edges, or horizontal bars if they have names.
struct Bars {
  std::vector<double> edges = {};
  std::vector<double> heights = {};
  std::vector<std::string> names = {};
  std::vector<Range> intervals = {};  ///< error bars of named bars, if any; NaN leaves one out
};

/// Counts values in bins. All bins have the same round width or, on a logarithmic axis, the same
/// ratio of their edges.
Bars binned(const std::vector<double>& values, const FigureAxis& axis);

struct Panel {
  std::string title = {};
  FigureAxis x = {};
  FigureAxis y = {};
  bool has_equal_aspect = false;  ///< x and y have the same scale
  bool has_key = true;
  std::string by_name = {};  ///< column whose value distinguishes the curves
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
  bool is_empty = false;                   ///< true if no value can be drawn
  std::vector<std::string> notes = {};     ///< sentences below the picture
};

/// Returns 1, 2 or 5 times a power of ten that divides the range in at most about `parts` parts.
double round_step(const Range& range, double parts);

/// Edges halfway between ascending values; a single value gets a margin.
std::vector<double> edges_between(const std::vector<double>& values, bool is_logarithmic);

/// Index of the interval between ascending edges that contains the value; SIZE_MAX if there is
/// none. An edge belongs to the interval above it, the last edge to the last interval.
std::size_t interval_of(const std::vector<double>& edges, double value);

struct AnswerColumn {
  std::string name;
  std::string unit;                     ///< SI unit; empty: none or unknown
  std::vector<double> numbers = {};     ///< value of each row; NaN for NULL and texts
  std::vector<std::string> words = {};  ///< the different texts
  /// Index in `words` of each row's text; empty if the column has no text.
  std::vector<std::uint32_t> word_of_row = {};
  std::unordered_map<std::string, std::uint32_t> number_of_word = {};
  static constexpr std::uint32_t kNoWord = UINT32_MAX;

  void add(const protocol::Cell& cell);
  bool has_texts() const { return !words.empty(); }
  std::uint32_t word(std::size_t row) const {
    return word_of_row.empty() ? kNoWord : word_of_row[row];
  }
  /// Whether a row has no value. In a column with texts, numbers count as no value.
  bool is_null(std::size_t row) const;
};
using Answer = std::vector<AnswerColumn>;

/// Maximum number of rows. For a picture of more rows the query must be narrowed.
inline constexpr std::size_t kMaxRows = 20'000'000;

/// Reads all rows of an answer into memory, 8 bytes per value. Throws the errors of the stream, and
/// std::runtime_error for more than kMaxRows rows.
Answer read_columns(RowStream& stream);

/// `cells_around` places one cell at each value of a study; `cells_between` divides an axis into
/// equal cells, for points that are not on a grid.
CellAxis cells_around(const std::vector<double>& values, bool is_logarithmic);
CellAxis cells_between(const FigureAxis& axis, std::size_t cells);

/// Ascending values along an axis: those `of_study`, which are ascending, and others in the rows.
std::vector<double> axis_values(std::vector<double> of_study, const AnswerColumn& column);

struct Gathered {
  Cells cells;
  std::vector<std::uint64_t> counts = {};                    ///< points with a value, by cell
  std::map<std::string, std::uint64_t> points_of_name = {};  ///< number of points with each text
  std::uint64_t points = 0;                                  ///< number of rows that lie in a cell
  std::uint64_t most_in_a_cell = 0;  ///< maximum number of rows with a value in a cell
};

/// Groups rows of x, y, value and status (optional) into one cell per (x, y). Several rows are
/// averaged; for text the most frequent value is taken. Cells without a row have no result.
Gathered gathered_in(const Answer& answer, const CellAxis& x, const CellAxis& y);

/// Marks a cell without a result as excluded by the condition if `answer` has a row with the x and
/// y of the cell.
void mark_filtered(Cells& cells, const Answer& answer);

struct GatheredLines {
  std::vector<Curve> curves = {};     ///< one line per value of the column that distinguishes lines
  std::uint64_t gaps = 0;             ///< number of gaps
  std::uint64_t most_at_a_place = 0;  ///< maximum number of rows with a value at one x of a line
};

/// Groups rows of x, y and, optionally, the value that distinguishes lines. Lines are sorted by x;
/// several rows at one x are averaged. Values of a column that count as one are one value. A line
/// has a gap at each row without a value. It also has a gap at each of `x_values` between its ends
/// for which it has no row.
GatheredLines gathered_lines(const Answer& answer, const std::vector<double>& x_values);

}  // namespace oblique::client::plot
