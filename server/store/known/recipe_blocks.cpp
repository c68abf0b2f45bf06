#include "server/store/known/recipe_blocks.h"

#include <algorithm>
#include <limits>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/canonical.h"
#include "proto/recipe/model_message.h"

namespace oblique::server {

void PointBox::include(const PointBox& other) {
  for (std::size_t i = 0; i < least.size(); ++i) {
    least.at(i) = std::min(least.at(i), other.least.at(i));
    largest.at(i) = std::max(largest.at(i), other.largest.at(i));
  }
}

bool PointBox::is_apart_from(const PointBox& other) const {
  for (std::size_t i = 0; i < least.size(); ++i) {
    if (largest.at(i) < other.least.at(i) || other.largest.at(i) < least.at(i)) {
      return true;
    }
  }
  return false;
}

PointBox box_of(const protocol::Block& block) {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  PointBox box{{-kNoLimit, -kNoLimit, -kNoLimit}, {kNoLimit, kNoLimit, kNoLimit}};
  for (std::size_t i = 0; i < protocol::kPointKeyOrder.size(); ++i) {
    const protocol::Axis* axis = axis_of(block, protocol::kPointKeyOrder.at(i));
    if (axis != nullptr && protocol::has_own_values(*axis)) {
      box.least.at(i) = protocol::smallest_value(*axis);
      box.largest.at(i) = protocol::largest_value(*axis);
    }
  }
  return box;
}

PointBox box_of(const protocol::Recipe& recipe) {
  PointBox box = box_of(recipe.blocks(0));
  for (const protocol::Block& block : recipe.blocks()) {
    box.include(box_of(block));
  }
  return box;
}

const protocol::Axis* axis_of(const protocol::Block& block, std::string_view key) {
  const auto found = std::find_if(block.axes().begin(), block.axes().end(),
                                  [&](const protocol::Axis& axis) { return axis.key() == key; });
  return found == block.axes().end() ? nullptr : &*found;
}

std::vector<PlacedBlock> blocks_of(const protocol::PointTable& table) {
  std::vector<PlacedBlock> blocks;
  for (const protocol::Block& block : table.recipe().blocks()) {
    const protocol::BlockPlace& place = table.block(blocks.size());
    blocks.push_back({&table, &block, place.first_point, place.points, box_of(block)});
  }
  return blocks;
}

bool needs_look(const protocol::PointTable& table) {
  const auto& blocks = table.recipe().blocks();
  return std::any_of(blocks.begin(), blocks.end(), [](const protocol::Block& block) {
    return !block.where().empty() || block.has_sample() ||
           std::any_of(block.axes().begin(), block.axes().end(),
                       [](const protocol::Axis& axis) { return !axis.expression().empty(); });
  });
}

bool is_product(const protocol::Block& block) {
  return !block.zip() && !block.has_sample() &&
         std::all_of(block.axes().begin(), block.axes().end(), [](const protocol::Axis& axis) {
           const bool is_point_key =
               std::find(protocol::kPointKeyOrder.begin(), protocol::kPointKeyOrder.end(),
                         axis.key()) != protocol::kPointKeyOrder.end();
           // `links` and `length` change each other; neither stands alone.
           const bool stands_alone =
               is_point_key || (axis.key() != "links" && axis.key() != "length" &&
                                solver::find_model_key(axis.key()) != nullptr);
           return stands_alone && axis.expression().empty() && !axis.has_distribution();
         });
}

solver::ModelParameters base_model_of(const protocol::PointTable& table) {
  return protocol::from_message(table.recipe().model());
}

ProductInverse::ProductInverse(const PlacedBlock& block)
    : block_(block), base_(base_model_of(*block.table)) {
  for (const protocol::Axis& axis : block.block->axes()) {
    axes_.emplace_back(axis);
    sizes_.push_back(protocol::axis_size(axis));
  }
}

std::optional<std::uint64_t> ProductInverse::find(std::uint64_t model_number,
                                                  const solver::ModelParameters& model, double H_m,
                                                  double mu, double e_star) {
  if (!knows_model(model_number)) {
    model_number_ = model_number;
    model_ = find_model(model);
  }
  if (!model_) {
    return std::nullopt;
  }
  std::uint64_t point = *model_;
  std::size_t axis = axes_.size() - protocol::kPointKeyOrder.size();
  for (const double value : {H_m, mu, e_star}) {
    const auto found = axes_[axis].find(value);
    if (!found) {
      return std::nullopt;
    }
    point = point * sizes_[axis] + *found;
    ++axis;
  }
  return block_.first_point + point;
}

/// The number of the model in the block.
std::optional<std::uint64_t> ProductInverse::find_model(
    const solver::ModelParameters& model) const {
  solver::ModelParameters made = base_;
  std::uint64_t number = 0;
  for (std::size_t i = 0; i + protocol::kPointKeyOrder.size() < axes_.size(); ++i) {
    const auto& key = *solver::find_model_key(block_.block->axes(static_cast<int>(i)).key());
    const auto found = axes_[i].find(key.get(model));
    if (!found) {
      return std::nullopt;
    }
    key.set(made, key.get(model));
    number = number * sizes_[i] + *found;
  }
  return protocol::canonical_model(made) == protocol::canonical_model(model) ? std::optional(number)
                                                                             : std::nullopt;
}

}  // namespace oblique::server
