#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/plot/data/gathered.h"
#include "client/plot/drawing.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

constexpr std::size_t kMostCellsAlong = 1024;  // an axis; beyond it cells gather values

void refuse_log_of_axis(const std::string& flag, bool is_asked, const std::vector<double>& values) {
  if (is_asked && !values.empty() && values.front() <= 0.0) {
    throw solver::InputError(fmt::format("{}: an axis that has {} cannot be logarithmic", flag,
                                         solver::readable_number(values.front())));
  }
}

/// Between scattered points there is nothing that could have a result.
void blank_unmet(Cells& cells) {
  std::replace(cells.states.begin(), cells.states.end(), CellState::kNoResult, CellState::kNoPoint);
}

void say_gathered(Figure& figure, const GatheredCells& gathered) {
  if (gathered.most_in_a_cell > 1) {
    figure.notes.push_back(fmt::format(
        "Cells hold up to {} points and show {}{}.", shown_count(gathered.most_in_a_cell),
        gathered.has_names ? "what most of these have, percentages count points" : "their mean",
        gathered.mixed_cells == 0 ? ""
        : gathered.mixed_cells == 1
            ? "; 1 cell has others too"
            : fmt::format("; {} cells have others too", shown_count(gathered.mixed_cells))));
  }
}

/// Cells along each side for so many scattered points: about three points a cell.
std::size_t side_for(std::size_t points) {
  return static_cast<std::size_t>(
      std::clamp(std::sqrt(static_cast<double>(points) / 3.0), 8.0, 160.0));
}

/// The values of an axis of cells; none where cells are to gather them. Of an axis that `where`
/// speaks of only the part that has rows is drawn.
std::vector<double> cell_values(const ChosenAxis& axis, const AnswerColumn& column,
                                const std::string& where) {
  if (axis.axis == nullptr || !axis.axis->is_listed) {
    return {};
  }
  std::vector<double> of_study = axis.axis->values;
  if (!where.empty() && names_axis(where, *axis.axis) && !column.numbers.empty()) {
    const Range part = range_of(column.numbers);
    std::erase_if(of_study, [&part](double v) { return v < part.from || v > part.to; });
  }
  auto values = axis_values(std::move(of_study), column);
  return values.size() <= kMostCellsAlong ? values : std::vector<double>();
}

}  // namespace

void Drawing::tell_filtered(Cells& cells, const ChosenAxis& x, const ChosenAxis& y) {
  const auto is_empty = [](CellState state) { return state == CellState::kNoResult; };
  if (request_.where.empty() || std::none_of(cells.states.begin(), cells.states.end(), is_empty)) {
    return;
  }
  // One row a cell, however many points it has.
  ResultQuery query;
  query.study = request_.study;
  query.where = condition_.sql_without_where;
  query.select = query.group = fmt::format("{}, {}", x.column, y.column);
  const auto answer = answer_to(query, 2);
  mark_filtered(cells, answer[0], answer[1]);
}

Figure Drawing::map() {
  const std::string remedy = fmt::format(
      "has fewer than two axes{}: take --lines, --scatter or --histogram, or name --x and --y",
      request_.at.empty() ? "" : " that --at leaves open");
  // The one that is named is not chosen for the other.
  const std::vector<ChosenAxis> named_y =
      request_.y.empty() ? std::vector<ChosenAxis>()
                         : std::vector<ChosenAxis>{chosen_axis("--y", request_.y, shape_)};
  const ChosenAxis x = chosen_or("--x", request_.x, named_y, remedy);
  const ChosenAxis y = chosen_or("--y", request_.y, {x}, remedy);
  if (x.column == y.column) {
    throw solver::InputError(fmt::format("--x and --y are both {}: a map has two axes", x.name));
  }
  const bool are_axes = x.axis != nullptr && y.axis != nullptr;
  condition_ = condition_of(request_, shape_, {x, y}, are_axes && shape_.is_grid);
  const auto answer = ask({x.column, y.column, request_.map, "status"});
  refuse_log_of_nothing("--log-colour", request_.is_colour_logarithmic, answer[2]);
  const MapAxes axes{quantity(x, answer[0]), quantity(y, answer[1]),
                     request_.is_x_logarithmic || is_logarithmic_by_study(x),
                     request_.is_y_logarithmic || is_logarithmic_by_study(y)};
  const MapRows rows{answer[0], answer[1], answer[2], answer[3]};
  const auto x_values = cell_values(x, answer[0], request_.where);
  const auto y_values = cell_values(y, answer[1], request_.where);
  GatheredCells gathered;
  if (shape_.is_grid && !x_values.empty() && !y_values.empty()) {
    refuse_log_of_axis("--log-x", axes.is_x_logarithmic, x_values);
    refuse_log_of_axis("--log-y", axes.is_y_logarithmic, y_values);
    gathered = gathered_on(rows, x_values, y_values, axes.is_x_logarithmic, axes.is_y_logarithmic);
    tell_filtered(gathered.cells, x, y);
  } else {
    refuse_log_of_nothing("--log-x", axes.is_x_logarithmic, answer[0]);
    refuse_log_of_nothing("--log-y", axes.is_y_logarithmic, answer[1]);
    const std::size_t side = side_for(answer[0].numbers.size());
    gathered = gathered_in_bins(rows, side, side, axes.is_x_logarithmic, axes.is_y_logarithmic);
    blank_unmet(gathered.cells);
  }
  const std::string plural = request_.map.find("mode") != std::string::npos ? "modes" : "kinds";
  Figure figure = gathered.has_names
                      ? kind_map(axes, answer[2].name, std::move(gathered.cells),
                                 std::move(gathered.names), gathered.points_of_name, plural)
                      : heat_map(axes, quantity_of(answer[2].name, answer[2].unit),
                                 std::move(gathered.cells), colours());
  say_gathered(figure, gathered);
  entitle(figure, answer[2].name, gathered.points);
  return figure;
}

}  // namespace oblique::client::plot
