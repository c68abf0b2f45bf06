#include "proto/recipe/checks.h"

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/keys.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::exact_number;
using solver::InputError;

/// Which keys a block has, by `key_number`.
using KeySet = std::bitset<32>;

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

void check_listed_axis(const solver::ParameterKey& key, const Axis& axis) {
  if (axis.values().empty()) {
    throw InputError(fmt::format("{} = [] has no values: give at least one", key.name));
  }
  for (const double value : axis.values()) {
    solver::check_value(key, value);
  }
  check_repetition(key, axis);
}

void check_range_axis(const solver::ParameterKey& key, const Axis& axis) {
  if (!axis.values().empty()) {
    throw InputError(
        fmt::format("{} has both listed values and a range: give one of them", key.name));
  }
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
  for (const std::uint64_t i : deciding_values(axis)) {
    solver::check_value(key, axis_value(axis, i));
  }
}

void check_values(const solver::ParameterKey& key, const Axis& axis) {
  if (axis.count() == 0) {
    check_listed_axis(key, axis);
  } else {
    check_range_axis(key, axis);
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
    check_values(key_numbered(number), axis);
  }
  return seen;
}

/// Checks the keys of a block together: H, mu and e there, and last in that order.
void check_order(const Block& block, const KeySet& seen) {
  std::size_t number = solver::model_keys().size();
  for (const auto& key : solver::point_keys()) {
    if (!seen.test(number++)) {
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

/// The shortest finger of the block must be as long as its largest H. Length grows with both keys
/// that set it, so their least values make the shortest finger.
void check_length(solver::ModelParameters model, const Block& block) {
  for (const Axis* axis : model_axes(block)) {
    solver::find_model_key(axis->key())->set(model, smallest_value(*axis));
  }
  const auto axes = point_axes(block);
  solver::validate_point(model, largest_value(*axes[0]), largest_value(*axes[1]),
                         largest_value(*axes[2]));
}

}  // namespace

void check_ends(const solver::ParameterKey& key, double from, double to) {
  solver::check_value(key, from);
  solver::check_value(key, to);
  if (from > to) {
    throw InputError(
        fmt::format("{} from {} to {} is reversed: a range must rise; swap `from` and `to`",
                    key.name, exact_number(from), exact_number(to)));
  }
}

void check_axis(const Axis& axis) {
  check_values(axis_key(axis.key()), axis);
}

void check_block(const solver::ModelParameters& model, const Block& block) {
  check_order(block, check_axes(block));
  check_length(model, block);
}

void check_size(const Recipe& recipe) {
  // Room for what goes around a recipe on its way to a worker.
  constexpr std::size_t kLongest = kMaxFrameBytes - 1024;
  if (const std::size_t bytes = recipe.ByteSizeLong(); bytes > kLongest) {
    throw InputError(
        fmt::format("the recipe has {} bytes, more than the {} that a worker can be sent: write "
                    "long lists of values as ranges",
                    bytes, kLongest));
  }
}

}  // namespace oblique::protocol
