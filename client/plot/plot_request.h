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

/// What to draw of a study, as flags say it. Texts are SQL over the columns of queries. At most one
/// of the first four is given; with none of them what suits the study is drawn.
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
  std::string block{};            ///< its number from 1, or "all"; empty: chosen
  bool is_x_logarithmic = false;
  bool is_y_logarithmic = false;
  bool is_colour_logarithmic = false;
  std::string range{};  ///< "FROM:TO"
};

/// Throws solver::InputError, naming the flag, for what is wrong whatever the study is.
void check(const PlotRequest& request);

/// What --range says; none: nothing. Throws solver::InputError for a range that is none.
std::optional<Range> range_given(const PlotRequest& request);

/// The columns of --scatter.
std::pair<std::string, std::string> scatter_columns(const PlotRequest& request);

/// A key of a study that the recipe gives values to.
struct StudyAxis {
  std::string key;     ///< as studies write it: "E"
  std::string column;  ///< as queries do: "E_Pa"; for single lengths an expression
  /// Values in what is drawn, rising; none where they are drawn from a distribution or follow from
  /// others, or are more than kMostListed.
  std::vector<double> values = {};
  bool is_listed = true;        ///< `values` has them all
  bool is_logarithmic = false;  ///< its range is

  bool varies() const { return !is_listed || values.size() > 1; }
  bool is_named(std::string_view name) const { return name == key || name == column; }
  /// As pictures label it: E is E_Pa, which SQL can tell from e.
  const std::string& label() const { return key == "E" ? column : key; }
};
inline constexpr std::uint64_t kMostListed = 100'000;

/// What a study is made of, as far as pictures need it.
struct StudyShape {
  std::vector<StudyAxis> axes;  ///< in the order of the recipe: model keys, then H, mu and e
  bool is_grid = true;          ///< the chosen block is a product of its axes
  std::size_t block = 0;        ///< the chosen block, from 0
  std::uint64_t first_point = 0;
  std::uint64_t block_points = 0;
  std::size_t blocks = 1;     ///< of the study
  std::uint64_t points = 0;   ///< of all blocks, with those that filters leave out
  bool is_one_block = false;  ///< of several blocks pictures show the chosen one alone

  /// nullptr: there is none of that key or column.
  const StudyAxis* find(std::string_view name) const;
  /// The keys with more than one value, in the order in which pictures take them for axes: mu, H,
  /// then those with the most values.
  std::vector<const StudyAxis*> by_preference() const;
  std::vector<std::string_view> keys() const;
};

/// The study as a picture of it needs it. Of several blocks a map, or lines, show one: that of
/// `--block`, else that with the most points of those that have the axes and values asked for.
/// Where there is none, or that block is no grid, with `--block all`, and for points and histograms
/// unless a block is named, all are shown. Throws solver::InputError for a block that the study
/// does not have, and for a recipe without points.
StudyShape shape_for(const protocol::Recipe& recipe, const PlotRequest& request);

/// An axis of a picture.
struct ChosenAxis {
  std::string column;               ///< as queries have it
  std::string name;                 ///< as it is labelled
  const StudyAxis* axis = nullptr;  ///< nullptr: it is a column of results
};

/// The key or column that a flag names. Throws solver::InputError for a word that is none, with the
/// nearest; other expressions are left to the source to check.
ChosenAxis chosen_axis(const std::string& flag, const std::string& text, const StudyShape& shape);

/// What holds for all points of a picture.
struct Condition {
  std::string sql;                 ///< empty: all points
  std::string sql_without_where;   ///< the same, also of points that --where leaves out
  std::vector<std::string> shown;  ///< "e = 0.9", for the subtitle
  std::vector<std::string> said;   ///< sentences about what was chosen
};

/// --where and --at, and with `fixes_others` the first value of each other axis that is left open.
/// `drawn`: the axes of the picture. Throws solver::InputError for an --at that names no key, or a
/// value that the key does not have, with the nearest.
Condition condition_of(const PlotRequest& request, const StudyShape& shape,
                       const std::vector<ChosenAxis>& drawn, bool fixes_others);

/// Whether --where speaks of the axis.
bool where_names(const PlotRequest& request, const StudyAxis& axis);
/// Whether an --at gives the axis a value.
bool at_holds(const PlotRequest& request, const StudyAxis& axis);

/// The same with what suits the study where nothing is asked for: a map of the largest normal force
/// over two axes, lines over one or where another has few values, points where they lie scattered.
PlotRequest completed(PlotRequest request, const StudyShape& shape);

/// Draws it from the rows of `source`. `tell` gets sentences about what was chosen. Throws
/// solver::InputError, naming the flag and what is allowed, for what does not fit the study, and
/// what the source throws.
Figure figure_of(Source& source, const StudyShape& shape, const PlotRequest& request,
                 const Tell& tell);

}  // namespace oblique::client::plot
