#include "proto/recipe/blocks.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/sampling.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::InputError;
using solver::ParameterKey;

template <std::size_t link>
ParameterKey length_key() {
  static const std::string name = fmt::format("length{}", link + 1);
  return {name,
          "m",
          "length of one link, counted from the pin",
          "> 0",
          [](double value) { return value > 0.0; },
          [](const solver::ModelParameters& m) {
            return link < m.lengths_m.size() ? m.lengths_m[link] : 0.0;
          },
          [](solver::ModelParameters& m, double value) {
            if (link < m.lengths_m.size()) {
              m.lengths_m[link] = value;
            }
          }};
}

const std::vector<ParameterKey>& all_keys() {
  static const auto keys = []<std::size_t... links>(std::index_sequence<links...>) {
    const auto model = solver::model_keys();
    std::vector<ParameterKey> all(model.begin(), model.end());
    (all.push_back(length_key<links>()), ...);
    all.insert(all.end(), solver::point_keys().begin(), solver::point_keys().end());
    return all;
  }
  (std::make_index_sequence<kMaxLinks>());
  return keys;
}

std::optional<std::size_t> find_key_number(std::string_view name) {
  const auto& keys = all_keys();
  const auto found =
      std::find_if(keys.begin(), keys.end(), [&](const auto& key) { return key.name == name; });
  return found == keys.end() ? std::nullopt
                             : std::optional(static_cast<std::size_t>(found - keys.begin()));
}

}  // namespace

const ParameterKey& key_numbered(std::size_t number) {
  return all_keys().at(number);
}

std::size_t key_number(std::string_view name) {
  if (const auto number = find_key_number(name)) {
    return *number;
  }
  if (name == "preset" || name == "lengths") {
    throw InputError(name,
                     fmt::format("{} cannot be an axis of a block: it belongs to [model]", name));
  }
  std::vector<std::string_view> known;
  for (const auto& key : solver::model_keys()) {
    known.push_back(key.name);
  }
  known.insert(known.end(), {"length1", "length2", "length3", "..."});
  known.insert(known.end(), kPointKeyOrder.begin(), kPointKeyOrder.end());
  throw InputError(name,
                   fmt::format("{}: the keys are {}", unknown_key(name, known), joined(known)));
}

const ParameterKey& axis_key(std::string_view name) {
  return key_numbered(key_number(name));
}

bool is_axis_key(std::string_view name) {
  return find_key_number(name).has_value();
}

bool is_point_key(std::size_t number) {
  return number >= solver::model_keys().size() + kMaxLinks;
}

std::optional<std::size_t> link_of_key(std::size_t number) {
  const std::size_t first = solver::model_keys().size();
  return number >= first && !is_point_key(number) ? std::optional(number - first) : std::nullopt;
}

bool has_own_values(const Axis& axis) {
  return axis.count() > 0 || axis.values_size() > 0;
}

std::uint64_t axis_size(const Axis& axis) {
  const bool is_single = axis.has_distribution() || !axis.expression().empty();
  return axis.count() > 0 ? axis.count()
         : is_single      ? 1
                          : static_cast<std::uint64_t>(axis.values_size());
}

RangeValues::RangeValues(const Axis& axis)
    : from_(axis.from()),
      to_(axis.to()),
      last_(axis.count() - 1),
      is_logarithmic_(axis.spacing() == SPACING_LOGARITHMIC) {
  constexpr double kExactBelow = 0x1p53;
  constexpr double kLargestExactPower = 1e22;
  const auto last = static_cast<double>(last_);
  for (double per_unit = 1.0; !is_logarithmic_ && last_ > 0 && per_unit <= kLargestExactPower;
       per_unit *= 10.0) {
    const double first = std::round(from_ * per_unit);
    const double end = std::round(to_ * per_unit);
    if (!(std::abs(first) < kExactBelow && std::abs(end) < kExactBelow && last < kExactBelow)) {
      break;
    }
    // If `per_unit` times the ends and the step are whole numbers, each value is a quotient of
    // whole numbers: the double nearest to its decimal. For example, 0.1:1:10 contains 0.3.
    if (first / per_unit == from_ && end / per_unit == to_ && std::fmod(end - first, last) == 0.0) {
      decimals_ = {first, (end - first) / last, per_unit};
      break;
    }
  }
}

double RangeValues::at(std::uint64_t i) const {
  if (i == 0 || i == last_) {
    return i == 0 ? from_ : to_;
  }
  if (decimals_) {
    return (decimals_->first + decimals_->step * static_cast<double>(i)) / decimals_->per_unit;
  }
  const auto part = static_cast<long double>(i);
  const auto last = static_cast<long double>(last_);
  const auto from = static_cast<long double>(from_);
  const auto to = static_cast<long double>(to_);
  const long double value = is_logarithmic_ ? from * std::pow(to / from, part / last)
                                            : (from * (last - part) + to * part) / last;
  return std::min(std::max(static_cast<double>(value), from_), to_);
}

double axis_value(const Axis& axis, std::uint64_t i) {
  if (!has_own_values(axis) || i >= axis_size(axis)) {
    throw std::out_of_range("axis " + axis.key() + " has no value " + std::to_string(i));
  }
  return axis.count() == 0 ? axis.values(static_cast<int>(i)) : RangeValues(axis).at(i);
}

double smallest_value(const Axis& axis) {
  if (axis.has_distribution()) {
    const Distribution& drawn = axis.distribution();
    return drawn.has_from() ? drawn.from() : -std::numeric_limits<double>::infinity();
  }
  const auto& values = axis.values();
  return axis.count() > 0 ? axis.from() : *std::min_element(values.begin(), values.end());
}

double largest_value(const Axis& axis) {
  if (axis.has_distribution()) {
    const Distribution& drawn = axis.distribution();
    return drawn.has_to() ? drawn.to() : std::numeric_limits<double>::infinity();
  }
  const auto& values = axis.values();
  return axis.count() > 0 ? axis.to() : *std::max_element(values.begin(), values.end());
}

BlockKind block_kind(const Block& block) {
  return block.has_sample() ? BlockKind::kSample
         : block.zip()      ? BlockKind::kZip
                            : BlockKind::kProduct;
}

std::span<const Axis* const> model_axes(const Block& block) {
  return {block.axes().data(), static_cast<std::size_t>(block.axes_size()) - kPointKeyOrder.size()};
}

std::span<const Axis* const> point_axes(const Block& block) {
  return {block.axes().data() + block.axes_size() - kPointKeyOrder.size(), kPointKeyOrder.size()};
}

void check_point_count(std::uint64_t points) {
  if (points > kMaxPoints) {
    throw InputError(
        fmt::format("the study has more than {} points, the maximum: shorten an axis", kMaxPoints));
  }
}

std::uint64_t points_of_block(const Block& block) {
  const BlockKind kind = block_kind(block);
  std::uint64_t points = kind == BlockKind::kSample ? block.sample().count() : 1;
  for (const Axis& axis : block.axes()) {
    const std::uint64_t size = axis_size(axis);
    if (kind == BlockKind::kZip) {
      points = std::max(points, size);
    } else if (kind == BlockKind::kProduct) {
      points = size > kMaxPoints / points ? kMaxPoints + 1 : points * size;
    }
  }
  check_point_count(points);
  return points;
}

std::vector<AxisLayout> layout_of(const Block& block) {
  const BlockKind kind = block_kind(block);
  std::vector<AxisLayout> layout;
  for (const Axis& axis : block.axes()) {
    layout.push_back({&axis, key_number(axis.key()), axis_size(axis), 1});
    if (kind == BlockKind::kSample && is_drawn(axis)) {
      layout.back().values = 0;
    }
  }
  if (kind == BlockKind::kProduct) {
    for (std::size_t i = layout.size(); i-- > 1;) {
      layout[i - 1].stride = layout[i].stride * layout[i].values;
    }
  }
  return layout;
}

bool is_drawn(const Axis& axis) {
  return axis.has_distribution() || axis_size(axis) > 1;
}

solver::ModelParameters shortest_model(solver::ModelParameters model, const Block& block) {
  // `links` and `length` are set before the lengths of single links
  for (const bool are_single : {false, true}) {
    for (const Axis* axis : model_axes(block)) {
      const std::size_t number = key_number(axis->key());
      if (axis->expression().empty() && link_of_key(number).has_value() == are_single) {
        key_numbered(number).set(model, smallest_value(*axis));
      }
    }
  }
  return model;
}

std::vector<const Axis*> fall_axes(solver::ModelParameters model, const Block& block) {
  std::vector<const Axis*> found;
  for (const Axis* axis : model_axes(block)) {  // the integrator comes before its parameter
    const solver::ParameterKey& key = axis_key(axis->key());
    if (key.name == "integrator" && has_own_values(*axis)) {
      key.set(model, largest_value(*axis));
    }
    if (solver::changes_fall(key, model)) {
      found.push_back(axis);
    }
  }
  return found;
}

Block block_of(std::vector<Axis> axes) {
  std::stable_sort(axes.begin(), axes.end(), [](const Axis& a, const Axis& b) {
    return key_number(a.key()) < key_number(b.key());
  });
  Block block;
  for (auto& axis : axes) {
    *block.add_axes() = std::move(axis);
  }
  return block;
}

namespace {

/// If `is_met` is false, throws InputError for `key` with `sentence`, which is formatted with the
/// key and the arguments.
template <typename... Arguments>
void require(bool is_met, std::string_view sentence, std::string_view key,
             const Arguments&... arguments) {
  [[maybe_unused]] const auto readable = [](const auto& argument) {
    if constexpr (std::is_same_v<std::decay_t<decltype(argument)>, double>) {
      return solver::exact_number(argument);
    } else {
      return argument;
    }
  };
  if (!is_met) {
    throw InputError(key, fmt::format(fmt::runtime(sentence), key, readable(arguments)...));
  }
}

void check_list(const ParameterKey& key, const Axis& axis, BlockKind kind) {
  require(!axis.values().empty(), "{} = [] has no values: give at least one", key.name);
  for (const double value : axis.values()) {
    solver::check_value(key, value);
  }
  std::vector<double> values(axis.values().begin(), axis.values().end());
  std::sort(values.begin(), values.end());
  const auto twice = std::adjacent_find(values.begin(), values.end());
  // A zip may contain a value twice, for example in a list of measurements.
  require(twice == values.end() || kind == BlockKind::kZip,
          "{} has {} twice: the values of a list must differ", key.name,
          twice == values.end() ? 0.0 : *twice);
}

/// Returns whether the key takes only whole numbers. Its domain must include [from, to].
bool takes_whole_numbers(const ParameterKey& key, double from, double to) {
  return !key.is_allowed(from + std::min(0.25, 0.5 * (to - from)));
}

void check_positive(const ParameterKey& key, double from) {
  require(from > 0.0, "{} from {} is not allowed: logarithmic ends must be > 0", key.name, from);
}

void check_range(const ParameterKey& key, const Axis& axis) {
  check_ends(key, axis.from(), axis.to());
  require(axis.count() > 1 || axis.from() == axis.to(),
          "{}: count = 1 is not allowed with different ends {} and {}: a range contains both "
          "ends; give count >= 2, or a single value",
          key.name, axis.from(), axis.to());
  require(axis.count() == 1 || axis.from() != axis.to(),
          "{}: count = {} is not allowed with equal ends {}: all values would be the same; give "
          "a single value",
          key.name, axis.count(), axis.from());
  const double largest = std::max(std::abs(axis.from()), std::abs(axis.to()));
  const double size = axis.spacing() == SPACING_LOGARITHMIC ? axis.from() : largest;
  require(axis.count() == 1 || axis.count() > kMaxPoints ||
              (axis.to() - axis.from()) / static_cast<double>(axis.count() - 1) > 0x1p-51 * size,
          "{}: count = {} is not allowed from {} to {}: some of the values would be equal",
          key.name, axis.count(), axis.from(), axis.to());
  const RangeValues values(axis);
  if (axis.spacing() == SPACING_LOGARITHMIC) {
    check_positive(key, axis.from());
    // Few ranges with a constant ratio contain only whole numbers, so the loop soon finds a wrong
    // value.
    const bool takes_whole = takes_whole_numbers(key, axis.from(), axis.to());
    for (std::uint64_t i = 0; takes_whole && i < axis.count(); ++i) {
      solver::check_value(key, values.at(i));
    }
    return;
  }
  // A key allows all numbers of an interval, or only the whole ones. So if the ends and the second
  // value are allowed, all values are.
  solver::check_value(key, values.at(std::min<std::uint64_t>(1, axis.count() - 1)));
}

void check_distribution_end(const ParameterKey& key, std::string_view name, bool is_given,
                            double given, double bound) {
  if (is_given) {
    solver::check_value(key, given);
  } else {
    require(key.is_allowed(std::copysign(std::numeric_limits<double>::max(), bound)),
            "{}: a normal distribution without `{}` has values that are not allowed, because {} "
            "must be "
            "{}: truncate it with `{}`",
            key.name, name, key.name, key.allowed, name);
  }
}

void check_distribution(const ParameterKey& key, const Axis& axis) {
  const Distribution& drawn = axis.distribution();
  const bool is_normal = drawn.kind() == DISTRIBUTION_NORMAL;
  require(DistributionKind_IsValid(drawn.kind()), "{}: the kind of its distribution is unknown",
          key.name);
  require(is_normal || (drawn.has_from() && drawn.has_to()),
          "{}: `{}` is missing: a uniform distribution needs both ends", key.name,
          drawn.has_from() ? "to" : "from");
  const double from = smallest_value(axis);
  const double to = largest_value(axis);
  check_distribution_end(key, "from", drawn.has_from(), drawn.from(), from);
  check_distribution_end(key, "to", drawn.has_to(), drawn.to(), to);
  require(from < to,
          "{} from {} to {}: `from` must be below `to`; swap them, or give a single value",
          key.name, from, to);
  require(!takes_whole_numbers(key, from, to), "{} must be {}: list the values to draw from",
          key.name, key.allowed);
  if (drawn.kind() == DISTRIBUTION_LOG_UNIFORM) {
    check_positive(key, from);
  }
  if (is_normal) {
    require(std::isfinite(drawn.mean()), "{}: mean = {} is not allowed: mean must be a number",
            key.name, drawn.mean());
    require(std::isfinite(drawn.sd()) && drawn.sd() > 0.0,
            "{}: sd = {} is not allowed: sd must be > 0", key.name, drawn.sd());
    require(std::isnormal(sampling::Quantiles(axis).part_left()),
            "{0}: a normal distribution of mean {3} and sd {4} has no values from {1} to {2}",
            key.name, from, to, drawn.mean(), drawn.sd());
  }
}

/// Checks that the axis has exactly one kind of values, and checks the values.
void check_values(const ParameterKey& key, const Axis& axis, BlockKind kind) {
  const std::array kinds{!axis.values().empty(), axis.count() > 0, axis.has_distribution(),
                         !axis.expression().empty()};
  require(std::count(kinds.begin(), kinds.end(), true) < 2,
          "{} has values of several kinds: give a list, a range, a distribution or an "
          "expression",
          key.name);
  require(Spacing_IsValid(axis.spacing()) && (axis.count() > 0 || axis.spacing() == SPACING_LINEAR),
          "{}: its spacing is unknown, or it has a spacing but no range", key.name);
  require(!axis.has_distribution() || kind == BlockKind::kSample,
          "{} has a distribution: only a sample draws from one; give the block `sample`", key.name);
  if (axis.count() > 0) {
    check_range(key, axis);
  } else if (axis.has_distribution()) {
    check_distribution(key, axis);
  } else if (axis.expression().empty()) {
    check_list(key, axis, kind);
  }
}

/// Checks each axis, and that the block has each key once, with H, mu and e at the end.
void check_axes(const Block& block) {
  std::bitset<128> keys;
  for (const Axis& axis : block.axes()) {
    const std::size_t number = key_number(axis.key());
    require(!keys.test(number), "{} appears twice: a block has each axis once", axis.key());
    keys.set(number);
    check_values(key_numbered(number), axis, block_kind(block));
  }
  for (const auto& key : solver::point_keys()) {
    require(keys.test(key_number(key.name)),
            "{0} is missing: every block needs H, mu and e ({0}: {1}, {2})", key.name, key.meaning,
            key.allowed);
  }
  const auto last = point_axes(block);
  for (std::size_t i = 0; i < last.size(); ++i) {
    require(last[i]->key() == kPointKeyOrder[i],
            "axis {} is out of order: model keys come first, then H, mu and e", last[i]->key());
  }
}

void check_single_lengths(const solver::ModelParameters& model, const Block& block) {
  const std::size_t links = shortest_model(model, block).lengths_m.size();
  for (const Axis* axis : model_axes(block)) {
    const auto link = link_of_key(key_number(axis->key()));
    require(!link || *link < links,
            "{} is not allowed: it is the length of link {}, and the model has {} links",
            axis->key(), link.value_or(0) + 1, links);
  }
}

void check_zip(const Block& block) {
  const std::uint64_t points = points_of_block(block);
  for (const Axis& axis : block.axes()) {
    const std::uint64_t size = axis_size(axis);
    require(
        size == 1 || size == points,
        "{} has {} values and another axis {}: with `zip` all axes have the same number, or one "
        "value",
        axis.key(), size, points);
  }
}

void check_sample(const Block& block) {
  const Sample& sample = block.sample();
  constexpr std::uint64_t kLargestSeed = std::numeric_limits<std::int64_t>::max();
  constexpr std::string_view kKey = "sample";
  require(!block.zip(), "a block has both `zip` and `{}`: give one of them", kKey);
  require(SampleKind_IsValid(sample.kind()), "{}: its kind is unknown", kKey);
  require(sample.seed() <= kLargestSeed,
          "{}: seed = {} is not allowed: it must be at most {}, the largest in a study file", kKey,
          sample.seed(), kLargestSeed);
  require(sample.count() > 0, "{}: count = 0 is not allowed: count must be at least 1", kKey);
  const auto drawn = std::count_if(block.axes().begin(), block.axes().end(), is_drawn);
  require(drawn > 0,
          "{}: there is nothing to draw because every axis has one value: give one `from` and `to`",
          kKey);
  require(sample.kind() != SAMPLE_SOBOL || drawn <= sampling::kSobolDimensions,
          "{}: {} axes are drawn, and Sobol's sequence has {} dimensions: use lhs or random", kKey,
          drawn, sampling::kSobolDimensions);
}

void check_reach(const solver::ModelParameters& model, const Block& block) {
  const auto axes = point_axes(block);
  const auto largest = [&](std::size_t i) {
    return axes[i]->expression().empty() ? largest_value(*axes[i]) : 1.0;
  };
  solver::validate_point(shortest_model(model, block), largest(0), largest(1), largest(2));
}

}  // namespace

bool needs_point_validation(const solver::ModelParameters& model, const Block& block) {
  const bool has_expressions = std::any_of(block.axes().begin(), block.axes().end(),
                                           [](const Axis& a) { return !a.expression().empty(); });
  if (has_expressions || !block.where().empty()) {
    return true;
  }
  if (block_kind(block) == BlockKind::kProduct) {
    return false;
  }
  try {
    check_reach(model, block);
    return false;
  } catch (const InputError&) {
    return true;  // points with the largest H may have longer fingers than the shortest
  }
}

void check_block(const solver::ModelParameters& model, const Block& block) {
  check_axes(block);
  if (block.has_sample()) {
    check_sample(block);
  } else if (block.zip()) {
    check_zip(block);
  }
  check_single_lengths(model, block);
  if (!needs_point_validation(model, block)) {
    check_reach(model, block);
  }
}

void check_ends(const ParameterKey& key, double from, double to) {
  solver::check_value(key, from);
  solver::check_value(key, to);
  require(from <= to, "{} from {} to {} is reversed: swap `from` and `to`", key.name, from, to);
}

}  // namespace oblique::protocol
