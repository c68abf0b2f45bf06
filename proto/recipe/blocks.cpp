#include "proto/recipe/blocks.h"

#include <algorithm>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/keys.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {

std::span<const Axis* const> model_axes(const Block& block) {
  return {block.axes().data(), static_cast<std::size_t>(block.axes_size()) - kPointKeyOrder.size()};
}

std::span<const Axis* const> point_axes(const Block& block) {
  return {block.axes().data() + block.axes_size() - kPointKeyOrder.size(), kPointKeyOrder.size()};
}

void throw_too_many_points() {
  throw solver::InputError(fmt::format(
      "the study has more than {} points, the most that are allowed: shorten an axis", kMaxPoints));
}

std::uint64_t checked_product(std::uint64_t a, std::uint64_t b) {
  if (a > kMaxPoints / b) {
    throw_too_many_points();
  }
  return a * b;
}

std::uint64_t combinations(std::span<const Axis* const> axes) {
  std::uint64_t count = 1;
  for (const Axis* axis : axes) {
    count = checked_product(count, axis_size(*axis));
  }
  return count;
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

}  // namespace oblique::protocol
