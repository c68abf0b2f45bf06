#include "proto/recipe/recipe.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

/// The point keys close every block in this order.
constexpr std::array<std::string_view, 3> kPointKeyOrder{"H", "mu", "e"};

/// A key from outside, fit for a message: long ones only by their length.
std::string quoted(const std::string& key) {
  constexpr std::size_t kLongestQuoted = 64;
  return key.size() <= kLongestQuoted ? '"' + key + '"'
                                      : "of " + std::to_string(key.size()) + " characters";
}

std::string all_keys() {
  std::string names;
  for (const auto& key : solver::model_keys()) {
    names += std::string(key.name) + ", ";
  }
  return names + "H, mu and e";
}

[[noreturn]] void throw_too_many_points() {
  throw solver::InputError("the study has more than " + std::to_string(PointTable::kMaxPoints) +
                           " points, the most that are allowed: shorten an axis");
}

/// Product of counts of which none is 0; throws InputError above `kMaxPoints`.
std::uint64_t checked_product(std::uint64_t a, std::uint64_t b) {
  if (a > PointTable::kMaxPoints / b) {
    throw_too_many_points();
  }
  return a * b;
}

void check_listed_axis(const solver::ParameterKey& key, const Axis& axis) {
  if (axis.values().empty()) {
    throw solver::InputError(std::string(key.name) +
                             " has no values: an axis needs at least one value");
  }
  for (const double value : axis.values()) {
    solver::check_value(key, value);
  }
}

void check_range_axis(const solver::ParameterKey& key, const Axis& axis) {
  const std::string name(key.name);
  if (!axis.values().empty()) {
    throw solver::InputError(name + " has both listed values and a range: give one of them");
  }
  solver::check_value(key, axis.from());
  solver::check_value(key, axis.to());
  const std::string range = name + " from " + solver::exact_number(axis.from()) + " to " +
                            solver::exact_number(axis.to());
  if (axis.from() > axis.to()) {
    throw solver::InputError(range + " is reversed: `to` must not be below `from`");
  }
  if ((axis.count() == 1) != (axis.from() == axis.to())) {
    throw solver::InputError(range + " with " + std::to_string(axis.count()) +
                             " values is not allowed: a range holds both ends, so it needs two "
                             "different ends and 2 values or more, or equal ends and 1");
  }
  for (const std::uint64_t i : deciding_values(axis)) {
    solver::check_value(key, axis_value(axis, i));
  }
}

/// Number of a key among the model keys and, after them, those of a point. Throws InputError for an
/// unknown one.
std::size_t key_number(const std::string& name) {
  const auto model_keys = solver::model_keys();
  if (const solver::ParameterKey* key = solver::find_model_key(name)) {
    return static_cast<std::size_t>(key - model_keys.data());
  }
  const auto found = std::find(kPointKeyOrder.begin(), kPointKeyOrder.end(), name);
  if (found == kPointKeyOrder.end()) {
    throw solver::InputError("unknown key " + quoted(name) + ": the keys are " + all_keys());
  }
  return model_keys.size() + static_cast<std::size_t>(found - kPointKeyOrder.begin());
}

const solver::ParameterKey& key_numbered(std::size_t number) {
  const auto model_keys = solver::model_keys();
  return number < model_keys.size() ? model_keys[number]
                                    : solver::point_keys()[number - model_keys.size()];
}

/// Which keys a block has, by `key_number`.
using KeySet = std::bitset<32>;

/// Checks each axis of a block alone and that no key is there twice. Returns which are.
KeySet check_axes(const Block& block) {
  KeySet seen;
  for (const Axis& axis : block.axes()) {
    const std::size_t number = key_number(axis.key());
    if (seen.test(number)) {
      throw solver::InputError(axis.key() + " appears twice: an axis is given once in a block");
    }
    seen.set(number);
    const solver::ParameterKey& key = key_numbered(number);
    if (axis.count() == 0) {
      check_listed_axis(key, axis);
    } else {
      check_range_axis(key, axis);
    }
  }
  return seen;
}

/// Checks the keys of a block together: H, mu and e there, and last in that order.
void check_axis_order(const Block& block, const KeySet& seen) {
  const std::size_t model_keys = solver::model_keys().size();
  for (std::size_t i = 0; i < kPointKeyOrder.size(); ++i) {
    if (!seen.test(model_keys + i)) {
      throw solver::InputError(std::string(kPointKeyOrder[i]) +
                               " is missing: every block needs H, mu and e");
    }
  }
  const auto model_axes = block.axes_size() - static_cast<int>(kPointKeyOrder.size());
  for (std::size_t i = 0; i < kPointKeyOrder.size(); ++i) {
    const Axis& axis = block.axes(model_axes + static_cast<int>(i));
    if (axis.key() != kPointKeyOrder[i]) {
      throw solver::InputError("axis " + axis.key() +
                               " is out of order: model keys come first, then H, mu and e");
    }
  }
}

std::span<const Axis* const> model_axes(const Block& block) {
  return {block.axes().data(), static_cast<std::size_t>(block.axes_size()) - kPointKeyOrder.size()};
}

std::span<const Axis* const> point_axes(const Block& block) {
  return {block.axes().data() + block.axes_size() - kPointKeyOrder.size(), kPointKeyOrder.size()};
}

std::uint64_t combinations(std::span<const Axis* const> axes) {
  std::uint64_t count = 1;
  for (const Axis* axis : axes) {
    count = checked_product(count, axis_size(*axis));
  }
  return count;
}

/// Smallest or largest value of an axis.
double axis_extreme(const Axis& axis, bool largest) {
  if (axis.count() > 0) {
    return largest ? axis.to() : axis.from();
  }
  const auto [least, most] = std::minmax_element(axis.values().begin(), axis.values().end());
  return largest ? *most : *least;
}

/// The shortest finger of the block must be as long as its largest H. Length grows with both keys
/// that set it, so their least values make the shortest finger.
void check_reach(solver::ModelParameters model, const Block& block) {
  for (const Axis* axis : model_axes(block)) {
    solver::find_model_key(axis->key())->set(model, axis_extreme(*axis, false));
  }
  const auto axes = point_axes(block);
  solver::validate_point(model, axis_extreme(*axes[0], true), axis_extreme(*axes[1], true),
                         axis_extreme(*axes[2], true));
}

void check_block(const solver::ModelParameters& model, const Block& block) {
  check_axis_order(block, check_axes(block));
  check_reach(model, block);
}

/// value = a + b, as two doubles of which the second is below half a unit of the first's last
/// digit.
struct TwoDoubles {
  double high;
  double low;
};

/// Exact sum (Knuth 1969).
TwoDoubles exact_sum(double a, double b) {
  const double sum = a + b;
  const double b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

/// Exact product, by the fused multiply-add.
TwoDoubles exact_product(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

/// (from (last − i) + to i) / last, rounded once: then 0.1:1.0:10 holds what a person types as 0.3,
/// and the value is the same bits on every machine.
double interpolated(double from, double to, std::uint64_t i, std::uint64_t last) {
  const TwoDoubles a = exact_product(from, static_cast<double>(last - i));
  const TwoDoubles b = exact_product(to, static_cast<double>(i));
  const TwoDoubles sum = exact_sum(a.high, b.high);
  const double low = sum.low + (a.low + b.low);
  const double divisor = static_cast<double>(last);
  const double quotient = (sum.high + low) / divisor;
  const double remainder = std::fma(-quotient, divisor, sum.high) + low;
  return quotient + remainder / divisor;
}

}  // namespace

double axis_value(const Axis& axis, std::uint64_t i) {
  if (i >= axis_size(axis)) {
    throw std::out_of_range("axis " + axis.key() + " has no value " + std::to_string(i));
  }
  if (axis.count() == 0) {
    return axis.values(static_cast<int>(i));
  }
  if (i == 0) {
    return axis.from();
  }
  if (i == axis.count() - 1) {
    return axis.to();
  }
  // Products with the count must not overflow; scaling by a power of two changes no digit.
  constexpr int kScaleExponent = 64;
  const bool huge = std::max(std::abs(axis.from()), std::abs(axis.to())) > 1e280;
  const int exponent = huge ? kScaleExponent : 0;
  const double value =
      std::ldexp(interpolated(std::ldexp(axis.from(), -exponent), std::ldexp(axis.to(), -exponent),
                              i, axis.count() - 1),
                 exponent);
  return std::min(std::max(value, axis.from()), axis.to());
}

std::vector<std::uint64_t> deciding_values(const Axis& axis) {
  std::vector<std::uint64_t> deciding{0};
  for (const std::uint64_t i : {std::uint64_t{1}, axis.count() - 1}) {
    if (i < axis.count() && i > deciding.back()) {
      deciding.push_back(i);
    }
  }
  return deciding;
}

std::uint64_t axis_size(const Axis& axis) {
  return axis.count() > 0 ? axis.count() : static_cast<std::uint64_t>(axis.values_size());
}

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
