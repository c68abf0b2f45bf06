#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/formats/table_printer.h"
#include "client/io/format_units.h"
#include "client/plot/figure_builder.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

constexpr std::size_t kMostCellsAlong = 1024;  // an axis; beyond it cells gather values

void refuse_log_of_axis(const std::string& flag, const FigureAxis& axis,
                        const std::vector<double>& values) {
  if (axis.is_logarithmic && values.front() <= 0.0) {
    throw solver::InputError(fmt::format("{}: an axis that has {} cannot be logarithmic", flag,
                                         solver::readable_number(values.front())));
  }
}

void note_gathered(Figure& figure, const Gathered& gathered) {
  if (gathered.most_in_a_cell <= 1) {
    return;
  }
  std::string note =
      fmt::format("Cells hold up to {} points and show ", format_count(gathered.most_in_a_cell));
  note += gathered.cells.names.empty() ? "their mean"
                                       : "what most of these have; percentages count points";
  if (gathered.mixed_cells > 0) {
    note += fmt::format("; {} {} others too", format_count(gathered.mixed_cells),
                        gathered.mixed_cells == 1 ? "cell has" : "cells have");
  }
  figure.notes.push_back(note + ".");
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

/// The categories by their points, largest first, with those that have next to none as one.
std::vector<Category> categories_of(const std::map<std::string, std::uint64_t>& points,
                                    const std::string& plural) {
  std::vector<Category> categories;
  std::uint64_t whole = 0;
  for (const auto& [name, count] : points) {
    categories.push_back({.name = name, .points = count});
    whole += count;
  }
  std::stable_sort(categories.begin(), categories.end(),
                   [](const Category& a, const Category& b) { return a.points > b.points; });
  std::size_t kept = categories.size();
  if (kept > kMostCategories) {
    kept = kMostCategories;
    while (kept > 1 && categories[kept - 1].points * 400 < whole) {
      --kept;  // less than a quarter of a per cent cannot be seen
    }
  }
  if (kept + 1 >= categories.size()) {  // a single one has its own name
    return categories;
  }
  Category other{.name = fmt::format("{} other {}", format_count(categories.size() - kept), plural),
                 .points = 0,
                 .is_other = true};
  for (std::size_t i = kept; i < categories.size(); ++i) {
    other.points += categories[i].points;
  }
  categories.resize(kept);
  categories.push_back(std::move(other));
  return categories;
}

}  // namespace

void blank_undrawable(Figure& figure, Cells& cells, bool is_logarithmic) {
  for (std::size_t i = 0; cells.names.empty() && i < cells.values.size(); ++i) {
    const double value = cells.values[i];
    if (cells.states[i] == CellState::kSolved &&
        !(std::isfinite(value) && (!is_logarithmic || value > 0.0))) {
      cells.states[i] = CellState::kNoValue;
      cells.values[i] = std::nan("");
    }
  }
  if (const auto blank = cells.count(CellState::kNoValue); blank > 0) {
    figure.notes.push_back(
        fmt::format("{} {} blank: solved, but without a value that can be drawn.",
                    format_count(blank), blank == 1 ? "cell is" : "cells are"));
  }
}

void add_categories(Figure& figure, Cells& cells,
                    const std::map<std::string, std::uint64_t>& points, const std::string& plural) {
  cells.categories = categories_of(points, plural);
  std::map<std::string, std::size_t> numbers;
  for (std::size_t k = 0; k < cells.categories.size(); ++k) {
    if (!cells.categories[k].is_other) {
      numbers.emplace(cells.categories[k].name, k);
    }
  }
  for (std::size_t i = 0; i < cells.names.size(); ++i) {
    if (cells.states[i] == CellState::kSolved) {
      const auto found = numbers.find(cells.names[i]);
      cells.values[i] =
          static_cast<double>(found == numbers.end() ? cells.categories.size() - 1 : found->second);
    }
  }
  if (cells.name == "mode" || cells.name == "major_mode") {
    figure.notes.push_back(fmt::format("{}: in the order of time.", kModeLetters));
  }
  if (!cells.categories.empty() && cells.categories.back().is_other) {
    figure.notes.push_back(
        fmt::format("The {} {} with the most points are named; --format csv has all {}.",
                    cells.categories.size() - 1, plural, format_count(points.size())));
  }
}

void FigureBuilder::find_filtered(Cells& cells, const ChosenAxis& x, const ChosenAxis& y) {
  if (request_.where.empty() || cells.count(CellState::kNoResult) == 0) {
    return;
  }
  ResultQuery query;  // one row a cell, however many points it has
  query.study = request_.study;
  query.where = condition_.sql_without_where;
  query.select = query.group = fmt::format("{}, {}", x.column, y.column);
  const auto answer = answer_to(query, 2);
  mark_filtered(cells, answer[0], answer[1]);
}

Gathered FigureBuilder::gather_map(const MapRows& rows, const ChosenAxis& x, const ChosenAxis& y,
                                   const Panel& panel) {
  const auto x_values = cell_values(x, rows.x, request_.where);
  const auto y_values = cell_values(y, rows.y, request_.where);
  if (shape_.is_grid && !x_values.empty() && !y_values.empty()) {
    refuse_log_of_axis("--log-x", panel.x, x_values);
    refuse_log_of_axis("--log-y", panel.y, y_values);
    auto gathered =
        gathered_on(rows, x_values, y_values, panel.x.is_logarithmic, panel.y.is_logarithmic);
    find_filtered(gathered.cells, x, y);
    return gathered;
  }
  // About three points a cell. Between scattered points nothing is missing.
  const auto side = static_cast<std::size_t>(
      std::clamp(std::sqrt(static_cast<double>(rows.x.numbers.size()) / 3.0), 8.0, 160.0));
  const auto scale_for = [](const AnswerColumn& column, bool is_logarithmic) {
    return Scale(range_of(column.numbers, is_logarithmic), is_logarithmic);
  };
  return gathered_in_bins(rows, scale_for(rows.x, panel.x.is_logarithmic), side,
                          scale_for(rows.y, panel.y.is_logarithmic), side);
}

Figure FigureBuilder::map() {
  const std::string remedy = fmt::format(
      "has fewer than two axes{}: take --lines, --scatter or --histogram, or name --x and --y",
      request_.at.empty() ? "" : " that --at leaves open");
  // The axis that --y names is not chosen for x.
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
  const auto answer = query({x.column, y.column, request_.map, "status"});
  Panel panel;
  panel.x = axis_for("--log-x", x, answer[0], request_.is_x_logarithmic);
  panel.y = axis_for("--log-y", y, answer[1], request_.is_y_logarithmic);
  Gathered gathered = gather_map({answer[0], answer[1], answer[2], answer[3]}, x, y, panel);
  Cells& cells = gathered.cells;
  cells.name = answer[2].name;
  if (!cells.x_edges.empty() && !cells.y_edges.empty()) {
    panel.x.range = {cells.x_edges.front(), cells.x_edges.back()};
    panel.y.range = {cells.y_edges.front(), cells.y_edges.back()};
  }
  Figure figure;
  if (cells.names.empty()) {
    std::vector<double> values = cells.values;
    std::erase_if(values, [](double value) { return std::isnan(value); });
    const FigureAxis axis = axis_of(answer[2].name, answer[2].unit);
    figure.colours = colours_for(figure, axis, values);
    if (const Range all = range_of(values); values.size() > 1 && all.from == all.to) {
      figure.notes.push_back(
          fmt::format("All cells have one value: {}.", shown_value(axis, all.from)));
    }
  } else {
    const bool is_mode = request_.map.find("mode") != std::string::npos;
    add_categories(figure, cells, gathered.points_of_name, is_mode ? "modes" : "texts");
  }
  blank_undrawable(figure, cells, request_.is_colour_logarithmic);
  if (cells.count(CellState::kSolved) == 0) {
    note_empty(figure, "no cell has a value");
  }
  note_gathered(figure, gathered);
  panel.cells = std::move(cells);
  figure.panels.push_back(std::move(panel));
  add_titles(figure, answer[2].name, gathered.points);
  return figure;
}

}  // namespace oblique::client::plot
