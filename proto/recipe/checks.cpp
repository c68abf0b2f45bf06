#include "proto/recipe/checks.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/axes.h"
#include "proto/recipe/block_points.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/expressions/expression_text.h"
#include "proto/recipe/keys.h"
#include "proto/wire/frame_scan.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::exact_number;
using solver::InputError;

/// Most bytes of a recipe: with room for what goes around it on its way to a worker.
constexpr std::size_t kLongestRecipe = kMaxFrameBytes - 1024;

/// Which keys a block has, by `key_number`.
using KeySet = std::bitset<128>;

/// Costs one pass over values that rise or fall, and a sort of others.
void check_repetition(const solver::ParameterKey& key, const Axis& axis) {
  const auto& values = axis.values();
  if (std::adjacent_find(values.begin(), values.end(), std::greater_equal<>()) == values.end() ||
      std::adjacent_find(values.begin(), values.end(), std::less_equal<>()) == values.end()) {
    return;
  }
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) {
    throw InputError(fmt::format("{} has {} twice: every value of a list must differ", key.name,
                                 exact_number(*twice)));
  }
}

void check_listed_axis(const solver::ParameterKey& key, const Axis& axis, BlockKind kind) {
  if (axis.values().empty()) {
    throw InputError(fmt::format("{} = [] has no values: give at least one", key.name));
  }
  for (const double value : axis.values()) {
    solver::check_value(key, value);
  }
  if (kind != BlockKind::kZip) {  // measured values side by side may come twice
    check_repetition(key, axis);
  }
}

/// The key takes whole numbers only, where it takes `from` and what lies between it and `to`.
bool takes_whole_numbers(const solver::ParameterKey& key, double from, double to) {
  return !key.is_allowed(from + std::min(0.25, 0.5 * (to - from)));
}

/// Equal ratios from one whole number to another rarely meet others: each is looked at, up to one
/// that does not. No key takes as many whole numbers as would be many.
void check_whole_numbers(const solver::ParameterKey& key, const Axis& axis) {
  const RangeValues values(axis);
  for (std::uint64_t i = 0; i < axis.count(); ++i) {
    solver::check_value(key, values.at(i));
  }
}

/// Of the lower end of what has logarithms.
void check_positive(const solver::ParameterKey& key, double from) {
  if (!(from > 0.0)) {
    throw InputError(fmt::format("{} from {} is not allowed: the logarithm needs ends above 0",
                                 key.name, exact_number(from)));
  }
}

void check_range_axis(const solver::ParameterKey& key, const Axis& axis) {
  check_ends(key, axis.from(), axis.to());
  if (axis.count() == 1 && axis.from() != axis.to()) {
    throw InputError(
        fmt::format("{}: count = 1 is not allowed with two different ends, {} and {}: a range "
                    "holds both ends; give 2 or more, or the value alone",
                    key.name, exact_number(axis.from()), exact_number(axis.to())));
  }
  if (axis.count() > 1 && axis.from() == axis.to()) {
    throw InputError(
        fmt::format("{}: count = {} is not allowed with equal ends, {}: every value would be the "
                    "same; give the value alone",
                    key.name, axis.count(), exact_number(axis.from())));
  }
  if (axis.spacing() == SPACING_LOGARITHMIC) {
    check_positive(key, axis.from());
    if (takes_whole_numbers(key, axis.from(), axis.to())) {
      check_whole_numbers(key, axis);
    }
    return;
  }
  for (const std::uint64_t i : deciding_values(axis)) {
    solver::check_value(key, axis_value(axis, i));
  }
}

void check_distribution_end(const solver::ParameterKey& key, std::string_view end, double value) {
  if (std::isfinite(value)) {
    solver::check_value(key, value);
  } else if (!key.is_allowed(std::copysign(std::numeric_limits<double>::max(), value))) {
    throw InputError(
        fmt::format("{}: a normal distribution without `{}` has values that are not allowed, for "
                    "{} must be {}: cut it off with `{}`",
                    key.name, end, key.name, key.allowed, end));
  }
}

void check_normal(const solver::ParameterKey& key, const Distribution& drawn) {
  if (!std::isfinite(drawn.mean())) {
    throw InputError(fmt::format("{}: mean = {} is not allowed: mean must be a number", key.name,
                                 exact_number(drawn.mean())));
  }
  if (!(std::isfinite(drawn.sd()) && drawn.sd() > 0.0)) {
    throw InputError(fmt::format("{}: sd = {} is not allowed: sd must be > 0", key.name,
                                 exact_number(drawn.sd())));
  }
}

void check_distribution(const solver::ParameterKey& key, const Axis& axis) {
  const Distribution& drawn = axis.distribution();
  const bool is_normal = drawn.kind() == DISTRIBUTION_NORMAL;
  if (!DistributionKind_IsValid(drawn.kind())) {
    throw InputError(fmt::format("{}: the kind of its distribution is unknown", key.name));
  }
  if (!is_normal && !(drawn.has_from() && drawn.has_to())) {
    throw InputError(fmt::format("{}: `{}` is missing: a uniform distribution has two ends",
                                 key.name, drawn.has_from() ? "to" : "from"));
  }
  const double from = smallest_value(axis);
  const double to = largest_value(axis);
  check_distribution_end(key, "from", drawn.has_from() ? drawn.from() : from);
  check_distribution_end(key, "to", drawn.has_to() ? drawn.to() : to);
  for (const double given : {drawn.from(), drawn.to()}) {
    if (!std::isfinite(given)) {
      throw InputError(fmt::format("{} = {} is not allowed: the ends of a distribution are numbers",
                                   key.name, exact_number(given)));
    }
  }
  if (!(from < to)) {
    throw InputError(
        fmt::format("{} from {} to {}: a distribution must rise; swap `from` and "
                    "`to`, or give a single value alone",
                    key.name, exact_number(from), exact_number(to)));
  }
  if (takes_whole_numbers(key, from, to)) {
    throw InputError(
        fmt::format("{} must be {}: list the values to draw from", key.name, key.allowed));
  }
  if (drawn.kind() == DISTRIBUTION_LOG_UNIFORM) {
    check_positive(key, from);
  }
  if (is_normal) {
    check_normal(key, drawn);
    if (distribution_of(axis).part_left() < sampling::Distribution::kLeastPart) {
      throw InputError(
          fmt::format("{}: from {} to {} nothing is left of a normal distribution of mean {} and "
                      "sd {}",
                      key.name, exact_number(from), exact_number(to), exact_number(drawn.mean()),
                      exact_number(drawn.sd())));
    }
  }
}

/// Of the text and of what it names; whether it makes an expression shows in its block.
void check_expression(const Axis& axis) {
  try {
    for (const std::string& name : expressions::read_expression(axis.expression()).names) {
      key_number(name);
    }
  } catch (const InputError& fault) {
    throw InputError(
        fmt::format("{}: {}", expression_in_words(axis.key(), axis.expression()), fault.what()));
  }
}

/// Values are given in one way.
void check_one_way(const solver::ParameterKey& key, const Axis& axis) {
  const std::array<std::pair<bool, std::string_view>, 4> ways{
      {{!axis.values().empty(), "listed values"},
       {axis.count() > 0, "a range"},
       {axis.has_distribution(), "a distribution"},
       {!axis.expression().empty(), "an expression"}}};
  std::string_view first;
  for (const auto& [is_given, way] : ways) {
    if (is_given && !first.empty()) {
      throw InputError(
          fmt::format("{} has both {} and {}: give one of them", key.name, first, way));
    }
    first = is_given ? way : first;
  }
}

void check_values(const solver::ParameterKey& key, const Axis& axis, BlockKind kind) {
  check_one_way(key, axis);
  if (!Spacing_IsValid(axis.spacing()) || (axis.count() == 0 && axis.spacing() != SPACING_LINEAR)) {
    throw InputError(
        fmt::format("{}: its spacing is unknown, or stands beside no range", key.name));
  }
  if (axis.has_distribution() && kind != BlockKind::kSample) {
    throw InputError(fmt::format(
        "{} has a distribution: only a sample draws from one; give the block `sample`", key.name));
  }
  if (axis.count() > 0) {
    check_range_axis(key, axis);
  } else if (axis.has_distribution()) {
    check_distribution(key, axis);
  } else if (!axis.expression().empty()) {
    check_expression(axis);
  } else {
    check_listed_axis(key, axis, kind);
  }
}

/// Checks each axis of a block alone and that no key is there twice. Returns which are.
KeySet check_axes(const Block& block) {
  KeySet seen;
  for (const Axis& axis : block.axes()) {
    const std::size_t number = key_number(axis.key());
    if (seen.test(number)) {
      throw InputError(axis.key() + " appears twice: an axis is given once in a block");
    }
    seen.set(number);
    check_values(key_numbered(number), axis, block_kind(block));
  }
  return seen;
}

/// Checks the keys of a block together: H, mu and e there, and last in that order.
void check_order(const Block& block, const KeySet& seen) {
  for (const auto& key : solver::point_keys()) {
    if (!seen.test(key_number(key.name))) {
      throw MissingKey(fmt::format("{} is missing: every block needs H, mu and e ({}: {}, {})",
                                   key.name, key.name, key.meaning, key.allowed));
    }
  }
  const auto last = point_axes(block);
  for (std::size_t i = 0; i < last.size(); ++i) {
    if (last[i]->key() != kPointKeyOrder[i]) {
      throw InputError("axis " + last[i]->key() +
                       " is out of order: model keys come first, then H, mu and e");
    }
  }
}

/// Every single length is that of a link.
void check_single_lengths(const solver::ModelParameters& shortest, const Block& block) {
  for (const Axis* axis : model_axes(block)) {
    const auto link = link_of_key(key_number(axis->key()));
    if (link && *link >= shortest.lengths_m.size()) {
      throw InputError(
          fmt::format("{} is not allowed: it is the length of link {}, and the model "
                      "has {} of them",
                      axis->key(), *link + 1, shortest.lengths_m.size()));
    }
  }
}

void check_zip(const Block& block) {
  const std::uint64_t points = points_of_block(block);
  for (const Axis& axis : block.axes()) {
    const std::uint64_t size = axis_size(axis);
    if (size != 1 && size != points) {
      throw InputError(
          fmt::format("{} has {} values and another axis {}: axes side by side have as many each, "
                      "or one value",
                      axis.key(), size, points));
    }
  }
}

void check_sample(const Block& block) {
  const Sample& sample = block.sample();
  if (block.zip()) {
    throw InputError("a block has both `zip` and `sample`: give one of them");
  }
  if (!SampleKind_IsValid(sample.kind())) {
    throw InputError("sample: its kind is unknown");
  }
  constexpr auto kLargestSeed =
      static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (sample.seed() > kLargestSeed) {
    throw InputError(
        fmt::format("sample: seed = {} is not allowed: it must be at most {}, which a "
                    "study file can say",
                    sample.seed(), kLargestSeed));
  }
  if (sample.count() < 1) {
    throw InputError("sample: count = 0 is not allowed: count must be at least 1");
  }
  const auto drawn =
      static_cast<std::uint32_t>(std::count_if(block.axes().begin(), block.axes().end(), is_drawn));
  if (drawn == 0) {
    throw InputError(
        "sample: there is nothing to draw, for every axis has one value: give one from and to");
  }
  if (drawn > sampling::kMostDimensions) {
    throw InputError(fmt::format("sample: {} axes are drawn; at most {} are allowed", drawn,
                                 sampling::kMostDimensions));
  }
}

void check_reach(const solver::ModelParameters& model, const Block& block) {
  const auto axes = point_axes(block);
  const auto largest = [&](std::size_t i) {
    return axes[i]->expression().empty() ? largest_value(*axes[i]) : 1.0;
  };
  solver::validate_point(shortest_model(model, block), largest(0), largest(1), largest(2));
}

}  // namespace

bool is_judged_by_points(const solver::ModelParameters& model, const Block& block) {
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
    return true;  // the largest H may be of another point than the shortest finger
  }
}

void check_ends(const solver::ParameterKey& key, double from, double to) {
  solver::check_value(key, from);
  solver::check_value(key, to);
  if (from > to) {
    throw InputError(
        fmt::format("{} from {} to {} is reversed: a range must rise; swap `from` and `to`",
                    key.name, exact_number(from), exact_number(to)));
  }
}

void check_axis(const Axis& axis, BlockKind kind) {
  check_values(axis_key(axis.key()), axis, kind);
}

void check_block(const solver::ModelParameters& model, const Block& block) {
  check_order(block, check_axes(block));
  if (block.has_sample()) {
    check_sample(block);
  } else if (block.zip()) {
    check_zip(block);
  }
  check_single_lengths(shortest_model(model, block), block);
  if (!is_judged_by_points(model, block)) {
    check_reach(model, block);
  } else {
    const BlockPoints compiles(model, block);
  }
}

void check_size(const Recipe& recipe) {
  if (const std::size_t bytes = recipe.ByteSizeLong(); bytes > kLongestRecipe) {
    throw InputError(
        fmt::format("the recipe has {} bytes, more than the {} that a worker can be sent: write "
                    "long lists of values as ranges, or long columns of a CSV file as several "
                    "studies; a value that is listed takes 8 bytes",
                    bytes, kLongestRecipe));
  }
}

bool parse_recipe(std::string_view bytes, Recipe& recipe) {
  return bytes.size() <= kLongestRecipe && is_of_a_recipes_shape(bytes) &&
         recipe.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

}  // namespace oblique::protocol
