#include "client/plot/drawing.h"

#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
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

std::vector<AnswerColumn> Drawing::ask(const std::vector<std::string>& columns) {
  ResultQuery query;
  query.study = request_.study;
  query.where = condition_.sql;
  query.select.clear();
  for (const auto& column : columns) {
    query.select += (query.select.empty() ? "" : ", ") + column;
  }
  return answer_to(query, columns.size());
}

std::vector<AnswerColumn> Drawing::answer_to(const ResultQuery& query, std::size_t columns) {
  check(query);
  const auto stream = source_.rows(request_for(query));
  auto answer = read_columns(*stream);
  if (answer.size() != columns) {
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
    if (!is_taken && !is_held(*axis)) {
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
  say_block(figure);
  for (const auto& sentence : condition_.said) {
    tell_(sentence);
  }
}

void Drawing::say_block(Figure& figure) const {
  if (!shape_.is_one_block) {
    return;
  }
  const std::size_t number = shape_.block.number + 1;
  const std::uint64_t others = shape_.points - shape_.block.points;
  figure.notes.push_back(fmt::format("Block {} of {}; not drawn: {} of {}.", number, shape_.blocks,
                                     others == 1 ? "1 point" : shown_count(others) + " points",
                                     shape_.blocks == 2 ? "the other" : "the others"));
  if (request_.block.empty()) {
    tell_(
        fmt::format("The study has {} blocks; block {} is drawn. --block N draws another, and "
                    "--block all draws all of them.",
                    shape_.blocks, number));
  }
}

void Drawing::refuse_log_of_nothing(const std::string& flag, bool is_asked,
                                    const AnswerColumn& column) {
  const bool has_positive = std::any_of(column.numbers.begin(), column.numbers.end(),
                                        [](double value) { return value > 0.0; });
  if (is_asked && !has_positive && !column.numbers.empty()) {
    throw solver::InputError(fmt::format("{}: no value of {} is above 0", flag, column.name));
  }
}

bool Drawing::is_held(const StudyAxis& axis) const {
  return std::any_of(request_.at.begin(), request_.at.end(), [&axis](const std::string& at) {
    const auto key = at.substr(0, at.find('='));
    return key == axis.key || key == axis.column;
  });
}

Quantity Drawing::quantity(const ChosenAxis& axis, const AnswerColumn& column) {
  const bool is_length = axis.axis != nullptr && axis.axis->key.starts_with("length");
  return quantity_of(axis.name, is_length ? "m" : column.unit);
}

bool Drawing::is_logarithmic_by_study(const ChosenAxis& axis) {
  return axis.axis != nullptr && axis.axis->is_logarithmic;
}

ColourChoice Drawing::colours() const {
  return {request_.is_colour_logarithmic, range_given(request_.range)};
}

}  // namespace oblique::client::plot
