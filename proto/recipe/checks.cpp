#include "proto/recipe/checks.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/sampling.h"
#include "proto/text.h"
#include "proto/wire/frame_scan.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::InputError;
using solver::ParameterKey;

/// Most bytes of a recipe, so that the frame that brings it to a worker has room for other fields.
constexpr std::size_t kLongestRecipe = kMaxFrameBytes - 1024;

/// Unless `is_met`, throws InputError for `key` with `sentence`, formatted with the key and the
/// arguments.
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
  // In a zip a measured value may occur twice.
  require(twice == values.end() || kind == BlockKind::kZip,
          "{} has {} twice: every value of a list must differ", key.name,
          twice == values.end() ? 0.0 : *twice);
}

/// Whether the key takes only whole numbers, given that it takes `from` and values up to `to`.
bool takes_whole_numbers(const ParameterKey& key, double from, double to) {
  return !key.is_allowed(from + std::min(0.25, 0.5 * (to - from)));
}

void check_positive(const ParameterKey& key, double from) {
  require(from > 0.0, "{} from {} is not allowed: the logarithm needs ends above 0", key.name,
          from);
}

void check_range(const ParameterKey& key, const Axis& axis) {
  check_ends(key, axis.from(), axis.to());
  require(axis.count() > 1 || axis.from() == axis.to(),
          "{}: count = 1 is not allowed with two different ends, {} and {}: a range holds both "
          "ends; give 2 or more, or the value alone",
          key.name, axis.from(), axis.to());
  require(axis.count() == 1 || axis.from() != axis.to(),
          "{}: count = {} is not allowed with equal ends, {}: every value would be the same; give "
          "the value alone",
          key.name, axis.count(), axis.from());
  const RangeValues values(axis);
  if (axis.spacing() == SPACING_LOGARITHMIC) {
    check_positive(key, axis.from());
    // Few sequences of whole numbers have equal ratios, so this soon finds a value that is not
    // allowed.
    const bool takes_whole = takes_whole_numbers(key, axis.from(), axis.to());
    for (std::uint64_t i = 0; takes_whole && i < axis.count(); ++i) {
      solver::check_value(key, values.at(i));
    }
    return;
  }
  // A key takes an interval or its whole numbers. If the second value is whole, all are.
  solver::check_value(key, values.at(std::min<std::uint64_t>(1, axis.count() - 1)));
}

void check_distribution_end(const ParameterKey& key, std::string_view name, bool is_given,
                            double given, double bound) {
  if (is_given) {
    require(std::isfinite(given), "{} = {} is not allowed: the ends of a distribution are numbers",
            key.name, given);
    solver::check_value(key, given);
  } else {
    require(
        key.is_allowed(std::copysign(std::numeric_limits<double>::max(), bound)),
        "{}: a normal distribution without `{}` has values that are not allowed, for {} must be "
        "{}: cut it off with `{}`",
        key.name, name, key.name, key.allowed, name);
  }
}

void check_distribution(const ParameterKey& key, const Axis& axis) {
  const Distribution& drawn = axis.distribution();
  const bool is_normal = drawn.kind() == DISTRIBUTION_NORMAL;
  require(DistributionKind_IsValid(drawn.kind()), "{}: the kind of its distribution is unknown",
          key.name);
  require(is_normal || (drawn.has_from() && drawn.has_to()),
          "{}: `{}` is missing: a uniform distribution has two ends", key.name,
          drawn.has_from() ? "to" : "from");
  const double from = smallest_value(axis);
  const double to = largest_value(axis);
  check_distribution_end(key, "from", drawn.has_from(), drawn.from(), from);
  check_distribution_end(key, "to", drawn.has_to(), drawn.to(), to);
  require(
      from < to,
      "{} from {} to {}: a distribution must rise; swap `from` and `to`, or give a single value "
      "alone",
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
    require(sampling::Quantiles(axis).part_left() >= sampling::Quantiles::kLeastPart,
            "{}: from {} to {} nothing is left of a normal distribution of mean {} and sd {}",
            key.name, from, to, drawn.mean(), drawn.sd());
  }
}

/// Throws unless the axis has at most one kind of values, and nothing that belongs to another.
void check_kind(const ParameterKey& key, const Axis& axis, BlockKind kind) {
  const int kinds = (axis.values().empty() ? 0 : 1) + (axis.count() > 0 ? 1 : 0) +
                    (axis.has_distribution() ? 1 : 0) + (axis.expression().empty() ? 0 : 1);
  require(kinds < 2,
          "{} has values of several kinds: give a list, a range, a distribution or an "
          "expression",
          key.name);
  require(Spacing_IsValid(axis.spacing()) && (axis.count() > 0 || axis.spacing() == SPACING_LINEAR),
          "{}: its spacing is unknown, or there is no range", key.name);
  require(!axis.has_distribution() || kind == BlockKind::kSample,
          "{} has a distribution: only a sample draws from one; give the block `sample`", key.name);
}

void check_values(const ParameterKey& key, const Axis& axis, BlockKind kind) {
  check_kind(key, axis, kind);
  if (axis.count() > 0) {
    check_range(key, axis);
  } else if (axis.has_distribution()) {
    check_distribution(key, axis);
  } else if (axis.expression().empty()) {
    check_list(key, axis, kind);
  }
}

/// Checks each axis alone, and that a block has each key once, and H, mu and e last.
void check_axes(const Block& block) {
  std::bitset<128> keys;
  for (const Axis& axis : block.axes()) {
    const std::size_t number = key_number(axis.key());
    require(!keys.test(number), "{} appears twice: an axis is given once in a block", axis.key());
    keys.set(number);
    check_values(key_numbered(number), axis, block_kind(block));
  }
  for (const auto& key : solver::point_keys()) {
    if (!keys.test(key_number(key.name))) {
      throw InputError(key.name,
                       fmt::format("{0} is missing: every block needs H, mu and e ({0}: {1}, {2})",
                                   key.name, key.meaning, key.allowed));
    }
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
            "{} is not allowed: it is the length of link {}, and the model has {} of them",
            axis->key(), link.value_or(0) + 1, links);
  }
}

void check_zip(const Block& block) {
  const std::uint64_t points = points_of_block(block);
  for (const Axis& axis : block.axes()) {
    const std::uint64_t size = axis_size(axis);
    require(size == 1 || size == points,
            "{} has {} values and another axis {}: axes side by side have as many each, or one "
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
          "{}: there is nothing to draw, for every axis has one value: give one from and to", kKey);
  require(sample.kind() != SAMPLE_SOBOL || drawn <= sampling::kSobolDimensions,
          "{}: {} axes are drawn, and Sobol's sequence has {} dimensions: take lhs or random", kKey,
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
    return true;  // the point with the largest H may not be that with the shortest finger
  }
}

void check_ends(const ParameterKey& key, double from, double to) {
  solver::check_value(key, from);
  solver::check_value(key, to);
  require(from <= to, "{} from {} to {} is reversed: a range must rise; swap `from` and `to`",
          key.name, from, to);
}

void check_block(const solver::ModelParameters& model, const Block& block) {
  check_axes(block);
  if (block.has_sample()) {
    check_sample(block);
  } else if (block.zip()) {
    check_zip(block);
  }
  check_single_lengths(model, block);
  if (!is_judged_by_points(model, block)) {
    check_reach(model, block);
  }
}

void check_size(const Recipe& recipe) {
  const std::size_t bytes = recipe.ByteSizeLong();
  if (bytes > kLongestRecipe) {
    throw InputError(fmt::format(
        "the recipe has {} bytes, more than the {} that a worker can be sent: write long lists of "
        "values as ranges, or long columns of a CSV file as several studies; a value that is "
        "listed takes 8 bytes",
        bytes, kLongestRecipe));
  }
}

bool parse_recipe(std::string_view bytes, Recipe& recipe) {
  return bytes.size() <= kLongestRecipe && is_of_a_recipes_shape(bytes) &&
         recipe.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

}  // namespace oblique::protocol
