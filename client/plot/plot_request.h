#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/plot/figure.h"
#include "client/service/source.h"
#include "proto/oblique.pb.h"

namespace oblique::client::plot {

/// The flags of `oblique plot` for a study. Texts are SQL over the columns of queries. At most one
/// of the first four is given; without them a suitable picture is drawn.
struct PlotRequest {
  std::string study{};
  std::string map{};        ///< an output over two axes
  std::string lines{};      ///< an output over one axis
  std::string scatter{};    ///< two columns: "X,Y"
  std::string histogram{};  ///< a column
  std::string x{};          ///< empty: chosen
  std::string y{};
  std::string by{};
  std::string colour{};
  std::string where{};
  std::vector<std::string> at{};  ///< "KEY=VALUE"
  std::string block{};            ///< number of the block from 1, or "all"; empty: chosen
  bool is_x_logarithmic = false;
  bool is_y_logarithmic = false;
  bool is_colour_logarithmic = false;
  std::string range{};  ///< "FROM:TO"
};

/// Checks everything that does not depend on the study. Throws solver::InputError with the flag.
void check(const PlotRequest& request);

/// The range of --range; nothing if it is not given. Throws solver::InputError for an invalid
/// range.
std::optional<Range> range_given(const PlotRequest& request);

std::pair<std::string, std::string> scatter_columns(const PlotRequest& request);

/// A key that has values in the study.
struct StudyAxis {
  std::string key;     ///< name in study files: "E"
  std::string column;  ///< column in queries: "E_Pa"; an expression for single lengths
  /// The values in the picture, ascending; empty if they are drawn from a distribution, follow from
  /// other keys, or are more than kMaxListed.
  std::vector<double> values = {};
  bool is_listed = true;        ///< `values` is complete
  bool is_logarithmic = false;  ///< the range is logarithmic

  bool varies() const { return !is_listed || values.size() > 1; }
  bool is_named(std::string_view name) const { return name == key || name == column; }
  /// Label in pictures: E_Pa for E, because SQL does not distinguish E and e.
  const std::string& label() const { return key == "E" ? column : key; }
};
inline constexpr std::uint64_t kMaxListed = 100'000;

/// Structure of a study, as far as pictures need it.
struct StudyShape {
  std::vector<StudyAxis> axes;  ///< in the order of the recipe: model keys, then H, mu and e
  bool is_grid = true;          ///< the chosen block multiplies its axes
  std::size_t block = 0;        ///< the chosen block, from 0
  std::uint64_t first_point = 0;
  std::uint64_t block_points = 0;
  std::size_t blocks = 1;     ///< of the study
  std::uint64_t points = 0;   ///< of all blocks, including points that filters leave out
  bool is_one_block = false;  ///< pictures show one of several blocks

  /// The axis of that key or column; nullptr: none.
  const StudyAxis* find(std::string_view name) const;
  /// The keys with more than one value, in the order of choice for axes: mu, H, then those with the
  /// most values.
  std::vector<const StudyAxis*> by_preference() const;
  std::vector<std::string_view> keys() const;
};

/// Reads the structure of the study. With several blocks, a map or lines show one: the block of
/// `--block`, else the one with the most points among those with the requested axes and values. All
/// blocks are shown with `--block all`, if no suitable block is a grid, and for points and
/// histograms without --block. Throws solver::InputError for an unknown block and for a recipe
/// without points.
StudyShape shape_for(const protocol::Recipe& recipe, const PlotRequest& request);

struct ChosenAxis {
  std::string column;               ///< column in queries
  std::string name;                 ///< label
  const StudyAxis* axis = nullptr;  ///< nullptr: a column of results
};

/// The key or column that a flag names. Throws solver::InputError for an unknown word, with the
/// nearest one; the source checks other expressions.
ChosenAxis chosen_axis(const std::string& flag, const std::string& text, const StudyShape& shape);

/// The condition on the points of a picture.
struct Condition {
  std::string sql;                 ///< empty: all points
  std::string sql_without_where;   ///< the same without --where
  std::vector<std::string> shown;  ///< values for the subtitle: "e = 0.9"
  std::vector<std::string> said;   ///< sentences about choices
};

/// --where and --at and, with `fixes_others`, the first value of each other open axis. `drawn`: the
/// axes of the picture. Throws solver::InputError if an --at names no key or a value that the key
/// does not have, with the nearest.
Condition condition_of(const PlotRequest& request, const StudyShape& shape,
                       const std::vector<ChosenAxis>& drawn, bool fixes_others);

bool where_names(const PlotRequest& request, const StudyAxis& axis);
/// Whether an --at fixes the axis.
bool at_holds(const PlotRequest& request, const StudyAxis& axis);

/// The request with a suitable kind of picture if none is requested: a map of the largest normal
/// force over two axes, lines over one axis or if another has few values, points if they are
/// scattered.
PlotRequest completed(PlotRequest request, const StudyShape& shape);

/// Draws the rows of `source`. `tell` receives sentences about choices. Throws solver::InputError,
/// with the flag and the remedy, if the request does not fit the study, and what the source throws.
Figure figure_of(Source& source, const StudyShape& shape, const PlotRequest& request,
                 const Tell& tell);

}  // namespace oblique::client::plot
