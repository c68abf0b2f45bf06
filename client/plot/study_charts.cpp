#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/plot/data/gathered.h"
#include "client/plot/drawing.h"
#include "client/plot/figures/charts.h"
#include "server/query/columns.h"
#include "worker/solver/model/errors.h"

namespace oblique::client::plot {

namespace {

/// Of whole lists hardly two are alike; their elements can be counted.
void refuse_list(const std::string& column) {
  if (server::is_list_column(column)) {
    throw solver::InputError(
        fmt::format("--histogram {0}: its values are lists; take an element, as {0}[0]", column));
  }
}

}  // namespace

std::optional<ChosenAxis> Drawing::lines_by(const ChosenAxis& x) const {
  if (!request_.by.empty()) {
    return chosen_axis("--by", request_.by, shape_);
  }
  // Of the others that with the fewest values has the fewest lines.
  const StudyAxis* fewest = nullptr;
  for (const StudyAxis* axis : by_preference(shape_)) {
    const bool is_open = shape_.is_grid && axis != x.axis && axis->is_listed && !is_held(*axis) &&
                         (request_.where.empty() || !names_axis(request_.where, *axis));
    if (is_open && (fewest == nullptr || axis->values.size() < fewest->values.size())) {
      fewest = axis;
    }
  }
  return fewest == nullptr ? std::nullopt : std::optional(chosen_axis("--by", fewest->key, shape_));
}

Figure Drawing::lines() {
  const ChosenAxis x =
      chosen_or("--x", request_.x, {}, "has no axis with more than one value: name --x");
  const auto by = lines_by(x);
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
  const bool is_whole_axis = x.axis != nullptr && shape_.is_grid;
  auto gathered = gathered_lines(answer[0], answer[1], by ? &answer[2] : nullptr,
                                 is_whole_axis ? x.axis->values : std::vector<double>());
  const auto [series, gaps, most] = std::move(gathered);
  Figure figure =
      line_chart(quantity(x, answer[0]), quantity_of(answer[1].name, answer[1].unit),
                 by ? std::optional(quantity(*by, answer[2])) : std::nullopt, series, choice);
  if (gaps > 0) {
    figure.notes.push_back(
        fmt::format("Gaps in the lines: {} without a value.",
                    gaps == 1 ? "1 point is" : shown_count(gaps) + " points are"));
  }
  if (most > 1) {
    figure.notes.push_back(fmt::format("Where up to {} points share a place, their mean is drawn.",
                                       shown_count(most)));
  }
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
  if (answer.size() > 2 && answer[2].has_texts()) {
    throw solver::InputError(
        fmt::format("--colour {}: its values are texts, and --scatter colours by numbers; take "
                    "--map {}, or --where for the points of one of them",
                    request_.colour, request_.colour));
  }
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
  refuse_list(request_.histogram);
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

}  // namespace oblique::client::plot
