#include "client/convergence/richardson.h"

#include <algorithm>
#include <cmath>

namespace oblique::client {
namespace {

Extrapolation monotone(double last, double before, double value, double highest_order) {
  const double order = std::log2(before / last);
  const double believed = std::min(order, highest_order);
  // |last|, unless it is smaller than theory lets it be.
  const double difference =
      std::copysign(std::max(std::abs(last), std::abs(before) * std::exp2(-highest_order)), last);
  const double correction = difference / (std::exp2(believed) - 1.0);
  return {.trend = Trend::kMonotone,
          .limit = value + correction,
          .order = order,
          .error = std::abs(correction)};
}

}  // namespace

Extrapolation extrapolate(std::span<const double> values, double highest_order, double resolution) {
  const double value = values.back();
  Extrapolation result{.trend = Trend::kTooFew, .limit = value, .order = {}, .error = {}};
  if (values.size() < 2) {
    return result;
  }
  const double last = value - values[values.size() - 2];
  result.error = std::max(std::abs(last), resolution);
  if (values.size() < 3) {
    return result;
  }
  const double before = values[values.size() - 2] - values[values.size() - 3];
  if (std::abs(last) <= resolution) {
    result.trend = Trend::kRounding;
    result.error = resolution;
  } else if (!(std::abs(last) < std::abs(before) * std::exp2(-kLeastOrder))) {
    result.trend = Trend::kUnsettled;
    result.error = std::max(std::abs(last), std::abs(before));
  } else if ((last > 0.0) != (before > 0.0)) {
    result.trend = Trend::kOscillating;
    result.error = std::max(std::abs(last), std::abs(before) * std::exp2(-highest_order));
  } else {
    result = monotone(last, before, value, highest_order);
  }
  return result;
}

}  // namespace oblique::client
