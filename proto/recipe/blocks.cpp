#include "proto/recipe/blocks.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/keys.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {

BlockKind block_kind(const Block& block) {
  if (block.has_sample()) {
    return BlockKind::kSample;
  }
  return block.zip() ? BlockKind::kZip : BlockKind::kProduct;
}

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

std::uint64_t combinations(std::span<const Axis* const> axes) {
  std::uint64_t count = 1;
  for (const Axis* axis : axes) {
    if (axis_size(*axis) > kMaxPoints / count) {
      throw_too_many_points();
    }
    count *= axis_size(*axis);
  }
  return count;
}

std::uint64_t points_of_block(const Block& block) {
  if (block_kind(block) == BlockKind::kProduct) {
    return combinations({block.axes().data(), static_cast<std::size_t>(block.axes_size())});
  }
  std::uint64_t points = block.sample().count();
  for (const Axis& axis : block.axes()) {
    points = block.zip() ? std::max(points, axis_size(axis)) : points;
  }
  if (points > kMaxPoints) {
    throw_too_many_points();
  }
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

bool is_plain_product(const Block& block) {
  return block_kind(block) == BlockKind::kProduct && block.where().empty() &&
         std::all_of(block.axes().begin(), block.axes().end(), has_own_values);
}

solver::ModelParameters shortest_model(solver::ModelParameters model, const Block& block) {
  for (const bool are_single : {false, true}) {  // `links` and `length` first
    for (const Axis* axis : model_axes(block)) {
      const std::size_t number = key_number(axis->key());
      if (axis->expression().empty() && link_of_key(number).has_value() == are_single) {
        key_numbered(number).set(model, smallest_value(*axis));
      }
    }
  }
  return model;
}

std::optional<double> surely_reached_m(const solver::ModelParameters& model, const Block& block) {
  const auto shortest = shortest_model(model, block).lengths_m;
  const double reached_m = kSurelyReached * std::accumulate(shortest.begin(), shortest.end(), 0.0);
  const Axis& H = *point_axes(block)[0];
  const bool is_below = H.expression().empty() && largest_value(H) <= reached_m;
  return is_below ? std::nullopt : std::optional(reached_m);
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
