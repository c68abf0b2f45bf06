#include "proto/recipe/block_points.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/keys.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::exact_number;
using solver::InputError;

/// In the place of an axis.
constexpr std::size_t kNoAxis = ~std::size_t{0};

sampling::Sample sample_of(const Sample& message) {
  const auto kind = message.kind() == SAMPLE_SOBOL             ? sampling::Kind::kSobol
                    : message.kind() == SAMPLE_LATIN_HYPERCUBE ? sampling::Kind::kLatinHypercube
                                                               : sampling::Kind::kRandom;
  return {kind, message.count(), message.seed()};
}

bool follows(const Axis& axis) {
  return !axis.expression().empty();
}

/// Throws the fault again with what it is of before it.
template <typename Make>
auto named(const std::string& what, Make make) {
  try {
    return make();
  } catch (const InputError& fault) {
    throw InputError(fmt::format("{}: {}", what, fault.what()));
  }
}

}  // namespace

std::string expression_in_words(std::string_view key, const std::string& text) {
  return fmt::format("{} = \"{}\"", key, excerpt(text));
}

sampling::Distribution distribution_of(const Axis& axis) {
  const Distribution& drawn = axis.distribution();
  const double from = smallest_value(axis);
  const double to = largest_value(axis);
  switch (drawn.kind()) {
    case DISTRIBUTION_NORMAL:
      return sampling::Distribution::normal(drawn.mean(), drawn.sd(), from, to);
    case DISTRIBUTION_LOG_UNIFORM:
      return sampling::Distribution::log_uniform(from, to);
    default:
      return sampling::Distribution::uniform(from, to);
  }
}

BlockPoints::BlockPoints(const solver::ModelParameters& base, const Block& block)
    : base_(base), block_(block), sample_(sample_of(block.sample())) {
  const auto axes = static_cast<std::size_t>(block.axes_size());
  keys_.reserve(axes);
  sources_.resize(axes);
  values_.resize(axes);
  std::uint32_t dimensions = 0;
  const std::vector<AxisLayout> layout = layout_of(block);
  for (std::size_t i = 0; i < axes; ++i) {
    keys_.push_back(layout[i].key);
    sources_[i].stride = layout[i].stride;
    sources_[i].values = layout[i].values;
    add_source(i, dimensions);
  }
  std::vector<Formula> formulas;
  for (std::size_t i = 0; i < axes; ++i) {
    const Axis& axis = block.axes(static_cast<int>(i));
    if (follows(axis)) {
      formulas.push_back(named(expression_in_words(axis.key(), axis.expression()),
                               [&] { return formula_of(axis.expression(), i); }));
    }
  }
  put_in_order(std::move(formulas));
  if (!block.where().empty()) {
    filter_.emplace(named(expression_in_words("where", block.where()),
                          [&] { return formula_of(block.where(), kNoAxis); }));
  }
  points_ = points_of_block(block);
  count_models();
}

void BlockPoints::add_source(std::size_t index, std::uint32_t& dimensions) {
  const Axis& axis = block_.axes(static_cast<int>(index));
  Source& source = sources_[index];
  if (axis.count() > 0) {
    source.range.emplace(axis);
  }
  if (axis.has_distribution()) {
    source.distribution.emplace(distribution_of(axis));
  }
  if (block_kind(block_) == BlockKind::kSample && is_drawn(axis)) {
    source.dimension = dimensions++;
  }
}

BlockPoints::Formula BlockPoints::formula_of(const std::string& text, std::size_t axis) {
  Formula formula{expressions::Expression(text), {}, axis};
  for (const std::string& name : formula.expression.names()) {
    formula.inputs.push_back(input_called(name));
  }
  return formula;
}

/// Where the value of that name comes from: an axis of the block, or the base model.
std::size_t BlockPoints::input_called(const std::string& name) {
  const std::size_t key = key_number(name);
  const auto axis_of = [this](std::size_t wanted) {
    return static_cast<std::size_t>(std::find(keys_.begin(), keys_.end(), wanted) - keys_.begin());
  };
  if (const std::size_t axis = axis_of(key); axis < keys_.size()) {
    return axis;
  }
  if (const auto link = link_of_key(key)) {
    // What `length` makes of every link.
    if (const std::size_t axis = axis_of(key_number("length")); axis < keys_.size()) {
      return axis;
    }
    // `links` makes all of them as long as the first.
    if (const std::size_t axis = axis_of(key_number("links")); axis < keys_.size()) {
      constants_.push_back(base_.lengths_m.front());
      return keys_.size() + constants_.size() - 1;
    }
    if (*link >= base_.lengths_m.size()) {
      throw InputError(fmt::format("`{}` is the length of no link: the model has {}", name,
                                   base_.lengths_m.size()));
    }
  }
  constants_.push_back(key_numbered(key).get(base_));
  return keys_.size() + constants_.size() - 1;
}

/// Each behind those whose values it asks for.
void BlockPoints::put_in_order(std::vector<Formula> formulas) {
  std::vector<bool> is_known(keys_.size(), true);
  for (const Formula& formula : formulas) {
    is_known[formula.axis] = false;
  }
  while (!formulas.empty()) {
    const auto next = std::find_if(formulas.begin(), formulas.end(), [&](const Formula& formula) {
      return std::all_of(formula.inputs.begin(), formula.inputs.end(), [&](std::size_t input) {
        return input >= keys_.size() || is_known[input];
      });
    });
    if (next == formulas.end()) {
      std::string circle;
      for (const Formula& formula : formulas) {
        circle += circle.empty() ? "" : ", ";
        circle += key_numbered(keys_[formula.axis]).name;
      }
      throw InputError(fmt::format(
          "{}: the expressions go round in a circle: one must follow from keys that do not",
          circle));
    }
    is_known[next->axis] = true;
    formulas_.push_back(std::move(*next));
    formulas.erase(next);
  }
}

/// The axes that the value of an axis depends on, itself among them.
std::vector<bool> BlockPoints::axes_behind(std::size_t axis) const {
  std::vector<bool> behind(keys_.size(), false);
  behind[axis] = true;
  for (std::size_t i = formulas_.size(); i-- > 0;) {  // those behind come before
    if (behind[formulas_[i].axis]) {
      for (const std::size_t input : formulas_[i].inputs) {
        if (input < keys_.size()) {
          behind[input] = true;
        }
      }
    }
  }
  return behind;
}

void BlockPoints::count_models() {
  const bool is_product = block_kind(block_) == BlockKind::kProduct;
  for (std::size_t axis = 0; axis < keys_.size(); ++axis) {
    if (is_point_key(keys_[axis])) {
      continue;
    }
    const std::vector<bool> behind = axes_behind(axis);
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      const bool varies = is_drawn(block_.axes(static_cast<int>(i)));
      if (behind[i] && varies && (!is_product || is_point_key(keys_[i]))) {
        models_ = points_;
        return;
      }
    }
  }
  if (is_product) {
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
    const Axis& axis = block_.axes(static_cast<int>(i));
    if (!follows(axis)) {
      values_[i] = value_from(sources_[i], axis, point);
    }
  }
  for (Formula& formula : formulas_) {
    values_[formula.axis] = result_of(formula);
  }
  at_ = point;
}

double BlockPoints::value_from(Source& source, const Axis& axis, std::uint64_t point) const {
  std::uint64_t number = 0;
  if (source.values != 0) {
    number = source.values == 1 ? 0 : point / source.stride % source.values;
  } else {
    const double part = sampling::fraction(sample_, source.dimension, point);
    if (source.distribution) {
      return source.distribution->value_at(part);
    }
    const std::uint64_t values = axis_size(axis);
    number = std::min(static_cast<std::uint64_t>(part * static_cast<double>(values)), values - 1);
  }
  const auto index = static_cast<std::size_t>(&source - sources_.data());
  if (number == source.last) {
    return values_[index];
  }
  source.last = number;
  return source.range ? source.range->at(number) : axis.values(static_cast<int>(number));
}

double BlockPoints::result_of(Formula& formula) {
  inputs_.clear();
  for (const std::size_t input : formula.inputs) {
    inputs_.push_back(input < values_.size() ? values_[input] : constants_[input - values_.size()]);
  }
  return formula.expression.value_at(inputs_);
}

bool BlockPoints::is_left_in() {
  if (!filter_) {
    return true;
  }
  const double value = filter_value();
  return !std::isnan(value) && value != 0.0;
}

double BlockPoints::filter_value() {
  if (!filter_value_) {
    filter_value_ = result_of(*filter_);
  }
  return *filter_value_;
}

solver::ModelParameters BlockPoints::model() const {
  solver::ModelParameters model = base_;
  for (const bool are_single : {false, true}) {  // `links` and `length` first
    for (std::size_t i = keys_.size(); i-- > 0;) {
      const solver::ParameterKey& key = key_numbered(keys_[i]);
      if (!is_point_key(keys_[i]) && link_of_key(keys_[i]).has_value() == are_single &&
          std::isfinite(values_[i]) && key.is_allowed(values_[i])) {
        key.set(model, values_[i]);
      }
    }
  }
  return model;
}

std::string BlockPoints::fault() {
  if (filter_) {
    const double value = filter_value();
    if (std::isnan(value)) {
      return fmt::format("where has no value: {}", values_in_words());
    }
    if (value == 0.0) {
      return {};
    }
  }
  try {
    for (const Formula& formula : formulas_) {
      solver::check_value(key_numbered(keys_[formula.axis]), values_[formula.axis]);
    }
    const std::size_t first = values_.size() - kPointKeyOrder.size();
    solver::validate_point(model(), values_[first], values_[first + 1], values_[first + 2]);
  } catch (const InputError& fault) {
    return fmt::format("{}: {}", fault.what(), values_in_words());
  }
  return {};
}

/// "k = 1e7, H = 0.3, mu = 0.1, e = 1"
std::string BlockPoints::values_in_words() const {
  std::string words;
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    words += fmt::format("{}{} = {}", words.empty() ? "" : ", ", key_numbered(keys_[i]).name,
                         exact_number(values_[i]));
  }
  return words;
}

}  // namespace oblique::protocol
