#include "proto/recipe/sampling/distribution.h"

#include <algorithm>

#include "proto/recipe/exact_math/exponentials.h"
#include "proto/recipe/sampling/normal.h"

namespace oblique::sampling {
namespace {

using exact_math::TwoDoubles;

/// a (1 - fraction) + b fraction
TwoDoubles between(const TwoDoubles& a, const TwoDoubles& b, double fraction) {
  return a * exact_math::exact_sum(1.0, -fraction) + b * fraction;
}

}  // namespace

Distribution::Distribution(Kind kind, double from, double to)
    : kind_(kind), from_(from), to_(to), at_from_{from, 0.0}, at_to_{to, 0.0} {}

Distribution Distribution::uniform(double from, double to) {
  return {Kind::kUniform, from, to};
}

Distribution Distribution::log_uniform(double from, double to) {
  Distribution distribution(Kind::kLogUniform, from, to);
  distribution.at_from_ = exact_math::log(from);
  distribution.at_to_ = exact_math::log(to);
  return distribution;
}

Distribution Distribution::normal(double mean, double sd, double from, double to) {
  Distribution normal(Kind::kNormal, from, to);
  normal.mean_ = mean;
  normal.sd_ = sd;
  const double from_z = (from - mean) / sd;
  const double to_z = (to - mean) / sd;
  normal.is_mirrored_ = from_z + to_z > 0.0;
  normal.at_from_ = {normal_part_below(normal.is_mirrored_ ? -to_z : from_z), 0.0};
  normal.at_to_ = {normal_part_below(normal.is_mirrored_ ? -from_z : to_z), 0.0};
  return normal;
}

double Distribution::part_left() const {
  return kind_ == Kind::kNormal ? at_to_.high - at_from_.high : 1.0;
}

double Distribution::value_at(double fraction) const {
  const auto there = between(at_from_, at_to_, is_mirrored_ ? 1.0 - fraction : fraction);
  double value = there.rounded();
  if (kind_ == Kind::kLogUniform) {
    value = exact_math::exp(there).rounded();
  } else if (kind_ == Kind::kNormal) {
    const double z = normal_quantile(value);
    value = mean_ + sd_ * (is_mirrored_ ? -z : z);
  }
  return std::min(std::max(value, from_), to_);
}

}  // namespace oblique::sampling
