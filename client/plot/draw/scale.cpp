#include "client/plot/draw/scale.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

/// Exact up to 10^22, and the nearest double beyond.
double power_of_ten(int exponent) {
  return std::pow(10.0, exponent);
}

/// An end that something can be reckoned with.
double tamed(double value, double unless) {
  constexpr double kFar = 1e300;
  return std::isfinite(value) ? std::clamp(value, -kFar, kFar) : unless;
}

/// Powers of ten that labels leave to the axis: none where numbers are short anyway.
int exponent_for(double largest) {
  constexpr double kLong = 1e5;
  constexpr double kSmall = 1e-2;
  if (largest == 0.0 || (largest < kLong && largest >= kSmall)) {
    return 0;
  }
  const int decade = static_cast<int>(std::floor(std::log10(largest) + 1e-9));
  return static_cast<int>(std::floor(decade / 3.0)) * 3;
}

/// The distance of ticks that gives about `wanted` in `length`.
double step_for(double length, int wanted) {
  const double raw = length / std::max(wanted, 1);
  const double decade = power_of_ten(static_cast<int>(std::floor(std::log10(raw))));
  for (const double times : {1.0, 2.0, 5.0}) {
    if (times * decade >= raw * 0.999) {
      return times * decade;
    }
  }
  return 10.0 * decade;
}

Ticks linear_ticks(const Scale& scale, int wanted) {
  const double step = step_for(scale.to() - scale.from(), wanted);
  Ticks ticks;
  ticks.exponent = exponent_for(std::max(std::abs(scale.from()), std::abs(scale.to())));
  const double unit = power_of_ten(ticks.exponent);
  const int decimals =
      std::clamp(-static_cast<int>(std::floor(std::log10(step / unit) + 1e-9)), 0, 17);
  const double slack = step * 1e-6;
  const double first = std::ceil((scale.from() - slack) / step);
  for (int i = 0; i <= 200; ++i) {
    const double value = (first + i) * step;
    if (value > scale.to() + slack) {
      break;
    }
    ticks.ticks.push_back(
        {value, scale.share_of(value), solver::fixed_number(value / unit, decimals)});
  }
  return ticks;
}

/// Powers of ten for people: 0.001, 1, 1000, 1e+06.
std::string label_of(double value) {
  return solver::readable_number(value, 6);
}

/// Which first digits have labels, from most to fewest.
using Digits = std::array<bool, 10>;
constexpr std::array<Digits, 5> kDigits{{
    {false, true, true, true, true, true, true, true, true, true},
    {false, true, true, true, true, true, true, false, true},
    {false, true, true, true, false, true},
    {false, true, true, false, false, true},
    {false, true},
}};

int labels_of(const Digits& digits, const Scale& scale) {
  const int first = static_cast<int>(std::floor(std::log10(scale.from())));
  const int last = static_cast<int>(std::ceil(std::log10(scale.to())));
  int labels = 0;
  for (int decade = first; decade <= last; ++decade) {
    for (int digit = 1; digit <= 9; ++digit) {
      const double share = scale.share_of(digit * power_of_ten(decade));
      const bool is_there = share > -1e-9 && share < 1.0 + 1e-9;
      labels += digits[static_cast<std::size_t>(digit)] && is_there ? 1 : 0;
    }
  }
  return labels;
}

/// By how many labels there may be: where decades are few as many as there is room for, and two.
Digits labelled_digits(const Scale& scale, double decades, int wanted) {
  std::size_t chosen = decades * 8 <= wanted ? 1 : decades * 3 <= wanted ? 3 : 4;
  if (decades < 1.0) {
    chosen = 0;
    while (chosen + 1 < kDigits.size() && labels_of(kDigits[chosen], scale) > std::max(wanted, 2)) {
      ++chosen;
    }
  }
  while (chosen > 0 && decades < 2.0 && labels_of(kDigits[chosen], scale) < 2) {
    --chosen;
  }
  return kDigits[chosen];
}

Ticks logarithmic_ticks(const Scale& scale, int wanted) {
  const double decades = std::log10(scale.to()) - std::log10(scale.from());
  const int first = static_cast<int>(std::floor(std::log10(scale.from())));
  const int last = static_cast<int>(std::ceil(std::log10(scale.to())));
  const int every = std::max(1, static_cast<int>(std::ceil(decades / std::max(wanted, 1))));
  const Digits labelled = labelled_digits(scale, decades, wanted);
  Ticks ticks;
  for (int decade = first; decade <= last; ++decade) {
    for (int digit = 1; digit <= 9; ++digit) {
      const double value =
          decade < 0 ? digit / power_of_ten(-decade) : digit * power_of_ten(decade);
      const double share = scale.share_of(value);
      if (share < -1e-9 || share > 1.0 + 1e-9 || (digit > 1 && every > 1)) {
        continue;
      }
      const bool has_label =
          labelled[static_cast<std::size_t>(digit)] && (decade - first) % every == 0;
      ticks.ticks.push_back({value, share, has_label ? label_of(value) : std::string()});
    }
  }
  return ticks;
}

std::ptrdiff_t labels_in(const Ticks& ticks) {
  return std::count_if(ticks.ticks.begin(), ticks.ticks.end(),
                       [](const Tick& tick) { return !tick.label.empty(); });
}

}  // namespace

Scale::Scale(double from, double to, bool is_logarithmic)
    : from_(tamed(from, is_logarithmic ? 0.1 : 0.0)),
      to_(tamed(to, 1.0)),
      is_logarithmic_(is_logarithmic) {
  if (is_logarithmic && !(from_ > 0.0 && to_ > 0.0)) {
    throw std::invalid_argument("a logarithmic scale has positive ends");
  }
  if (from_ > to_) {
    std::swap(from_, to_);
  }
  const double room = std::max(std::abs(from_), std::abs(to_)) * 1e-9;
  if (!(to_ - from_ > room)) {  // constant, but for rounding
    if (is_logarithmic) {
      from_ *= 0.5;
      to_ *= 2.0;
    } else {
      const double half = to_ == 0.0 ? 1.0 : 0.1 * std::abs(to_);
      from_ -= half;
      to_ += half;
    }
  }
  start_ = is_logarithmic ? std::log10(from_) : from_;
  length_ = (is_logarithmic ? std::log10(to_) : to_) - start_;
}

double Scale::share_of(double value) const {
  if (is_logarithmic_) {
    return value > 0.0 && std::isfinite(value) ? (std::log10(value) - start_) / length_
                                               : std::numeric_limits<double>::quiet_NaN();
  }
  return std::isfinite(value) ? (value - start_) / length_
                              : std::numeric_limits<double>::quiet_NaN();
}

double Scale::value_at(double share) const {
  const double at = start_ + share * length_;
  return is_logarithmic_ ? std::pow(10.0, at) : at;
}

Range range_of(const std::vector<double>& values, bool positive_only) {
  Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const double value : values) {
    if (std::isfinite(value) && (!positive_only || value > 0.0)) {
      range = {std::min(range.from, value), std::max(range.to, value)};
    }
  }
  return range.from <= range.to ? range : Range{positive_only ? 0.1 : 0.0, 1.0};
}

Range united(const Range& one, const Range& other) {
  return {std::min(one.from, other.from), std::max(one.to, other.to)};
}

Range widened(const Range& range, double by_share, bool is_logarithmic) {
  if (is_logarithmic) {
    const Scale scale(range.from, range.to, true);
    return {scale.value_at(-by_share), scale.value_at(1.0 + by_share)};
  }
  const Scale scale(range.from, range.to);
  Range wide{scale.value_at(-by_share), scale.value_at(1.0 + by_share)};
  if (range.from >= 0.0) {
    wide.from = std::max(wide.from, 0.0);
  }
  if (range.to <= 0.0) {
    wide.to = std::min(wide.to, 0.0);
  }
  return wide;
}

std::string Ticks::factor() const {
  if (exponent == 0) {
    return {};
  }
  constexpr std::array<const char*, 10> kRaised{"\u2070", "\u00b9", "\u00b2", "\u00b3", "\u2074",
                                                "\u2075", "\u2076", "\u2077", "\u2078", "\u2079"};
  std::string text = " \u00d7 10";
  text += exponent < 0 ? "\u207b" : "";
  for (const char digit : std::to_string(std::abs(exponent))) {
    text += kRaised[static_cast<std::size_t>(digit - '0')];
  }
  return text;
}

Ticks ticks_of(const Scale& scale, int wanted) {
  Ticks linear = linear_ticks(scale, wanted);
  if (scale.is_logarithmic()) {
    constexpr std::ptrdiff_t kEnough = 3;
    Ticks ticks = logarithmic_ticks(scale, wanted);
    // In a small part of a decade there are few round values of one digit.
    const bool is_small_part = scale.to() < 10.0 * scale.from();
    const auto labels = labels_in(ticks);
    if (labels >= kEnough || (labels == 2 && (!is_small_part || labels_in(linear) <= labels))) {
      return ticks;
    }
  }
  return linear;
}

}  // namespace oblique::client::plot
