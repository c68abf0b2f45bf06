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
/// of `map`, `lines`, `scatter` and `histogram` is given; if none is, the program chooses a
/// picture.
struct PlotRequest {
  std::string study{};
  std::string map{};        ///< an output shown over two axes
  std::string lines{};      ///< an output shown over one axis
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

/// Checks all flags as far as possible without the study. Throws solver::InputError with the flag.
void check(const PlotRequest& request);

/// The range of --range; nothing if not given. Throws solver::InputError for an invalid range.
std::optional<Range> range_given(const PlotRequest& request);

std::pair<std::string, std::string> scatter_columns(const PlotRequest& request);

/// A parameter (key) that has values in the study.
struct StudyAxis {
  std::string key;     ///< name in study files: "E"
  std::string column;  ///< column in queries: "E_Pa"; an expression for single lengths
  /// Values in the picture, ascending. Empty if they are drawn from a distribution, follow from
  /// other keys, or are more than kMaxListed.
  std::vector<double> values = {};
  bool is_listed = true;        ///< `values` is complete
  bool is_logarithmic = false;  ///< the study file gives the range with spacing "log"

  bool varies() const { return !is_listed || values.size() > 1; }
  bool is_named(std::string_view name) const { return name == key || name == column; }
  /// Label in pictures. E is labelled E_Pa, because SQL does not distinguish E and e.
  const std::string& label() const { return key == "E" ? column : key; }
};
inline constexpr std::uint64_t kMaxListed = 100'000;

/// The structure of a study that pictures need: axes, blocks and numbers of points.
struct StudyShape {
  std::vector<StudyAxis> axes;  ///< in the order of the recipe: model keys, then H, mu and e
  bool is_grid = true;          ///< the chosen block combines all values of its axes
  std::size_t block = 0;        ///< index of the chosen block, from 0
  std::uint64_t first_point = 0;
  std::uint64_t block_points = 0;
  std::size_t blocks = 1;     ///< of the study
  std::uint64_t points = 0;   ///< points in all blocks, including those that filters leave out
  bool is_one_block = false;  ///< the study has several blocks and the picture shows one

  /// Returns the axis with that key or column, or nullptr.
  const StudyAxis* find(std::string_view name) const;
  /// Returns the axes with more than one value, in the order in which a picture chooses them: mu,
  /// H, then those with the most values.
  std::vector<const StudyAxis*> by_preference() const;
  std::vector<std::string_view> keys() const;
};

/// Returns the structure of the block of --block. Without --block, returns that of the largest
/// block that has the requested axes and values, if this block is a grid and the picture is a map
/// or lines. In all other cases returns the structure of all blocks. Throws solver::InputError for
/// an unknown block and for a recipe without points.
StudyShape shape_for(const protocol::Recipe& recipe, const PlotRequest& request);

struct ChosenAxis {
  std::string column;               ///< column in queries
  std::string name;                 ///< label
  const StudyAxis* axis = nullptr;  ///< nullptr if `column` is not an axis
};

/// Returns the key or column that the text of a flag names. A text that is not a single word is
/// returned as an expression; the source of the rows checks it. Throws solver::InputError for an
/// unknown word, and suggests the nearest known one.
ChosenAxis chosen_axis(const std::string& flag, const std::string& text, const StudyShape& shape);

/// SQL condition that selects the points of a picture.
struct Condition {
  std::string sql;                 ///< empty: all points
  std::string sql_without_where;   ///< `sql` without the condition of --where
  std::vector<std::string> shown;  ///< values for the subtitle: "e = 0.9"
  std::vector<std::string> said;   ///< sentences about choices
};

/// Combines --where and --at. `drawn` contains the axes of the picture. With `fixes_others`, each
/// other axis that varies is fixed at its first value, unless --at or --where names it. Throws
/// solver::InputError if an --at has an unknown key, or a value that the key does not have; the
/// error then contains the nearest value.
Condition condition_of(const PlotRequest& request, const StudyShape& shape,
                       const std::vector<ChosenAxis>& drawn, bool fixes_others);

bool where_names(const PlotRequest& request, const StudyAxis& axis);
/// Whether an --at fixes the axis.
bool at_holds(const PlotRequest& request, const StudyAxis& axis);

/// Returns the request. If it names no kind of picture, chooses one: a map of the largest normal
/// force over two axes; lines for one axis, or if one of two axes has few values; single points if
/// the study is not a grid.
PlotRequest completed(PlotRequest request, const StudyShape& shape);

/// Draws the rows of `source`. `tell` receives sentences about automatic choices. Throws the errors
/// of the source, and solver::InputError, with the flag and the remedy, if the request does not fit
/// the study.
Figure figure_of(Source& source, const StudyShape& shape, const PlotRequest& request,
                 const Tell& tell);

}  // namespace oblique::client::plot
