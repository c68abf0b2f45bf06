#include "client/plot/plot_request.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/plot/axis_choice.h"
#include "client/plot/figure_builder.h"
#include "client/plot/study_shape.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client::plot {

void check(const PlotRequest& request) {
  const std::vector<std::pair<const char*, const std::string*>> texts{
      {"--map", &request.map},
      {"--lines", &request.lines},
      {"--scatter", &request.scatter},
      {"--histogram", &request.histogram},
      {"--x", &request.x},
      {"--y", &request.y},
      {"--by", &request.by},
      {"--colour", &request.colour}};
  for (const auto& [flag, text] : texts) {
    if (!text->empty()) {
      server::check_sql_part(flag, *text);
    }
  }
  if (!request.where.empty()) {
    server::check_sql_part("--where", request.where);
  }
  if (!request.scatter.empty() && names_in(request.scatter).size() != 2) {
    throw solver::InputError(fmt::format(
        "--scatter {} is not allowed: it must be two columns, as mu,fn_peak_N", request.scatter));
  }
  const bool is_number =
      request.block.find_first_not_of("0123456789") == std::string::npos && request.block != "0";
  if (!is_number && request.block != "all") {
    throw solver::InputError(
        fmt::format("--block {} is not allowed: it must be the number of a block, from 1, or `all`",
                    request.block));
  }
  (void)range_given(request.range);
}

namespace {

/// Over which of the two axes that are left open lines say more than a map: the other one has few
/// values, and cells as tall as their distance would reach to values that it cannot have.
const StudyAxis* axis_of_few_lines(const PlotRequest& request,
                                   const std::vector<const StudyAxis*>& axes) {
  std::vector<const StudyAxis*> open;
  for (const StudyAxis* axis : axes) {
    const bool is_held = std::any_of(
        request.at.begin(), request.at.end(),
        [axis](const std::string& at) { return at.substr(0, at.find('=')) == axis->key; });
    if (!is_held) {
      open.push_back(axis);
    }
  }
  constexpr std::size_t kFew = 3;
  if (open.size() != 2 || !open[0]->is_listed || !open[1]->is_listed ||
      std::min(open[0]->values.size(), open[1]->values.size()) > kFew) {
    return nullptr;
  }
  return open[0]->values.size() < open[1]->values.size() ? open[1] : open[0];
}

}  // namespace

PlotRequest completed(PlotRequest request, const StudyShape& shape) {
  const bool is_told = !request.map.empty() || !request.lines.empty() || !request.scatter.empty() ||
                       !request.histogram.empty();
  if (is_told) {
    return request;
  }
  const auto axes = by_preference(shape);
  if (!request.colour.empty() && axes.size() >= 2) {
    request.scatter = fmt::format("{},{}", axes[0]->key, axes[1]->key);
  } else if (const StudyAxis* over = axis_of_few_lines(request, axes);
             over != nullptr && shape.is_grid && request.y.empty() && request.by.empty()) {
    request.lines = kUsualOutput;
    request.x = request.x.empty() ? over->key : request.x;
  } else if (request.by.empty() &&
             (!request.y.empty() || (shape.is_grid && axes.size() >= 2 + request.at.size()))) {
    request.map = kUsualOutput;
  } else if (!request.by.empty() || (shape.is_grid && !axes.empty())) {
    request.lines = kUsualOutput;
  } else if (axes.size() >= 2) {
    request.scatter = fmt::format("{},{}", axes[0]->key, axes[1]->key);
    request.colour = request.colour.empty() ? kUsualOutput : request.colour;
  } else if (!axes.empty()) {
    request.scatter = fmt::format("{},{}", axes[0]->key, kUsualOutput);
  } else {
    request.histogram = kUsualOutput;
  }
  return request;
}

namespace {

/// Logarithms of what --range gives, of colours or of the axis of numbers, must be there.
void check_range(const PlotRequest& request) {
  const bool has_colours = !request.map.empty() || !request.scatter.empty();
  const auto [flag, is_logarithmic] =
      has_colours              ? std::pair{"--log-colour", request.is_colour_logarithmic}
      : !request.lines.empty() ? std::pair{"--log-y", request.is_y_logarithmic}
                               : std::pair{"--log-x", request.is_x_logarithmic};
  const auto range = range_given(request.range);
  if (range && is_logarithmic && range->from <= 0.0) {
    throw solver::InputError(fmt::format("--range {} is not allowed with {}: FROM must be above 0",
                                         request.range, flag));
  }
}

}  // namespace

Figure figure_of(Source& source, const StudyShape& shape, const PlotRequest& request,
                 const Tell& tell) {
  check_range(request);
  FigureBuilder builder(source, shape, request, tell);
  return !request.map.empty()       ? builder.map()
         : !request.lines.empty()   ? builder.lines()
         : !request.scatter.empty() ? builder.scatter()
                                    : builder.histogram();
}

}  // namespace oblique::client::plot
