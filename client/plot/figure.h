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

/// The smallest range that has all finite values, or all positive ones. Without any it is {0, 1},
/// respectively {0.1, 1}.
Range range_of(const std::vector<double>& values, bool positive_only = false);
Range united(const Range& one, const Range& other);

/// An axis of a panel, or the scale of its colours.
struct FigureAxis {
  std::string label = {};  ///< with the unit: "duration of contact [\u00b5s]"
  std::string name = {};   ///< column of results
  Range range{0.0, 1.0};
  bool is_logarithmic = false;
  double per_unit = 1.0;  ///< what ticks show for 1 in SI units

  /// Sets the range: that of the values, wider at both ends by a share of it. Equal ends get room
  /// around them, and a range that does not reach 0 does not cross it.
  void span(const Range& values, double wider_by = 0.0);
  /// Where a value is on the axis: 0 at the start of the range, 1 at its end. NaN: nowhere.
  double share_of(double value) const;
  double value_at(double share) const;
};

/// The axis of a column or key. `unit`: SI; empty: none, or unknown. Short times, slides and the
/// like are labelled in the units that tables for people have.
FigureAxis axis_of(const std::string& name, const std::string& unit);

/// "H = 1 m": a value with its name and unit.
std::string shown_value(const FigureAxis& axis, double value);

/// A line through points in their order, or the points alone. NaN is a gap.
struct Curve {
  /// kBorder: a dark line, whatever its stroke is.
  enum class Mark { kLine, kLineAndMarks, kDots, kDiamonds, kBorder };
  std::string name = {};  ///< in the key; empty: none
  std::vector<double> x = {};
  std::vector<double> y = {};
  std::size_t stroke = 0;         ///< number of colour, dashes and mark
  std::optional<double> by = {};  ///< the value that tells it from others
  /// Values of its points on the scale of colours; empty: it has the colour of `stroke`.
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
  kFiltered,  ///< has a result that the condition leaves out
  kFailed,
  kNoValue,  ///< solved, but without that output, or with one that cannot be drawn
  kNoPoint,  ///< the study has no point there
};

/// A category of cells, as a mode.
struct Category {
  std::string name = {};
  std::uint64_t points = 0;
  bool is_other = false;  ///< stands for all categories without an entry of their own
};

/// The cells along an axis.
struct CellAxis {
  std::vector<double> values = {};  ///< that they stand for, rising
  std::vector<double> edges = {};   ///< one more
};

/// Cells row by row from the lowest. With categories the values are their numbers.
struct Cells {
  std::string name = {};  ///< column of the values
  CellAxis x = {};
  CellAxis y = {};
  std::vector<double> values = {};  ///< NaN unless the state is kSolved
  std::vector<CellState> states = {};
  std::vector<std::string> names = {};  ///< texts of the cells; empty: they have numbers
  std::vector<Category> categories = {};

  std::size_t columns() const { return x.values.size(); }
  std::size_t rows() const { return y.values.size(); }
  std::uint64_t count(CellState state) const;
};

/// Bars between edges or, with names, one below the other.
struct Bars {
  std::vector<double> edges = {};
  std::vector<double> heights = {};
  std::vector<std::string> names = {};
};

struct Panel {
  std::string title = {};
  FigureAxis x = {};
  FigureAxis y = {};
  bool has_equal_aspect = false;  ///< a metre is as long upwards as sideways
  bool has_key = true;
  std::string by_name = {};  ///< column that tells curves apart
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
  std::vector<Panel> panels = {};  ///< row by row
  std::size_t columns = 1;
  Size panel_size = {};                    ///< without a size that is asked for
  std::optional<FigureAxis> colours = {};  ///< the scale of colours
  bool is_empty = false;                   ///< no value can be drawn
  std::vector<std::string> notes = {};     ///< sentences below the picture
};

/// Edges halfway between rising values; a single one gets room around it.
std::vector<double> edges_between(const std::vector<double>& values, bool is_logarithmic);

/// The number of the interval between rising edges that has the value, from 0; an edge belongs to
/// the interval above it, the last edge to the last interval. SIZE_MAX: none has it.
std::size_t interval_of(const std::vector<double>& edges, double value);

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
