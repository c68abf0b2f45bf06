#include "client/plot/figure_builder.h"

#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "client/io/format_units.h"
#include "client/plot/study_shape.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {

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

std::vector<AnswerColumn> FigureBuilder::query(const std::vector<std::string>& columns) {
  ResultQuery query;
  query.study = request_.study;
  query.where = condition_.sql;
  query.select = fmt::format("{}", fmt::join(columns, ", "));
  return answer_to(query, columns.size());
}

std::vector<AnswerColumn> FigureBuilder::answer_to(const ResultQuery& query, std::size_t columns) {
  check(query);
  const auto stream = source_.rows(request_for(query));
  auto answer = read_columns(*stream);
  if (answer.size() != columns) {
    throw solver::InputError(fmt::format("a picture takes one column a flag, and `{}` are {}",
                                         query.select, answer.size()));
  }
  return answer;
}

ChosenAxis FigureBuilder::chosen_or(const std::string& flag, const std::string& text,
                                    const std::vector<ChosenAxis>& taken,
                                    const std::string& remedy) const {
  if (!text.empty()) {
    return chosen_axis(flag, text, shape_);
  }
  for (const StudyAxis* axis : by_preference(shape_)) {
    const bool is_taken = std::any_of(taken.begin(), taken.end(),
                                      [axis](const ChosenAxis& each) { return each.axis == axis; });
    if (!is_taken && !is_held(*axis)) {
      return chosen_axis(flag, axis->key, shape_);
    }
  }
  throw solver::InputError(fmt::format("{} {}", request_.study, remedy));
}

void FigureBuilder::add_titles(Figure& figure, const std::string& what,
                               std::uint64_t points) const {
  const auto counted_points = [](std::uint64_t count) {
    return count == 1 ? "1 point" : format_count(count) + " points";
  };
  figure.title = fmt::format("{}: {}", request_.study, what);
  for (const auto& shown : condition_.shown) {
    figure.subtitle += shown + ", ";
  }
  figure.subtitle += counted_points(points);
  if (shape_.is_one_block) {
    const std::size_t block = shape_.block.number + 1;
    figure.notes.push_back(fmt::format("Block {} of {}; not drawn: {} of {}.", block, shape_.blocks,
                                       counted_points(shape_.points - shape_.block.points),
                                       shape_.blocks == 2 ? "the other" : "the others"));
    if (request_.block.empty()) {
      tell_(
          fmt::format("The study has {} blocks; block {} is drawn. --block N draws another, and "
                      "--block all draws all of them.",
                      shape_.blocks, block));
    }
  }
  for (const auto& sentence : condition_.said) {
    tell_(sentence);
  }
  if (figure.is_empty) {
    tell_("No point of the picture has a value: nothing is drawn in it.");
  }
}

bool FigureBuilder::is_held(const StudyAxis& axis) const {
  return std::any_of(request_.at.begin(), request_.at.end(), [&axis](const std::string& at) {
    const auto key = at.substr(0, at.find('='));
    return key == axis.key || key == axis.column;
  });
}

FigureAxis FigureBuilder::axis_for(const std::string& flag, const ChosenAxis& axis,
                                   const AnswerColumn& column, bool is_logarithmic) const {
  const bool has_positive = std::any_of(column.numbers.begin(), column.numbers.end(),
                                        [](double value) { return value > 0.0; });
  const bool is_length = axis.axis != nullptr && axis.axis->key.starts_with("length");
  FigureAxis made = axis_of(axis.name, is_length ? "m" : column.unit);
  made.is_logarithmic = is_logarithmic || (axis.axis != nullptr && axis.axis->is_logarithmic);
  if (made.is_logarithmic && !has_positive && !column.numbers.empty()) {
    throw solver::InputError(fmt::format("{}: no value of {} is above 0", flag, column.name));
  }
  return made;
}

FigureAxis FigureBuilder::colours_for(Figure& figure, FigureAxis axis,
                                      const std::vector<double>& values) const {
  axis.is_logarithmic = request_.is_colour_logarithmic;
  const auto is_positive = [](double value) { return value > 0.0; };
  if (axis.is_logarithmic && !values.empty() &&
      std::none_of(values.begin(), values.end(), is_positive)) {
    throw solver::InputError(fmt::format("--log-colour: no value of {} is above 0", axis.name));
  }
  const Range all = range_of(values, axis.is_logarithmic);
  axis.range = Scale(range_given(request_.range).value_or(all), axis.is_logarithmic).range();
  if (all.from < axis.range.from || all.to > axis.range.to) {
    figure.notes.push_back(
        fmt::format("Values from {} to {}; those outside the scale have the "
                    "colour of its end.",
                    solver::readable_number(all.from * axis.per_unit, 4),
                    solver::readable_number(all.to * axis.per_unit, 4)));
  }
  return axis;
}

}  // namespace oblique::client::plot
