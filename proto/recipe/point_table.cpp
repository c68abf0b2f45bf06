#include "proto/recipe/point_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "proto/recipe/axes.h"
#include "proto/recipe/block_points.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/keys.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/sampling/hash.h"

namespace oblique::protocol {

namespace {

/// What is said of a block stands behind its number, where there are several.
std::string of_block(const Recipe& recipe, std::size_t number, std::string_view what) {
  return recipe.blocks_size() == 1
             ? std::string(what)
             : "block " + std::to_string(number + 1) + ": " + std::string(what);
}

std::size_t expressions_in(const Block& block) {
  return static_cast<std::size_t>(
             std::count_if(block.axes().begin(), block.axes().end(),
                           [](const Axis& axis) { return !axis.expression().empty(); })) +
         (block.where().empty() ? 0 : 1);
}

/// Values stand in their axes and cost nothing to look up.
bool is_simple(const Block& block) {
  return is_plain_product(block) &&
         std::all_of(block.axes().begin(), block.axes().end(), [](const Axis& axis) {
           return axis.spacing() == SPACING_LINEAR && !link_of_key(key_number(axis.key()));
         });
}

/// A point's values are numbers in every row and message.
double number_or_0(double value) {
  return std::isfinite(value) ? value : 0.0;
}

}  // namespace

/// Blocks with what was computed of them once, lent to one caller at a time. Holds the latest that
/// were given back, and makes others anew.
class PointTable::Compiled {
 public:
  Compiled(const solver::ModelParameters& base, const Recipe& recipe)
      : base_(base), recipe_(recipe) {}

  template <typename Use>
  auto with(std::size_t block, Use use) {
    std::unique_ptr<BlockPoints> points = take(block);
    if (points == nullptr) {
      points = std::make_unique<BlockPoints>(base_, recipe_.blocks(static_cast<int>(block)));
    }
    auto result = use(*points);
    give_back(block, std::move(points));
    return result;
  }

 private:
  /// More than threads use at a time, and few enough to be looked through.
  static constexpr std::size_t kMostIdle = 32;

  std::unique_ptr<BlockPoints> take(std::size_t block) {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(idle_.rbegin(), idle_.rend(),
                                    [&](const auto& entry) { return entry.first == block; });
    if (found == idle_.rend()) {
      return nullptr;
    }
    std::unique_ptr<BlockPoints> points = std::move(found->second);
    idle_.erase(std::next(found).base());
    return points;
  }
  void give_back(std::size_t block, std::unique_ptr<BlockPoints> points) {
    const std::lock_guard lock(mutex_);
    if (idle_.size() >= kMostIdle) {
      idle_.erase(idle_.begin());
    }
    idle_.emplace_back(block, std::move(points));
  }

  const solver::ModelParameters base_;
  const Recipe& recipe_;
  std::mutex mutex_;
  std::vector<std::pair<std::size_t, std::unique_ptr<BlockPoints>>> idle_;
};

PointTable::PointTable(Recipe recipe) : recipe_(std::make_unique<Recipe>(std::move(recipe))) {
  if (!recipe_->has_model()) {
    throw solver::InputError(
        "the recipe has no model: send all its parameters, for defaults change between versions");
  }
  base_model_ = from_message(recipe_->model());
  if (recipe_->blocks().empty()) {
    throw solver::InputError("the study has no block: it needs at least one with H, mu and e");
  }
  compiled_ = std::make_unique<Compiled>(base_model_, *recipe_);
  blocks_.reserve(static_cast<std::size_t>(recipe_->blocks_size()));
  for (const Block& block : recipe_->blocks()) {
    try {
      check_block(base_model_, block);
      add_block(block);
    } catch (const solver::InputError& error) {
      if (recipe_->blocks_size() == 1) {
        throw;
      }
      throw solver::InputError(of_block(*recipe_, blocks_.size(), error.what()));
    }
  }
}

PointTable::~PointTable() = default;
PointTable::PointTable(PointTable&&) noexcept = default;

void PointTable::add_block(const Block& block) {
  expressions_ += expressions_in(block);
  if (expressions_ > kMostExpressions) {
    throw solver::InputError("the study has more than " + std::to_string(kMostExpressions) +
                             " expressions and filters");
  }
  const std::uint64_t block_points = points_of_block(block);
  if (block_points > kMaxPoints - points_) {
    throw_too_many_points();
  }
  const bool is_of_base_model = model_axes(block).empty();
  const bool is_plain = is_plain_product(block);
  std::uint64_t block_models = is_of_base_model ? 1 : 0;
  if (block_models == 0) {
    block_models = is_plain ? combinations(model_axes(block))
                            : compiled_->with(blocks_.size(),
                                              [](BlockPoints& points) { return points.models(); });
  }
  const bool is_base_model_known = is_of_base_model && base_model_number_.has_value();
  const std::uint64_t first_model = is_base_model_known ? *base_model_number_ : models_;
  if (!is_base_model_known) {
    model_blocks_.push_back(blocks_.size());
    models_ += block_models;
  }
  if (is_of_base_model) {
    base_model_number_ = first_model;
    add_to_base_segments(block_points);
  }
  blocks_.push_back({points_, block_points, first_model, block_models});
  is_simple_.push_back(is_simple(block));
  is_judged_by_points_.push_back(!is_simple_.back() && is_judged_by_points(base_model_, block));
  has_filter_ = has_filter_ || !block.where().empty();
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

std::size_t PointTable::block_of_point(std::uint64_t point) const {
  if (point >= size()) {
    throw std::out_of_range("the study has no point " + std::to_string(point));
  }
  const auto next = std::upper_bound(
      blocks_.begin(), blocks_.end(), point,
      [](std::uint64_t p, const BlockPlace& place) { return p < place.first_point; });
  return static_cast<std::size_t>(next - blocks_.begin()) - 1;
}

std::size_t PointTable::block_of_model(std::uint64_t index) const {
  if (index >= models()) {
    throw std::out_of_range("the study has no model " + std::to_string(index));
  }
  const auto next = std::upper_bound(
      model_blocks_.begin(), model_blocks_.end(), index,
      [this](std::uint64_t m, std::size_t block) { return m < blocks_[block].first_model; });
  return *(next - 1);
}

Point PointTable::point(std::uint64_t index) const {
  const std::size_t block = block_of_point(index);
  const BlockPlace& place = blocks_[block];
  std::array<double, kPointKeyOrder.size()> values{};
  std::uint64_t rest = index - place.first_point;
  if (is_simple_[block]) {
    const auto axes = point_axes(message(block));
    for (std::size_t i = axes.size(); i-- > 0;) {
      const std::uint64_t size = axis_size(*axes[i]);
      values[i] = axis_value(*axes[i], rest % size);
      rest /= size;
    }
    return {place.first_model + rest, values[0], values[1], values[2]};
  }
  values = compiled_->with(block, [&](BlockPoints& points) {
    points.go_to(rest);
    std::array<double, kPointKeyOrder.size()> found{};
    std::transform(points.values().end() - found.size(), points.values().end(), found.begin(),
                   number_or_0);
    return found;
  });
  return {place.first_model + rest / (place.points / place.models), values[0], values[1],
          values[2]};
}

solver::ModelParameters PointTable::model(std::uint64_t index) const {
  const std::size_t block = block_of_model(index);
  const BlockPlace& place = blocks_[block];
  std::uint64_t rest = index - place.first_model;
  if (!is_simple_[block]) {
    return compiled_->with(block, [&](BlockPoints& points) {
      points.go_to(rest * (place.points / place.models));
      return points.model();
    });
  }
  const auto axes = model_axes(message(block));
  solver::ModelParameters model = base_model_;
  for (std::size_t i = axes.size(); i-- > 0;) {
    const std::uint64_t size = axis_size(*axes[i]);
    solver::find_model_key(axes[i]->key())->set(model, axis_value(*axes[i], rest % size));
    rest /= size;
  }
  return model;
}

Segment PointTable::segment_at(std::uint64_t index) const {
  const BlockPlace& place = blocks_[block_of_point(index)];
  const auto next = std::upper_bound(
      base_segments_.begin(), base_segments_.end(), index,
      [](std::uint64_t point, const Segment& segment) { return point < segment.first_point; });
  if (next != base_segments_.begin() && index - (next - 1)->first_point < (next - 1)->count) {
    return *(next - 1);
  }
  const std::uint64_t points_per_model = place.points / place.models;
  const std::uint64_t model = (index - place.first_point) / points_per_model;
  return {place.first_model + model, place.first_point + model * points_per_model,
          points_per_model};
}

// ---- What only the points tell ----------------------------------------------------------------

bool PointTable::is_left_in(std::uint64_t index) const {
  return !has_filter_ || first_left_in(index, index + 1) == index;
}

std::uint64_t PointTable::first_left_in(std::uint64_t begin, std::uint64_t end) const {
  while (has_filter_ && begin < end) {
    const std::size_t block = block_of_point(begin);
    if (message(block).where().empty()) {
      return begin;
    }
    const BlockPlace& place = blocks_[block];
    const std::uint64_t block_end = std::min(end, place.first_point + place.points);
    const std::uint64_t found = compiled_->with(block, [&](BlockPoints& points) {
      std::uint64_t point = begin;
      for (; point < block_end; ++point) {
        points.go_to(point - place.first_point);
        if (points.is_left_in()) {
          break;
        }
      }
      return point;
    });
    if (found < block_end) {
      return found;
    }
    begin = block_end;
  }
  return std::min(begin, end);
}

std::string PointTable::fault(std::uint64_t index) const {
  const std::size_t block = block_of_point(index);
  if (!is_judged_by_points_[block]) {
    return {};
  }
  return compiled_->with(block, [&](BlockPoints& points) {
    points.go_to(index - blocks_[block].first_point);
    return points.fault();
  });
}

bool PointTable::needs_judging() const {
  return std::find(is_judged_by_points_.begin(), is_judged_by_points_.end(), true) !=
         is_judged_by_points_.end();
}

void PointTable::judge_points() const {
  const auto judged = static_cast<std::uint64_t>(
      std::count(is_judged_by_points_.begin(), is_judged_by_points_.end(), true));
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!is_judged_by_points_[i]) {
      continue;
    }
    try {
      judge_block(i, kMostJudged / judged);
    } catch (const solver::InputError& error) {
      if (recipe_->blocks_size() == 1) {
        throw;
      }
      throw solver::InputError(of_block(*recipe_, i, error.what()));
    }
  }
}

void PointTable::judge_block(std::size_t number, std::uint64_t most) const {
  const Block& block = message(number);
  const BlockPlace& place = blocks_[number];
  const bool judges_all = place.points <= most;
  BlockPoints points(base_model_, block);
  bool leaves_any_in = false;
  for (std::uint64_t look = 0; look < std::min(place.points, most); ++look) {
    const std::uint64_t i = judges_all ? look : sampling::hashed(number, look) % place.points;
    points.go_to(i);
    if (const std::string fault = points.fault(); !fault.empty()) {
      throw solver::InputError("point " + std::to_string(place.first_point + i) + ": " + fault);
    }
    leaves_any_in = leaves_any_in || points.is_left_in();
  }
  if (judges_all && !leaves_any_in) {
    throw solver::InputError(expression_in_words("where", block.where()) + " leaves no point in");
  }
}

}  // namespace oblique::protocol
