#include "server/store/known/axis_inverse.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "proto/recipe/axes.h"

namespace oblique::server {
namespace {

std::uint64_t bits_of(double value) {
  return std::bit_cast<std::uint64_t>(value);
}

}  // namespace

AxisInverse::AxisInverse(const protocol::Axis& axis)
    : axis_(&axis), size_(protocol::axis_size(axis)) {
  if (axis.count() > 0) {
    range_.emplace(axis);
    return;
  }
  for (std::uint64_t i = 0; i < size_; ++i) {
    listed_.emplace(bits_of(axis.values(static_cast<int>(i))), i);
  }
}

std::optional<std::uint64_t> AxisInverse::find(double value) const {
  if (range_) {
    return guess(value);
  }
  const auto found = listed_.find(bits_of(value));
  return found == listed_.end() ? std::nullopt : std::optional(found->second);
}

/// Values lie evenly, or their logarithms do, up to rounding: the number is one of the nearest.
std::optional<std::uint64_t> AxisInverse::guess(double value) const {
  constexpr std::uint64_t kNear = 2;
  const double from = axis_->from();
  const double to = axis_->to();
  if (!(value >= from && value <= to)) {
    return std::nullopt;
  }
  const bool is_logarithmic = axis_->spacing() == protocol::SPACING_LOGARITHMIC;
  const double part = is_logarithmic ? std::log(value / from) / std::log(to / from)
                                     : (value / 2 - from / 2) / (to / 2 - from / 2);
  const double place = std::isfinite(part) ? part * static_cast<double>(size_ - 1) : 0.0;
  const auto nearest = static_cast<std::uint64_t>(
      std::clamp(std::round(place), 0.0, static_cast<double>(size_ - 1)));
  const std::uint64_t last = std::min(nearest + kNear, size_ - 1);
  for (std::uint64_t i = nearest - std::min(nearest, kNear); i <= last; ++i) {
    if (bits_of(range_->at(i)) == bits_of(value)) {
      return i;
    }
  }
  return std::nullopt;
}

std::vector<std::pair<std::uint64_t, std::uint64_t>> shared_values(const protocol::Axis& first,
                                                                   const protocol::Axis& second,
                                                                   Work& work) {
  const std::uint64_t size_of_first = protocol::axis_size(first);
  const std::uint64_t size_of_second = protocol::axis_size(second);
  std::vector<std::pair<std::uint64_t, std::uint64_t>> shared;
  if (!work.spend(static_cast<std::uint64_t>(first.values_size()) +
                  static_cast<std::uint64_t>(second.values_size()))) {
    return shared;
  }
  const bool looks_in_second = size_of_first <= size_of_second;
  const protocol::Axis& shorter = looks_in_second ? first : second;
  const AxisInverse longer(looks_in_second ? second : first);
  std::optional<protocol::RangeValues> range;
  if (shorter.count() > 0) {
    range.emplace(shorter);
  }
  const std::uint64_t size = std::min(size_of_first, size_of_second);
  for (std::uint64_t i = 0; i < size && work.spend(1); ++i) {
    if (const auto found =
            longer.find(range ? range->at(i) : shorter.values(static_cast<int>(i)))) {
      shared.emplace_back(looks_in_second ? i : *found, looks_in_second ? *found : i);
    }
  }
  std::sort(shared.begin(), shared.end());
  return shared;
}

}  // namespace oblique::server
