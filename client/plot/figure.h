#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

// What a picture shows, without how it is drawn: the gnuplot script and the CSV table are made of
// the same Figure. Numbers are in SI units.
namespace oblique::client::plot {

struct Range {
  double from;
  double to;

  bool operator==(const Range&) const = default;
};

/// The smallest range that has all numbers but NaN and infinities, and only positive ones if asked
/// for; none: {0, 1}, respectively {0.1, 1}.
Range range_of(const std::vector<double>& values, bool positive_only = false);
Range united(const Range& one, const Range& other);
/// Wider at both ends by a share of the range, or of its logarithm. A range that does not reach 0
/// does not cross it.
Range widened(const Range& range, double by_share, bool is_logarithmic = false);

/// Maps values to shares: 0 at `from`, 1 at `to`.
class Scale {
 public:
  /// Equal ends become a range around them. Throws std::invalid_argument for a logarithmic scale
  /// with an end that is not positive.
  explicit Scale(Range range, bool is_logarithmic = false);

  Range range() const { return range_; }
  /// Below 0 and above 1 outside the range; NaN for values without a place, as 0 on a logarithmic
  /// scale.
  double share_of(double value) const;
  double value_at(double share) const;
  /// The edges of that many cells of equal size.
  std::vector<double> edges(std::size_t cells) const;

 private:
  Range range_;
  bool is_logarithmic_;
};

/// An axis of a panel, or the scale of its colours.
struct FigureAxis {
  std::string label;  ///< with the unit: "duration of contact [\u00b5s]"
  std::string name;   ///< column of results
  Range range{0.0, 1.0};
  bool is_logarithmic = false;
  double per_unit = 1.0;  ///< what ticks show for 1 in SI units
};

/// The axis of a column or key. `unit`: SI; empty: none, or unknown. Short times, slides and the
/// like are labelled in the units that tables for people have.
FigureAxis axis_of(const std::string& name, const std::string& unit);

/// "H = 1 m": a value with its name and unit.
std::string shown_value(const FigureAxis& axis, double value);

/// A line through points in their order, with marks at them if wanted. NaN is a gap.
struct Curve {
  std::string name = {};  ///< in the key; empty: none
  std::vector<double> x = {};
  std::vector<double> y = {};
  std::size_t stroke = 0;         ///< number of colour, dashes and mark
  std::optional<double> by = {};  ///< the value that tells it from others
  bool is_coloured_by = false;    ///< its colour is that of `by` on the scale of colours
  bool has_marks = false;
};

/// A shaded interval of the horizontal axis.
struct Span {
  enum class Kind { kCompression, kRestitution, kStick };
  double from;
  double to;
  Kind kind;
};

/// A published number.
struct KnownPoint {
  double x;
  double y;
  std::string name;  ///< in the key
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

/// Cells between edges, row by row from the lowest. With categories the values are their numbers.
struct Cells {
  std::string name = {};             ///< column of the values
  std::vector<double> x_edges = {};  ///< rising, one more than columns
  std::vector<double> y_edges = {};
  std::vector<double> values = {};  ///< NaN unless the state is kSolved
  std::vector<CellState> states = {};
  std::vector<double> x_values = {};  ///< the values that cells stand for; empty: intervals
  std::vector<double> y_values = {};
  std::vector<std::string> names = {};  ///< texts of the cells; empty: they have numbers
  std::vector<Category> categories = {};

  std::size_t columns() const { return x_edges.empty() ? 0 : x_edges.size() - 1; }
  std::size_t rows() const { return y_edges.empty() ? 0 : y_edges.size() - 1; }
  std::uint64_t count(CellState state) const;
};

/// Bars between edges or, with names, one below the other.
struct Bars {
  std::vector<double> edges = {};
  std::vector<double> heights = {};
  std::vector<std::string> names = {};
};

struct Dots {
  std::vector<double> x = {};
  std::vector<double> y = {};
  std::vector<double> shades = {};  ///< values of the scale of colours; empty: one colour
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
  std::optional<Dots> dots = {};
  std::vector<Curve> curves = {};
  std::vector<KnownPoint> known = {};
};

/// In pixels.
struct Size {
  double width = 760.0;
  double height = 520.0;
};
inline constexpr double kSmallestSide = 240.0;
inline constexpr double kLargestSide = 10'000.0;

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

/// Notes that there is nothing to draw, for that reason.
void note_empty(Figure& figure, const std::string& why);

/// Middles of the cells between edges.
std::vector<double> middles_of(const std::vector<double>& edges, bool is_logarithmic);

/// Edges halfway between rising values; a single one gets room around it.
std::vector<double> edges_between(const std::vector<double>& values, bool is_logarithmic);

}  // namespace oblique::client::plot
