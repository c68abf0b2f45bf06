#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/plot/axis_choice.h"
#include "client/plot/data/answer_columns.h"
#include "client/plot/data/gathered.h"
#include "client/plot/figures/charts.h"
#include "client/plot/figures/maps.h"
#include "client/plot/plot_request.h"
#include "client/service/result_query.h"
#include "proto/text.h"
#include "server/asking/columns.h"
#include "server/asking/sql/sql_expression.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

constexpr std::size_t kMostCellsAlong = 1024;  // an axis; beyond it cells gather values

/// FROM:TO.
std::optional<Range> range_given(const std::string& text) {
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

std::vector<std::string> names_in(const std::string& text) {
  std::vector<std::string> names;
  for (const auto part : protocol::split(text, ',')) {
    const auto from = part.find_first_not_of(' ');
    const auto to = part.find_last_not_of(' ');
    names.emplace_back(from == std::string_view::npos ? std::string_view()
                                                      : part.substr(from, to - from + 1));
  }
  return names;
}

/// Draws one picture from the rows of a source.
class Drawing {
 public:
  Drawing(Source& source, const StudyShape& shape, const PlotRequest& request, const Tell& tell)
      : source_(source), shape_(shape), request_(request), tell_(tell) {}

  Figure map();
  Figure lines();
  Figure scattered();
  Figure counts();

 private:
  std::vector<AnswerColumn> ask(const std::vector<std::string>& columns);
  void say(const Condition& condition) const {
    for (const auto& sentence : condition.said) {
      tell_(sentence);
    }
  }
  ChosenAxis chosen_or(const std::string& flag, const std::string& text,
                       const std::vector<ChosenAxis>& taken, const std::string& remedy) const;
  Quantity quantity(const ChosenAxis& axis, const AnswerColumn& column) const {
    const bool is_length = axis.axis != nullptr && axis.axis->key.starts_with("length");
    return quantity_of(axis.name, is_length ? "m" : column.unit);
  }
  bool is_logarithmic_by_study(const ChosenAxis& axis) const {
    return axis.axis != nullptr && axis.axis->is_logarithmic;
  }
  ColourChoice colours() const {
    return {palette_named(request_.palette), request_.is_colour_logarithmic,
            range_given(request_.range)};
  }
  void entitle(Figure& figure, const std::string& what, std::uint64_t points) const;
  void refuse_log_of_nothing(const std::string& flag, bool is_asked,
                             const AnswerColumn& column) const;

  Source& source_;
  const StudyShape& shape_;
  const PlotRequest& request_;
  const Tell& tell_;
  Condition condition_;
};

std::vector<AnswerColumn> Drawing::ask(const std::vector<std::string>& columns) {
  ResultQuery query;
  query.study = request_.study;
  query.where = condition_.sql;
  query.select.clear();
  for (const auto& column : columns) {
    query.select += (query.select.empty() ? "" : ", ") + column;
  }
  check(query);
  const auto stream = source_.rows(request_for(query));
  auto answer = read_columns(*stream);
  if (answer.size() != columns.size()) {
    throw solver::InputError(fmt::format("a picture takes one column a flag, and `{}` are {}",
                                         query.select, answer.size()));
  }
  return answer;
}

ChosenAxis Drawing::chosen_or(const std::string& flag, const std::string& text,
                              const std::vector<ChosenAxis>& taken,
                              const std::string& remedy) const {
  if (!text.empty()) {
    return chosen_axis(flag, text, shape_);
  }
  for (const StudyAxis* axis : by_preference(shape_)) {
    const bool is_taken = std::any_of(taken.begin(), taken.end(),
                                      [axis](const ChosenAxis& each) { return each.axis == axis; });
    const bool is_fixed =
        std::any_of(request_.at.begin(), request_.at.end(), [axis](const std::string& at) {
          return at.substr(0, at.find('=')) == axis->key ||
                 at.substr(0, at.find('=')) == axis->column;
        });
    if (!is_taken && !is_fixed) {
      return chosen_axis(flag, axis->key, shape_);
    }
  }
  throw solver::InputError(fmt::format("{} {}", request_.study, remedy));
}

void Drawing::entitle(Figure& figure, const std::string& what, std::uint64_t points) const {
  figure.title = fmt::format("{}: {}", protocol::visible(request_.study), what);
  for (const auto& shown : condition_.shown) {
    figure.subtitle += shown + ", ";
  }
  figure.subtitle += points == 1 ? "1 point" : shown_count(points) + " points";
}

void Drawing::refuse_log_of_nothing(const std::string& flag, bool is_asked,
                                    const AnswerColumn& column) const {
  const bool has_positive = std::any_of(column.numbers.begin(), column.numbers.end(),
                                        [](double value) { return value > 0.0; });
  if (is_asked && !has_positive && !column.numbers.empty()) {
    throw solver::InputError(fmt::format("{}: no value of {} is above 0", flag, column.name));
  }
}

Figure Drawing::map() {
  const std::string remedy =
      "has fewer than two axes: take --lines, --scatter or --histogram, or name --x and --y";
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
  const MapRows rows{answer[0], answer[1], answer[2], answer[3]};
  MapAxes axes{quantity(x, answer[0]), quantity(y, answer[1]),
               request_.is_x_logarithmic || is_logarithmic_by_study(x),
               request_.is_y_logarithmic || is_logarithmic_by_study(y)};
  GatheredCells gathered;
  const auto x_values =
      x.axis != nullptr ? axis_values(x.axis->values, answer[0]) : std::vector<double>();
  const auto y_values =
      y.axis != nullptr ? axis_values(y.axis->values, answer[1]) : std::vector<double>();
  const auto fits = [](const ChosenAxis& axis, const std::vector<double>& values) {
    return axis.axis != nullptr && axis.axis->is_listed && values.size() <= kMostCellsAlong;
  };
  const bool is_grid = shape_.is_grid && fits(x, x_values) && fits(y, y_values);
  if (is_grid) {
    for (const auto& [flag, is_log, values] :
         {std::tuple{"--log-x", axes.is_x_logarithmic, &x_values},
          std::tuple{"--log-y", axes.is_y_logarithmic, &y_values}}) {
      if (is_log && !values->empty() && values->front() <= 0.0) {
        throw solver::InputError(fmt::format("{}: an axis that has {} cannot be logarithmic", flag,
                                             solver::readable_number(values->front())));
      }
    }
    gathered = gathered_on(rows, x_values, y_values, axes.is_x_logarithmic, axes.is_y_logarithmic);
  } else {
    refuse_log_of_nothing("--log-x", axes.is_x_logarithmic, answer[0]);
    refuse_log_of_nothing("--log-y", axes.is_y_logarithmic, answer[1]);
    const auto side = static_cast<std::size_t>(
        std::clamp(std::sqrt(static_cast<double>(answer[0].numbers.size()) / 3.0), 8.0, 160.0));
    gathered = gathered_in_bins(rows, side, side, axes.is_x_logarithmic, axes.is_y_logarithmic);
  }
  const std::string plural = request_.map.find("mode") != std::string::npos ? "modes" : "kinds";
  Figure figure = gathered.has_names ? kind_map(axes, answer[2].name, std::move(gathered.cells),
                                                std::move(gathered.names), plural)
                                     : heat_map(axes, quantity_of(answer[2].name, answer[2].unit),
                                                std::move(gathered.cells), colours());
  if (gathered.most_in_a_cell > 1) {
    figure.notes.push_back(fmt::format("Cells hold up to {} points and show {}.",
                                       shown_count(gathered.most_in_a_cell),
                                       gathered.has_names ? "the first" : "their mean"));
  }
  if (!is_grid) {
    figure.gaps.no_result = 0;  // between scattered points there is nothing to have a result
    for (auto& panel : figure.panels) {
      auto* cells = panel.cells ? &*panel.cells : panel.kinds ? &panel.kinds->cells : nullptr;
      if (cells != nullptr) {
        std::replace(cells->states.begin(), cells->states.end(), CellState::kNoResult,
                     CellState::kNoValue);
      }
    }
  }
  say(condition_);
  entitle(figure, answer[2].name, gathered.points);
  return figure;
}

Figure Drawing::lines() {
  const ChosenAxis x =
      chosen_or("--x", request_.x, {}, "has no axis with more than one value: name --x");
  std::optional<ChosenAxis> by;
  const auto preferred = by_preference(shape_);
  if (!request_.by.empty()) {
    by = chosen_axis("--by", request_.by, shape_);
  } else if (shape_.is_grid) {
    // Of the others that with the fewest values has the fewest lines.
    const StudyAxis* fewest = nullptr;
    for (const StudyAxis* axis : preferred) {
      const bool is_fixed = std::any_of(
          request_.at.begin(), request_.at.end(),
          [axis](const std::string& at) { return at.substr(0, at.find('=')) == axis->key; });
      if (axis != x.axis && axis->is_listed && !is_fixed &&
          (request_.where.empty() || !names_axis(request_.where, *axis)) &&
          (fewest == nullptr || axis->values.size() < fewest->values.size())) {
        fewest = axis;
      }
    }
    if (fewest != nullptr) {
      by = chosen_axis("--by", fewest->key, shape_);
    }
  }
  if (by && by->column == x.column) {
    throw solver::InputError(fmt::format("--x and --by are both {}", x.name));
  }
  std::vector<ChosenAxis> drawn{x};
  std::vector<std::string> columns{x.column, request_.lines};
  if (by) {
    drawn.push_back(*by);
    columns.push_back(by->column);
  }
  condition_ = condition_of(request_, shape_, drawn, x.axis != nullptr && shape_.is_grid);
  const auto answer = ask(columns);
  if (answer[1].has_texts()) {
    throw solver::InputError(
        fmt::format("--lines {}: its values are texts; take --map {} or --histogram {}",
                    request_.lines, request_.lines, request_.lines));
  }
  refuse_log_of_nothing("--log-x", request_.is_x_logarithmic, answer[0]);
  refuse_log_of_nothing("--log-y", request_.is_y_logarithmic, answer[1]);
  ChartChoice choice;
  choice.is_x_logarithmic = request_.is_x_logarithmic || is_logarithmic_by_study(x);
  choice.is_y_logarithmic = request_.is_y_logarithmic;
  choice.colours = colours();
  choice.range = range_given(request_.range);
  Figure figure =
      line_chart(quantity(x, answer[0]), quantity_of(answer[1].name, answer[1].unit),
                 by ? std::optional(quantity(*by, answer[2])) : std::nullopt,
                 gathered_lines(answer[0], answer[1], by ? &answer[2] : nullptr), choice);
  const auto gaps = std::count_if(answer[1].numbers.begin(), answer[1].numbers.end(),
                                  [](double value) { return std::isnan(value); });
  if (gaps > 0) {
    figure.notes.push_back(fmt::format(
        "{} without a value: gaps in the lines.",
        gaps == 1 ? "1 point is" : shown_count(static_cast<std::uint64_t>(gaps)) + " points are"));
  }
  say(condition_);
  entitle(figure, answer[1].name, answer[0].numbers.size());
  return figure;
}

Figure Drawing::scattered() {
  const auto names = names_in(request_.scatter);
  const ChosenAxis x = chosen_axis("--scatter", names[0], shape_);
  const ChosenAxis y = chosen_axis("--scatter", names[1], shape_);
  condition_ = condition_of(request_, shape_, {x, y}, false);
  std::vector<std::string> columns{x.column, y.column};
  if (!request_.colour.empty()) {
    columns.push_back(chosen_axis("--colour", request_.colour, shape_).column);
  }
  auto answer = ask(columns);
  for (const auto& column : answer) {
    if (column.has_texts()) {
      throw solver::InputError(fmt::format(
          "{} has texts, which have no place on an axis; --map and --histogram take them",
          column.name));
    }
  }
  refuse_log_of_nothing("--log-x", request_.is_x_logarithmic, answer[0]);
  refuse_log_of_nothing("--log-y", request_.is_y_logarithmic, answer[1]);
  ChartChoice choice;
  choice.is_x_logarithmic = request_.is_x_logarithmic || is_logarithmic_by_study(x);
  choice.is_y_logarithmic = request_.is_y_logarithmic || is_logarithmic_by_study(y);
  choice.colours = colours();
  std::optional<Quantity> colour;
  Dots dots{std::move(answer[0].numbers), std::move(answer[1].numbers), {}};
  if (answer.size() > 2) {
    refuse_log_of_nothing("--log-colour", request_.is_colour_logarithmic, answer[2]);
    colour = quantity_of(answer[2].name, answer[2].unit);
    dots.shades = std::move(answer[2].numbers);
  }
  const std::uint64_t points = dots.x.size();
  Figure figure = scatter(quantity(x, answer[0]), quantity(y, answer[1]), colour, dots, choice);
  const std::string what = fmt::format("{} over {}", y.name, x.name);
  entitle(figure, colour ? fmt::format("{}, coloured by {}", what, colour->name) : what, points);
  return figure;
}

Figure Drawing::counts() {
  const ChosenAxis column = chosen_axis("--histogram", request_.histogram, shape_);
  condition_ = condition_of(request_, shape_, {column}, false);
  const auto answer = ask({column.column});
  const Quantity counted = quantity(column, answer[0]);
  Figure figure;
  if (answer[0].has_texts()) {
    std::vector<std::uint64_t> counts(answer[0].words.size(), 0);
    std::uint64_t without = 0;
    for (const std::uint32_t word : answer[0].word_of_row) {
      if (word == AnswerColumn::kNoWord) {
        ++without;
      } else {
        ++counts[word];
      }
    }
    figure = name_counts(counted, answer[0].words, counts);
    if (without > 0) {
      figure.notes.push_back(fmt::format("{} of {} points have no value.", shown_count(without),
                                         shown_count(answer[0].numbers.size())));
    }
  } else {
    refuse_log_of_nothing("--log-x", request_.is_x_logarithmic, answer[0]);
    ChartChoice choice;
    choice.is_x_logarithmic = request_.is_x_logarithmic;
    choice.is_y_logarithmic = request_.is_y_logarithmic;
    choice.range = range_given(request_.range);
    figure = histogram(counted, answer[0].numbers, choice);
  }
  entitle(figure, answer[0].name, answer[0].numbers.size());
  return figure;
}

}  // namespace

void check(const PlotRequest& request) {
  using server::SqlPart;
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
      server::check_sql_part(flag, *text, SqlPart::kColumns);
    }
  }
  if (!request.where.empty()) {
    server::check_sql_part("--where", request.where, SqlPart::kCondition);
  }
  if (!request.scatter.empty() && names_in(request.scatter).size() != 2) {
    throw solver::InputError(fmt::format(
        "--scatter {} is not allowed: it must be two columns, as mu,fn_peak_N", request.scatter));
  }
  (void)palette_named(request.palette);
  (void)range_given(request.range);
}

PlotRequest completed(PlotRequest request, const StudyShape& shape) {
  const bool is_told = !request.map.empty() || !request.lines.empty() || !request.scatter.empty() ||
                       !request.histogram.empty();
  if (is_told) {
    return request;
  }
  const auto axes = by_preference(shape);
  if (!request.by.empty()) {
    request.lines = kUsualOutput;
  } else if (!request.y.empty() || (shape.is_grid && axes.size() >= 2 + request.at.size())) {
    request.map = kUsualOutput;
  } else if (shape.is_grid && !axes.empty()) {
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

Figure figure_of(Source& source, const StudyShape& shape, const PlotRequest& request,
                 const Tell& tell) {
  Drawing drawing(source, shape, request, tell);
  return !request.map.empty()       ? drawing.map()
         : !request.lines.empty()   ? drawing.lines()
         : !request.scatter.empty() ? drawing.scattered()
                                    : drawing.counts();
}

}  // namespace oblique::client::plot
