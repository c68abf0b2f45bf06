#include "proto/recipe/point_table.h"

#include <algorithm>
#include <array>
#include <span>
#include <stdexcept>
#include <string>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/model_message.h"

namespace oblique::protocol {

PointTable::PointTable(Recipe recipe) : recipe_(std::move(recipe)) {
  if (recipe_.has_model()) {
    base_model_ = from_message(recipe_.model());
  }
  if (recipe_.blocks().empty()) {
    throw solver::InputError("the study has no block: it needs at least one with H, mu and e");
  }
  blocks_.reserve(static_cast<std::size_t>(recipe_.blocks_size()));
  for (const Block& block : recipe_.blocks()) {
    try {
      check_block(base_model_, block);
      add_block(block);
    } catch (const solver::InputError& error) {
      if (recipe_.blocks_size() == 1) {
        throw;
      }
      throw solver::InputError("block " + std::to_string(blocks_.size() + 1) + ": " + error.what());
    }
  }
}

void PointTable::add_block(const Block& block) {
  const auto axes = model_axes(block);
  const std::uint64_t block_models = combinations(axes);
  const std::uint64_t block_points = checked_product(block_models, combinations(point_axes(block)));
  if (block_points > kMaxPoints - points_) {
    throw_too_many_points();
  }
  const bool is_base_model_known = axes.empty() && base_model_number_.has_value();
  const std::uint64_t first_model = is_base_model_known ? *base_model_number_ : models_;
  if (!is_base_model_known) {
    model_blocks_.push_back(blocks_.size());
    models_ += block_models;
  }
  if (axes.empty()) {
    base_model_number_ = first_model;
    add_to_base_segments(block_points);
  }
  blocks_.push_back({points_, block_points, first_model, block_models});
  points_ += block_points;
}

void PointTable::add_to_base_segments(std::uint64_t block_points) {
  const bool continues = !base_segments_.empty() &&
                         base_segments_.back().first_point + base_segments_.back().count == points_;
  if (continues) {
    base_segments_.back().count += block_points;
  } else {
    base_segments_.push_back({*base_model_number_, points_, block_points});
  }
}

std::uint64_t PointTable::size() const {
  return points_;
}

std::uint64_t PointTable::models() const {
  return models_;
}

const PointTable::BlockLayout& PointTable::layout_at(std::uint64_t point,
                                                     std::size_t& block) const {
  if (point >= size()) {
    throw std::out_of_range("the study has no point " + std::to_string(point));
  }
  const auto next = std::upper_bound(
      blocks_.begin(), blocks_.end(), point,
      [](std::uint64_t p, const BlockLayout& layout) { return p < layout.first_point; });
  block = static_cast<std::size_t>(next - blocks_.begin()) - 1;
  return blocks_[block];
}

Point PointTable::point(std::uint64_t index) const {
  std::size_t block = 0;
  const BlockLayout& layout = layout_at(index, block);
  const auto axes = point_axes(recipe_.blocks(static_cast<int>(block)));
  std::uint64_t rest = index - layout.first_point;
  std::array<double, kPointKeyOrder.size()> values{};
  for (std::size_t i = axes.size(); i-- > 0;) {
    const std::uint64_t size = axis_size(*axes[i]);
    values[i] = axis_value(*axes[i], rest % size);
    rest /= size;
  }
  return {layout.first_model + rest, values[0], values[1], values[2]};
}

solver::ModelParameters PointTable::model(std::uint64_t index) const {
  if (index >= models()) {
    throw std::out_of_range("the study has no model " + std::to_string(index));
  }
  const auto next = std::upper_bound(
      model_blocks_.begin(), model_blocks_.end(), index,
      [this](std::uint64_t m, std::size_t block) { return m < blocks_[block].first_model; });
  const std::size_t block = *(next - 1);
  const auto axes = model_axes(recipe_.blocks(static_cast<int>(block)));
  std::uint64_t rest = index - blocks_[block].first_model;
  solver::ModelParameters model = base_model_;
  for (std::size_t i = axes.size(); i-- > 0;) {
    const std::uint64_t size = axis_size(*axes[i]);
    solver::find_model_key(axes[i]->key())->set(model, axis_value(*axes[i], rest % size));
    rest /= size;
  }
  return model;
}

Segment PointTable::segment_at(std::uint64_t index) const {
  std::size_t block = 0;
  const BlockLayout& layout = layout_at(index, block);
  const auto next = std::upper_bound(
      base_segments_.begin(), base_segments_.end(), index,
      [](std::uint64_t point, const Segment& segment) { return point < segment.first_point; });
  if (next != base_segments_.begin() && index - (next - 1)->first_point < (next - 1)->count) {
    return *(next - 1);
  }
  const std::uint64_t points_per_model = layout.points / layout.models;
  const std::uint64_t model = (index - layout.first_point) / points_per_model;
  return {layout.first_model + model, layout.first_point + model * points_per_model,
          points_per_model};
}

}  // namespace oblique::protocol
