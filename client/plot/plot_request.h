#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/plot/figure.h"
#include "client/service/source.h"

namespace oblique::client::plot {

struct StudyShape;

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

/// The same with what suits the study where nothing is asked for: a map of the largest normal force
/// over two axes, lines over one or where another has few values, points where they lie scattered.
PlotRequest completed(PlotRequest request, const StudyShape& shape);

/// Draws it from the rows of `source`. `tell` gets sentences about what was chosen. Throws
/// solver::InputError, naming the flag and what is allowed, for what does not fit the study, and
/// what the source throws.
Figure figure_of(Source& source, const StudyShape& shape, const PlotRequest& request,
                 const Tell& tell);

}  // namespace oblique::client::plot
