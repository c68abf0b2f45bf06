#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/plot/draw/outline.h"
#include "client/plot/draw/palette.h"
#include "client/plot/draw/scale.h"

// What a picture shows, without how it is drawn. SVG, the terminal, tables and gnuplot draw the
// same Figure. Numbers are in SI units.
namespace oblique::client::plot {

/// One axis of a panel.
struct FigureAxis {
  std::string label{};  ///< for people, with its unit: "contact duration [us]"
  std::string name;     ///< of the column, for tables
  Range range{0.0, 1.0};
  bool is_logarithmic = false;
  double per_unit = 1.0;  ///< so much is written at a tick for 1 in SI units
  bool is_whole = false;  ///< of numbers of points: marked at whole ones only
};

/// A line through points in their order, marks at them, or both. NaN is a gap.
struct Curve {
  std::string name{};  ///< for the legend; empty: it has no entry
  std::vector<double> x = {};
  std::vector<double> y = {};
  std::size_t stroke = 0;            ///< colour, dashes and shape of marks; see plot::stroke
  std::optional<double> shade = {};  ///< instead: a value of the figure's colours
  std::optional<double> by = {};     ///< the value that tells it from others, for tables
  bool has_line = true;
  bool has_marks = false;
};

/// A span of the horizontal axis that is shaded from below to above, as of stick.
struct Span {
  double from;
  double to;
  std::size_t kind;  ///< of shading, below kSpanKinds
  std::string name;  ///< for the legend, once for all spans of a kind
};

/// A number that others have published, or that is set off for another reason.
struct KnownPoint {
  double x;
  double y;
  std::string name;  ///< for the legend, once for all of a name
};

/// What is known of a cell of a map.
enum class CellState : std::uint8_t {
  kSolved,
  kNoResult,  ///< not solved yet
  kFiltered,  ///< has a result, which the condition leaves out
  kFailed,
  kNoValue,  ///< solved, but without that output, or with one that has no place
  kNoPoint,  ///< the study has no point there
};

/// Cells between edges, with a value each, row by row from the lowest.
struct Cells {
  std::vector<double> x_edges = {};  ///< rising, one more than columns
  std::vector<double> y_edges = {};
  std::vector<double> values = {};  ///< NaN where the state is another than kSolved
  std::vector<CellState> states = {};
  std::vector<double> x_values = {};  ///< where the cells stand for one value each; else none
  std::vector<double> y_values = {};

  std::size_t columns() const { return x_edges.empty() ? 0 : x_edges.size() - 1; }
  std::size_t rows() const { return y_edges.empty() ? 0 : y_edges.size() - 1; }
};

/// A kind of cells in a map of kinds, as a mode.
struct Kind {
  std::string name{};
  std::uint64_t points = 0;
  bool is_rest = false;                    ///< stands for all that have no kind of their own
  std::vector<std::string> gathered = {};  ///< of the rest: the names
};

/// Cells of which each is of a kind: `values` of the cells are numbers of kinds.
struct KindCells {
  std::string name;  ///< of the column, for tables
  Cells cells = {};
  std::vector<Kind> kinds = {};
  std::vector<std::string> names = {};  ///< of the cells before kinds were gathered, for tables
  /// Areas of fewer cells are colours alone, without hatching and outlines; 0: all are.
  std::size_t least_outlined = 1;
};

/// Bars that stand on 0, between edges; or, with names, lie one below the other.
struct Bars {
  std::vector<double> edges = {};
  std::vector<double> heights = {};
  std::vector<std::string> names = {};
};

/// Points with a colour each, or of one.
struct Dots {
  std::vector<double> x = {};
  std::vector<double> y = {};
  std::vector<double> shades = {};  ///< empty: all of the first stroke
};

/// A frame with two axes and what is in it.
struct Panel {
  FigureAxis x{};
  FigureAxis y{};
  bool has_equal_aspect = false;  ///< a metre is as long upwards as sideways
  double share = 1.0;             ///< of the height that panels have together
  std::string title = {};
  std::string by_name = {};  ///< of the column that tells curves apart, for tables
  std::vector<Span> spans = {};
  std::optional<Cells> cells = {};
  std::optional<KindCells> kinds = {};
  std::optional<Bars> bars = {};
  std::optional<Dots> dots = {};
  std::vector<Curve> curves = {};
  std::vector<KnownPoint> known = {};
};

/// What colours mean.
struct Colours {
  FigureAxis axis{};
  bool has_below = false;  ///< there are values below the range, drawn as its lower end
  bool has_above = false;
  /// Lines, points and scattered cells lie on a light plate, in dark pictures too, and do without
  /// the pale shades, which is lost there.
  bool has_plate = false;
};

/// Cells of a map that have no value to draw, by reason.
struct Gaps {
  std::uint64_t no_result = 0;  ///< not solved yet
  std::uint64_t filtered = 0;   ///< with a result, which the condition leaves out
  std::uint64_t failed = 0;
  std::uint64_t no_value = 0;  ///< solved, but without that output, or with one that has no place
};

struct Figure {
  std::string title{};
  std::string subtitle = {};
  std::vector<Panel> panels = {};  ///< one below the other
  std::optional<Colours> colours = {};
  Gaps gaps = {};
  bool is_empty = false;                ///< there is no value to draw: one of the notes says so
  std::vector<std::string> notes = {};  ///< sentences below the picture
};

/// The colour of a share from 0 to 1 of what colours span; others take that of the nearer end.
Colour shade_of(const Colours& colours, double share);

/// Notes that there is nothing to draw; `why` is a part of a sentence.
void say_empty(Figure& figure, const std::string& why);

/// Whether the picture says which colour stands for which value.
bool has_colour_scale(const Figure& figure);

/// Counts the gaps of cells.
Gaps gaps_of(const Cells& cells);

/// The kinds of solved cells; -1: of others.
KindGrid kind_grid_of(const Cells& cells);

/// Middles of the cells between edges, on a scale of that kind.
std::vector<double> middles_of(const std::vector<double>& edges, bool is_logarithmic);

/// Edges halfway between values that rise; a single one gets room around it.
std::vector<double> edges_between(const std::vector<double>& values, bool is_logarithmic);

}  // namespace oblique::client::plot
