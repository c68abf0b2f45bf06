#include "proto/recipe/block_points.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/keys.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::InputError;

bool follows(const Axis& axis) {
  return !axis.expression().empty();
}

}  // namespace

std::string expression_in_words(std::string_view key, const std::string& text) {
  return fmt::format("{} = \"{}\"", key, excerpt(text));
}

BlockPoints::BlockPoints(const solver::ModelParameters& base, const Block& block)
    : base_(base),
      block_(block),
      values_(static_cast<std::size_t>(block.axes_size())),
      points_(points_of_block(block)) {
  std::uint32_t dimensions = 0;
  for (const AxisLayout& layout : layout_of(block)) {
    Source& source = sources_.emplace_back(Source{layout, layout.values == 0 ? dimensions++ : 0});
    if (layout.axis->count() > 0) {
      source.range.emplace(*layout.axis);
    } else if (layout.axis->has_distribution()) {
      source.quantiles.emplace(*layout.axis);
    }
  }
  std::vector<Formula> formulas;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (const Axis& axis = *sources_[i].layout.axis; follows(axis)) {
      formulas.push_back(read_formula(axis.key(), axis.expression(), i));
    }
  }
  sort(std::move(formulas));
  if (!block.where().empty()) {
    filter_ = read_formula("where", block.where(), sources_.size());
  }
  count_models();
}

BlockPoints::Formula BlockPoints::read_formula(std::string_view key, const std::string& text,
                                               std::size_t axis) {
  try {
    Formula formula{expressions::Expression(text), {}, axis};
    for (const std::string& name : formula.expression.names()) {
      formula.inputs.push_back(input_called(name));
    }
    return formula;
  } catch (const InputError& fault) {
    throw InputError(fmt::format("{}: {}", expression_in_words(key, text), fault.what()));
  }
}

/// The axis of that name, or a new constant of the base model.
std::size_t BlockPoints::input_called(const std::string& name) {
  const std::size_t key = key_number(name);
  const auto axis_of = [this](std::size_t wanted) {
    const auto found = std::find_if(sources_.begin(), sources_.end(), [&](const Source& source) {
      return source.layout.key == wanted;
    });
    return static_cast<std::size_t>(found - sources_.begin());
  };
  std::size_t axis = axis_of(key);
  double constant = 0.0;
  if (const auto link = link_of_key(key); axis == sources_.size() && link) {
    axis = axis_of(key_number("length"));  // sets the length of every link
    if (axis_of(key_number("links")) < sources_.size()) {
      constant = base_.lengths_m.front();  // `links` makes all of them as long as the first
    } else if (*link < base_.lengths_m.size()) {
      constant = base_.lengths_m[*link];
    } else if (axis == sources_.size()) {
      throw InputError(fmt::format("`{}` is the length of no link: the model has {}", name,
                                   base_.lengths_m.size()));
    }
  } else if (axis == sources_.size()) {
    constant = key_numbered(key).get(base_);
  }
  if (axis < sources_.size()) {
    return axis;
  }
  constants_.push_back(constant);
  return sources_.size() + constants_.size() - 1;
}

void BlockPoints::sort(std::vector<Formula> formulas) {
  while (!formulas.empty()) {
    // The first formula whose inputs are all computed.
    const auto next = std::find_if(formulas.begin(), formulas.end(), [&](const Formula& formula) {
      return std::none_of(formulas.begin(), formulas.end(), [&](const Formula& other) {
        return std::find(formula.inputs.begin(), formula.inputs.end(), other.axis) !=
               formula.inputs.end();
      });
    });
    if (next == formulas.end()) {
      std::string circle;
      for (const Formula& formula : formulas) {
        circle += (circle.empty() ? "" : ", ") + sources_[formula.axis].layout.axis->key();
      }
      throw InputError(fmt::format(
          "{}: the expressions go round in a circle: one must follow from keys that do not",
          circle));
    }
    formulas_.push_back(std::move(*next));
    formulas.erase(next);
  }
}

void BlockPoints::count_models() {
  const bool is_product = block_kind(block_) == BlockKind::kProduct;
  std::vector<bool> varies;  // whether the axis varies within one combination of model axes
  for (const Source& source : sources_) {
    varies.push_back(is_drawn(*source.layout.axis) &&
                     (!is_product || is_point_key(source.layout.key)));
  }
  for (const Formula& formula : formulas_) {
    varies[formula.axis] =
        std::any_of(formula.inputs.begin(), formula.inputs.end(),
                    [&](std::size_t input) { return input < varies.size() && varies[input]; });
  }
  const std::size_t model_axes_end = sources_.size() - kPointKeyOrder.size();
  if (std::find(varies.begin(), varies.end(), true) - varies.begin() <
      static_cast<std::ptrdiff_t>(model_axes_end)) {
    models_ = points_;
  } else if (is_product) {
    models_ = combinations(model_axes(block_));
  }
}

void BlockPoints::go_to(std::uint64_t point) {
  if (point == at_) {
    return;
  }
  at_ = ~std::uint64_t{0};  // until all is computed
  filter_value_.reset();
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (!follows(*sources_[i].layout.axis)) {
      values_[i] = value_of(i, point);
    }
  }
  for (Formula& formula : formulas_) {
    values_[formula.axis] = result_of(formula);
  }
  at_ = point;
}

double BlockPoints::value_of(std::size_t axis, std::uint64_t point) {
  Source& source = sources_[axis];
  const AxisLayout& layout = source.layout;
  std::uint64_t number = 0;
  if (layout.values == 0) {
    const double part = sampling::fraction(block_.sample(), source.dimension, point);
    if (source.quantiles) {
      return source.quantiles->value_at(part);
    }
    const std::uint64_t values = axis_size(*layout.axis);
    number = std::min(static_cast<std::uint64_t>(part * static_cast<double>(values)), values - 1);
  } else if (layout.values > 1) {
    number = point / layout.stride % layout.values;
  }
  if (number == source.last) {
    return values_[axis];
  }
  source.last = number;
  return source.range ? source.range->at(number) : layout.axis->values(static_cast<int>(number));
}

double BlockPoints::result_of(Formula& formula) {
  inputs_.clear();
  for (const std::size_t input : formula.inputs) {
    inputs_.push_back(input < values_.size() ? values_[input] : constants_[input - values_.size()]);
  }
  return formula.expression.value_at(inputs_);
}

bool BlockPoints::is_left_in() {
  return !filter_ || (!std::isnan(filter_value()) && filter_value() != 0.0);
}

double BlockPoints::filter_value() {
  if (!filter_value_) {
    filter_value_ = result_of(*filter_);
  }
  return *filter_value_;
}

solver::ModelParameters BlockPoints::model() const {
  solver::ModelParameters model = base_;
  for (const bool are_single : {false, true}) {  // single lengths act on what `links` has made
    for (std::size_t i = sources_.size() - kPointKeyOrder.size(); i-- > 0;) {
      const std::size_t number = sources_[i].layout.key;
      const solver::ParameterKey& key = key_numbered(number);
      if (link_of_key(number).has_value() == are_single && std::isfinite(values_[i]) &&
          key.is_allowed(values_[i])) {
        key.set(model, values_[i]);
      }
    }
  }
  return model;
}

std::string BlockPoints::fault() {
  if (filter_ && std::isnan(filter_value())) {
    return fmt::format("where has no value: {}", values_in_words());
  }
  if (!is_left_in()) {
    return {};
  }
  try {
    for (const Formula& formula : formulas_) {
      solver::check_value(key_numbered(sources_[formula.axis].layout.key), values_[formula.axis]);
    }
    const double* point = values_.data() + values_.size() - kPointKeyOrder.size();
    solver::validate_point(model(), point[0], point[1], point[2]);
  } catch (const InputError& fault) {
    return fmt::format("{}: {}", fault.what(), values_in_words());
  }
  return {};
}

/// "k = 1e7, H = 0.3, mu = 0.1, e = 1"
std::string BlockPoints::values_in_words() const {
  std::string words;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    words += fmt::format("{}{} = {}", words.empty() ? "" : ", ", sources_[i].layout.axis->key(),
                         solver::exact_number(values_[i]));
  }
  return words;
}

}  // namespace oblique::protocol
