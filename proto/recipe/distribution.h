#pragma once

#include "proto/oblique.pb.h"

namespace oblique::sampling {

/// The quantiles of an axis with a distribution. Its kind, the order of its ends, mean and sd must
/// have been checked. A normal distribution is truncated at its ends, if it has them.
class Quantiles {
 public:
  explicit Quantiles(const protocol::Axis& axis);

  /// The quantile of 0 < fraction < 1. It rises with `fraction` and is between the ends.
  double value_at(double fraction) const;

  /// Part of the whole normal distribution between the ends; 1 for the other kinds. Below
  /// `kLeastPart` it has too few digits to draw from.
  double part_left() const;
  static constexpr double kLeastPart = 1e-290;

 private:
  protocol::DistributionKind kind_;
  double mean_;
  double sd_;
  double from_;
  double to_;
  /// Part of the normal distribution below the ends; mirrored about the mean if more of the
  /// interval is above it, because small parts have more digits.
  double below_from_ = 0.0;
  double below_to_ = 1.0;
  bool is_mirrored_ = false;
};

/// The quantile z of 0 < p < 1 in the standard normal distribution, to about 1e-15.
double normal_quantile(double p);

/// Part of the standard normal distribution below z, also far below the mean to about 1e-15.
double normal_part_below(double z);

}  // namespace oblique::sampling
