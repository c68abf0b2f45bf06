#include "proto/recipe/blocks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {

namespace {

template <std::size_t link>
solver::ParameterKey length_key() {
  static const std::string name = fmt::format("length{}", link + 1);
  return {name,
          "m",
          "length of one link, counted from the pin",
          "> 0",
          [](double value) { return value > 0.0; },
          [](const solver::ModelParameters& m) {
            return link < m.lengths_m.size() ? m.lengths_m[link] : 0.0;
          },
          [](solver::ModelParameters& m, double value) {
            if (link < m.lengths_m.size()) {
              m.lengths_m[link] = value;
            }
          }};
}

/// Every key, by its number.
const std::vector<solver::ParameterKey>& all_keys() {
  static const auto keys = []<std::size_t... links>(std::index_sequence<links...>) {
    const auto model = solver::model_keys();
    std::vector<solver::ParameterKey> all(model.begin(), model.end());
    (all.push_back(length_key<links>()), ...);
    all.insert(all.end(), solver::point_keys().begin(), solver::point_keys().end());
    return all;
  }
  (std::make_index_sequence<kMostLinks>());
  return keys;
}

std::optional<std::size_t> find_key_number(std::string_view name) {
  const auto& keys = all_keys();
  const auto found =
      std::find_if(keys.begin(), keys.end(), [&](const auto& key) { return key.name == name; });
  return found == keys.end() ? std::nullopt
                             : std::optional(static_cast<std::size_t>(found - keys.begin()));
}

}  // namespace

const solver::ParameterKey& key_numbered(std::size_t number) {
  return all_keys().at(number);
}

std::size_t key_count() {
  return all_keys().size();
}

std::size_t key_number(std::string_view name) {
  if (const auto number = find_key_number(name)) {
    return *number;
  }
  if (name == "preset" || name == "lengths") {
    throw solver::InputError(
        name, fmt::format("{} cannot be an axis of a block: it belongs to [model]", name));
  }
  std::vector<std::string_view> known;
  for (const auto& key : solver::model_keys()) {
    known.push_back(key.name);
  }
  known.insert(known.end(), {"length1", "length2", "length3", "..."});
  known.insert(known.end(), kPointKeyOrder.begin(), kPointKeyOrder.end());
  throw solver::InputError(
      name, fmt::format("{}: the keys are {}", unknown_key(name, known), joined(known)));
}

const solver::ParameterKey& axis_key(std::string_view name) {
  return key_numbered(key_number(name));
}

bool is_axis_key(std::string_view name) {
  return find_key_number(name).has_value();
}

bool is_point_key(std::size_t number) {
  return number >= solver::model_keys().size() + kMostLinks;
}

std::optional<std::size_t> link_of_key(std::size_t number) {
  const std::size_t first = solver::model_keys().size();
  return number >= first && !is_point_key(number) ? std::optional(number - first) : std::nullopt;
}

bool has_own_values(const Axis& axis) {
  return axis.count() > 0 || axis.values_size() > 0;
}

std::uint64_t axis_size(const Axis& axis) {
  if (axis.count() > 0) {
    return axis.count();
  }
  const bool is_single = axis.has_distribution() || !axis.expression().empty();
  return is_single ? 1 : static_cast<std::uint64_t>(axis.values_size());
}

RangeValues::RangeValues(const Axis& axis)
    : from_(axis.from()),
      to_(axis.to()),
      last_(axis.count() - 1),
      is_logarithmic_(axis.spacing() == SPACING_LOGARITHMIC) {
  constexpr double kExactBelow = 0x1p53;
  constexpr double kLargestExactPower = 1e22;
  const auto last = static_cast<double>(last_);
  for (double per_unit = 1.0; !is_logarithmic_ && last_ > 0 && per_unit <= kLargestExactPower;
       per_unit *= 10.0) {
    const double first = std::round(from_ * per_unit);
    const double end = std::round(to_ * per_unit);
    if (!(std::abs(first) < kExactBelow && std::abs(end) < kExactBelow && last < kExactBelow)) {
      break;
    }
    // Value i is the double nearest to the decimal, so that 0.1:1:10 has 0.3.
    if (first / per_unit == from_ && end / per_unit == to_ && std::fmod(end - first, last) == 0.0) {
      decimals_ = {first, (end - first) / last, per_unit};
      break;
    }
  }
}

double RangeValues::at(std::uint64_t i) const {
  if (i == 0 || i == last_) {
    return i == 0 ? from_ : to_;
  }
  if (decimals_) {
    return (decimals_->first + decimals_->step * static_cast<double>(i)) / decimals_->per_unit;
  }
  const auto part = static_cast<long double>(i);
  const auto last = static_cast<long double>(last_);
  const auto from = static_cast<long double>(from_);
  const auto to = static_cast<long double>(to_);
  const long double value = is_logarithmic_ ? from * std::pow(to / from, part / last)
                                            : (from * (last - part) + to * part) / last;
  return std::min(std::max(static_cast<double>(value), from_), to_);
}

double axis_value(const Axis& axis, std::uint64_t i) {
  if (!has_own_values(axis) || i >= axis_size(axis)) {
    throw std::out_of_range("axis " + axis.key() + " has no value " + std::to_string(i));
  }
  return axis.count() == 0 ? axis.values(static_cast<int>(i)) : RangeValues(axis).at(i);
}

std::uint64_t first_value_from(const Axis& axis, double value) {
  std::uint64_t first = 0;
  for (std::uint64_t end = axis_size(axis); first < end;) {
    const std::uint64_t middle = first + (end - first) / 2;
    if (axis_value(axis, middle) < value) {
      first = middle + 1;
    } else {
      end = middle;
    }
  }
  return first;
}

double smallest_value(const Axis& axis) {
  const Distribution& drawn = axis.distribution();
  return axis.has_distribution()
             ? (drawn.has_from() ? drawn.from() : -std::numeric_limits<double>::infinity())
         : axis.count() > 0 ? axis.from()
                            : *std::min_element(axis.values().begin(), axis.values().end());
}

double largest_value(const Axis& axis) {
  const Distribution& drawn = axis.distribution();
  return axis.has_distribution()
             ? (drawn.has_to() ? drawn.to() : std::numeric_limits<double>::infinity())
         : axis.count() > 0 ? axis.to()
                            : *std::max_element(axis.values().begin(), axis.values().end());
}

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
