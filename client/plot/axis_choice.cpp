#include "client/plot/axis_choice.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "client/io/format_units.h"
#include "client/plot/figure.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

using solver::readable_number;

std::vector<std::string_view> keys_of(const StudyShape& shape) {
  std::vector<std::string_view> keys;
  for (const StudyAxis& axis : shape.axes) {
    keys.push_back(axis.key);
  }
  return keys;
}

std::string values_in_words(const StudyAxis& axis) {
  const auto& values = axis.all_values;
  constexpr std::size_t kFew = 8;
  if (values.size() > kFew) {
    return fmt::format("{} values from {} to {}", format_count(values.size()),
                       readable_number(values.front()), readable_number(values.back()));
  }
  std::string text = values.size() == 1 ? "the value" : "the values";
  for (std::size_t i = 0; i < values.size(); ++i) {
    text += (i == 0 ? " " : i + 1 == values.size() ? " and " : ", ") + readable_number(values[i]);
  }
  return text;
}

double nearest_value(const std::vector<double>& values, double wanted) {
  return *std::min_element(values.begin(), values.end(), [wanted](double a, double b) {
    return std::abs(a - wanted) < std::abs(b - wanted);
  });
}

/// KEY=VALUE taken apart.
struct At {
  const StudyAxis* axis;
  double value;
};

At judged_at(const std::string& text, const StudyShape& shape) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw solver::InputError(fmt::format("--at {} is not allowed: it must be KEY=VALUE, as e=1",
                                         protocol::excerpt(text)));
  }
  const std::string key = text.substr(0, equals);
  const StudyAxis* axis = shape.find(key);
  if (axis == nullptr) {
    const auto keys = keys_of(shape);
    throw solver::InputError(fmt::format(
        "--at {}: the study has no axis {}{}; it has {}", protocol::excerpt(text),
        protocol::excerpt(key), protocol::did_you_mean(key, keys), protocol::joined(keys)));
  }
  const auto value = solver::number_of(text.substr(equals + 1));
  if (!value || !std::isfinite(*value)) {
    throw solver::InputError(fmt::format("--at {} is not allowed: {} takes a number", text, key));
  }
  if (!axis->is_listed) {
    throw solver::InputError(fmt::format(
        "--at {}: values of {} lie scattered, and hardly a point has that one; take a range, as "
        "--where \"{} BETWEEN {} AND {}\"",
        text, key, axis->column, readable_number(*value * 0.95), readable_number(*value * 1.05)));
  }
  const double nearest = nearest_value(axis->all_values, *value);
  // Tables show six digits: who repeats them means that value.
  if (std::abs(nearest - *value) > 1e-5 * std::abs(*value)) {
    throw solver::InputError(
        fmt::format("--at {}: no point has that {}; the nearest is {}={}. It has {}", text, key,
                    key, readable_number(nearest), values_in_words(*axis)));
  }
  return {axis, nearest};
}

std::string value_of_axis(const StudyAxis& axis, double value) {
  return shown_value(
      axis_of(axis.key == "E" ? axis.column : axis.key, server::unit_of_column(axis.column)),
      value);
}

void add_term(std::string& sql, const std::string& term) {
  sql += (sql.empty() ? "" : " AND ") + term;
}

void fix(Condition& condition, const StudyAxis& axis, double value) {
  const std::string term = fmt::format("{} = {}", axis.column, solver::exact_number(value));
  add_term(condition.sql, term);
  add_term(condition.sql_without_where, term);
}

void add_condition(Condition& condition, const StudyAxis& axis, double value) {
  if (axis.varies()) {
    fix(condition, axis, value);
  }
  condition.shown.push_back(value_of_axis(axis, value));
}

bool is_drawn(const std::vector<ChosenAxis>& drawn, const StudyAxis& axis) {
  return std::any_of(drawn.begin(), drawn.end(),
                     [&axis](const ChosenAxis& each) { return each.axis == &axis; });
}

}  // namespace

ChosenAxis chosen_axis(const std::string& flag, const std::string& text, const StudyShape& shape) {
  if (const StudyAxis* axis = shape.find(text)) {
    return {axis->column, axis->key == "E" ? axis->column : axis->key, axis};
  }
  const auto is_word = std::all_of(text.begin(), text.end(), [](unsigned char letter) {
    return std::isalnum(letter) != 0 || letter == '_';
  });
  if (is_word) {
    std::vector<std::string_view> names = keys_of(shape);
    const auto columns = server::columns_and_functions();
    bool is_column = false;
    for (const auto& column : columns) {
      names.push_back(column.name);
      is_column = is_column || column.name == text;
    }
    if (!is_column) {
      throw solver::InputError(
          fmt::format("{} {}: there is no such axis or column{}; the axes of this study are {}",
                      flag, protocol::excerpt(text), protocol::did_you_mean(text, names),
                      protocol::joined(keys_of(shape))));
    }
  }
  return {text, text, nullptr};
}

std::vector<const StudyAxis*> by_preference(const StudyShape& shape) {
  auto axes = shape.varying();
  const auto rank = [](const StudyAxis* axis) {
    constexpr double kScattered = 1e18;
    return axis->key == "mu" ? -2e18
           : axis->key == "H"
               ? -1e18
               : -(axis->is_listed ? static_cast<double>(axis->values.size()) : kScattered / 2.0);
  };
  std::stable_sort(axes.begin(), axes.end(),
                   [&rank](const StudyAxis* a, const StudyAxis* b) { return rank(a) < rank(b); });
  return axes;
}

bool names_axis(const std::string& condition, const StudyAxis& axis) {
  const auto tokens = server::sql_tokens(condition);
  return std::any_of(tokens.begin(), tokens.end(), [&axis](const server::SqlToken& token) {
    return token.is_name() && (token.text == axis.key || token.text == axis.column);
  });
}

Condition condition_of(const PlotRequest& request, const StudyShape& shape,
                       const std::vector<ChosenAxis>& drawn, bool fixes_others) {
  Condition condition;
  if (shape.is_one_block) {
    condition.sql = fmt::format("point >= {} AND point < {}", shape.block.first_point,
                                shape.block.first_point + shape.block.points);
    condition.sql_without_where = condition.sql;
    condition.shown.push_back(fmt::format("block {} of {}", shape.block.number + 1, shape.blocks));
  }
  if (!request.where.empty()) {
    add_term(condition.sql, fmt::format("({})", request.where));
    condition.shown.push_back(request.where);
  }
  std::vector<const StudyAxis*> fixed;
  for (const auto& text : request.at) {
    const At at = judged_at(text, shape);
    if (is_drawn(drawn, *at.axis)) {
      throw solver::InputError(
          fmt::format("--at {}: {} is an axis of the picture; take --where for a part of it", text,
                      at.axis->key));
    }
    if (std::find(fixed.begin(), fixed.end(), at.axis) != fixed.end()) {
      throw solver::InputError(fmt::format("--at {}: {} has a value already", text, at.axis->key));
    }
    fixed.push_back(at.axis);
    add_condition(condition, *at.axis, at.value);
  }
  for (const StudyAxis& axis : shape.axes) {
    const bool is_open = axis.is_listed && !is_drawn(drawn, axis) &&
                         std::find(fixed.begin(), fixed.end(), &axis) == fixed.end() &&
                         (request.where.empty() || !names_axis(request.where, axis));
    if (!is_open || !(fixes_others || axis.all_values.size() == 1)) {
      continue;
    }
    const double value = axis.values.front();
    // Of all points: said only where another choice would show others.
    if (axis.all_values.size() > 1) {
      fix(condition, axis, value);
      condition.said.push_back(
          fmt::format("{} has {}; {} = {} is drawn, and --at {}=VALUE draws another.", axis.key,
                      values_in_words(axis), axis.key, readable_number(value), axis.key));
    }
    condition.shown.push_back(value_of_axis(axis, value));
  }
  return condition;
}

}  // namespace oblique::client::plot
