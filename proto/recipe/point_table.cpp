#include "proto/recipe/point_table.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <mutex>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/block_points.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/sample.h"

namespace oblique::protocol {
namespace {

using solver::InputError;

/// Rows and messages contain finite values only.
double finite_or_0(double value) {
  return std::isfinite(value) ? value : 0.0;
}

std::size_t expressions_in(const Block& block) {
  const auto count = std::count_if(block.axes().begin(), block.axes().end(),
                                   [](const Axis& axis) { return !axis.expression().empty(); });
  return static_cast<std::size_t>(count) + (block.where().empty() ? 0 : 1);
}

}  // namespace

/// Compiled blocks, each used by one caller at a time. Keeps the ones that were returned last.
class PointTable::Pool {
 public:
  Pool(const solver::ModelParameters& base, const Recipe& recipe) : base_(base), recipe_(recipe) {}

  template <typename Use>
  auto with(std::size_t block, Use use) {
    std::unique_ptr<BlockPoints> points = take(block);
    if (points == nullptr) {
      points = std::make_unique<BlockPoints>(base_, recipe_.blocks(static_cast<int>(block)));
    }
    auto result = use(*points);
    const std::lock_guard lock(mutex_);
    if (idle_.size() >= kMostIdle) {
      idle_.erase(idle_.begin());
    }
    idle_.emplace_back(block, std::move(points));
    return result;
  }

 private:
  static constexpr std::size_t kMostIdle = 32;  // more than threads, few enough to search

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

  const solver::ModelParameters base_;
  const Recipe& recipe_;
  std::mutex mutex_;
  std::vector<std::pair<std::size_t, std::unique_ptr<BlockPoints>>> idle_;
};

/// Calls `act`. If there are several blocks, puts the block's number before the message of its
/// error.
template <typename Act>
auto PointTable::in_block(std::size_t number, Act act) const {
  try {
    return act();
  } catch (const InputError& error) {
    if (recipe_->blocks_size() == 1) {
      throw;
    }
    throw InputError(fmt::format("block {}: {}", number + 1, error.what()));
  }
}

PointTable::PointTable(Recipe recipe) : recipe_(std::make_unique<Recipe>(std::move(recipe))) {
  if (!recipe_->has_model()) {
    throw InputError(
        "the recipe has no model: send all its parameters, for defaults change between versions");
  }
  base_model_ = from_message(recipe_->model());
  if (recipe_->blocks().empty()) {
    throw InputError("the study has no block: it needs at least one with H, mu and e");
  }
  pool_ = std::make_unique<Pool>(base_model_, *recipe_);
  for (const Block& block : recipe_->blocks()) {
    in_block(blocks_.size(), [&] { add_block(block); });
  }
}

PointTable::~PointTable() = default;
PointTable::PointTable(PointTable&&) noexcept = default;

void PointTable::add_block(const Block& block) {
  check_block(base_model_, block);
  expressions_ += expressions_in(block);
  if (expressions_ > kMostExpressions) {
    throw InputError(
        fmt::format("the study has more than {} expressions and filters", kMostExpressions));
  }
  const std::uint64_t points = points_of_block(block);
  if (points > kMaxPoints - points_) {
    throw_too_many_points();
  }
  BlockPlace place{points_, points, models_, 1, is_judged_by_points(base_model_, block)};
  if (model_axes(block).empty()) {
    place.first_model = base_model_number_.value_or(models_);
    if (!base_segments_.empty() &&
        base_segments_.back().first_point + base_segments_.back().count == points_) {
      base_segments_.back().count += points;
    } else {
      base_segments_.push_back({place.first_model, points_, points});
    }
  } else {
    place.models =
        is_plain_product(block)
            ? combinations(model_axes(block))
            : pool_->with(blocks_.size(), [](auto& compiled) { return compiled.models(); });
  }
  if (!model_axes(block).empty() || !base_model_number_) {
    model_blocks_.push_back(blocks_.size());
    models_ += place.models;
  }
  if (model_axes(block).empty()) {
    base_model_number_ = place.first_model;
  }
  blocks_.push_back(place);
  has_filter_ = has_filter_ || !block.where().empty();
  points_ += points;
}

std::size_t PointTable::block_of_point(std::uint64_t index) const {
  if (index >= points_) {
    throw std::out_of_range(fmt::format("the study has no point {}", index));
  }
  const auto next = std::upper_bound(
      blocks_.begin(), blocks_.end(), index,
      [](std::uint64_t point, const BlockPlace& place) { return point < place.first_point; });
  return static_cast<std::size_t>(next - blocks_.begin()) - 1;
}

Point PointTable::point(std::uint64_t index) const {
  const std::size_t block = block_of_point(index);
  const BlockPlace& place = blocks_[block];
  const std::uint64_t number = index - place.first_point;
  const std::uint64_t model = place.first_model + number / (place.points / place.models);
  return pool_->with(block, [&](BlockPoints& points) {
    points.go_to(number);
    const auto values = points.values().last(kPointKeyOrder.size());
    return Point{model, finite_or_0(values[0]), finite_or_0(values[1]), finite_or_0(values[2])};
  });
}

solver::ModelParameters PointTable::model(std::uint64_t index) const {
  if (index >= models_) {
    throw std::out_of_range(fmt::format("the study has no model {}", index));
  }
  const auto next = std::upper_bound(model_blocks_.begin(), model_blocks_.end(), index,
                                     [this](std::uint64_t model, std::size_t block) {
                                       return model < blocks_[block].first_model;
                                     });
  const std::size_t block = *(next - 1);
  const BlockPlace& place = blocks_[block];
  return pool_->with(block, [&](BlockPoints& points) {
    points.go_to((index - place.first_model) * (place.points / place.models));
    return points.model();
  });
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
    begin = pool_->with(block, [&](BlockPoints& points) {
      std::uint64_t point = begin;
      for (; point < block_end; ++point) {
        points.go_to(point - place.first_point);
        if (points.is_left_in()) {
          break;
        }
      }
      return point;
    });
    if (begin < block_end) {
      return begin;
    }
  }
  return std::min(begin, end);
}

std::string PointTable::fault(std::uint64_t index) const {
  const std::size_t block = block_of_point(index);
  if (!blocks_[block].is_judged_by_points) {
    return {};
  }
  return pool_->with(block, [&](BlockPoints& points) {
    points.go_to(index - blocks_[block].first_point);
    return points.fault();
  });
}

bool PointTable::needs_judging() const {
  return std::any_of(blocks_.begin(), blocks_.end(),
                     [](const BlockPlace& place) { return place.is_judged_by_points; });
}

void PointTable::judge_points() const {
  const auto judged = static_cast<std::uint64_t>(
      std::count_if(blocks_.begin(), blocks_.end(),
                    [](const BlockPlace& place) { return place.is_judged_by_points; }));
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (blocks_[i].is_judged_by_points) {
      in_block(i, [&] { judge_block(i, kMostJudged / judged); });
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
      throw InputError(fmt::format("point {}: {}", place.first_point + i, fault));
    }
    leaves_any_in = leaves_any_in || points.is_left_in();
  }
  if (judges_all && !leaves_any_in) {
    throw InputError(expression_in_words("where", block.where()) + " leaves no point in");
  }
}

}  // namespace oblique::protocol
