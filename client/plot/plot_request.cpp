#include "client/plot/plot_request.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "client/plot/study_shape.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

std::string without_spaces(std::string_view text) {
  const auto from = text.find_first_not_of(' ');
  return from == std::string_view::npos
             ? std::string()
             : std::string(text.substr(from, text.find_last_not_of(' ') + 1 - from));
}

/// Of two axes that are left open the one over which lines say more than a map: the other one has
/// few values, and cells as tall as their distance would reach to values that it cannot have.
const StudyAxis* axis_of_few_lines(const std::vector<const StudyAxis*>& open) {
  constexpr std::size_t kFew = 3;
  if (open.size() != 2 || !open[0]->is_listed || !open[1]->is_listed ||
      std::min(open[0]->values.size(), open[1]->values.size()) > kFew) {
    return nullptr;
  }
  return open[0]->values.size() < open[1]->values.size() ? open[1] : open[0];
}

}  // namespace

void check(const PlotRequest& request) {
  for (const auto& [flag, text] : {std::pair{"--map", &request.map},
                                   {"--lines", &request.lines},
                                   {"--scatter", &request.scatter},
                                   {"--histogram", &request.histogram},
                                   {"--x", &request.x},
                                   {"--y", &request.y},
                                   {"--by", &request.by},
                                   {"--colour", &request.colour},
                                   {"--where", &request.where}}) {
    if (!text->empty()) {
      server::check_sql_part(flag, *text);
    }
  }
  if (!request.scatter.empty()) {
    static_cast<void>(scatter_columns(request));
  }
  static_cast<void>(range_given(request));
  const bool is_block = request.block == "all" || solver::number_of(request.block).value_or(0) >= 1;
  if (!request.block.empty() && !is_block) {
    throw solver::InputError(
        fmt::format("--block {} is not allowed: it must be the number of a block, from 1, or `all`",
                    request.block));
  }
}

std::optional<Range> range_given(const PlotRequest& request) {
  const std::string& text = request.range;
  if (text.empty()) {
    return std::nullopt;
  }
  const auto colon = text.find(':');
  const auto from = solver::number_of(text.substr(0, colon));
  const auto to =
      colon == std::string::npos ? std::nullopt : solver::number_of(text.substr(colon + 1));
  if (!from || !to || !(*from < *to) || !std::isfinite(*from) || !std::isfinite(*to)) {
    throw solver::InputError(fmt::format(
        "--range {} is not allowed: it must be FROM:TO with FROM < TO, in SI units", text));
  }
  return Range{*from, *to};
}

std::pair<std::string, std::string> scatter_columns(const PlotRequest& request) {
  const std::string_view text = request.scatter;
  const auto comma = text.find(',');
  if (comma == std::string_view::npos || text.find(',', comma + 1) != std::string_view::npos) {
    throw solver::InputError(
        fmt::format("--scatter {} is not allowed: it must be two columns, as mu,fn_peak_N", text));
  }
  return {without_spaces(text.substr(0, comma)), without_spaces(text.substr(comma + 1))};
}

PlotRequest completed(PlotRequest request, const StudyShape& shape) {
  if (!request.map.empty() || !request.lines.empty() || !request.scatter.empty() ||
      !request.histogram.empty()) {
    return request;
  }
  const std::string usual = "fn_peak_N";
  const auto axes = shape.by_preference();
  std::vector<const StudyAxis*> open = axes;
  std::erase_if(open, [&request](const StudyAxis* axis) { return at_holds(request, *axis); });
  const StudyAxis* over = axis_of_few_lines(open);
  const bool goes_by_axes = request.colour.empty() && shape.is_grid;
  if (goes_by_axes && over != nullptr && request.y.empty() && request.by.empty()) {
    request.lines = usual;
    request.x = request.x.empty() ? over->key : request.x;
  } else if (request.by.empty() && (!request.y.empty() || (goes_by_axes && open.size() >= 2))) {
    request.map = usual;
  } else if (!request.by.empty() || (goes_by_axes && !axes.empty())) {
    request.lines = usual;
  } else if (axes.size() >= 2) {
    request.scatter = fmt::format("{},{}", axes[0]->key, axes[1]->key);
    request.colour = request.colour.empty() ? usual : request.colour;
  } else if (!axes.empty()) {
    request.scatter = fmt::format("{},{}", axes[0]->key, usual);
  } else {
    request.histogram = usual;
  }
  return request;
}

}  // namespace oblique::client::plot
