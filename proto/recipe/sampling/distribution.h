#pragma once

#include "proto/recipe/exact_math/two_doubles.h"

namespace oblique::sampling {

/// What values are drawn from. Every function of it is the same bits on every machine.
class Distribution {
 public:
  /// Between from < to, both finite; the second with a uniform logarithm, and from > 0.
  static Distribution uniform(double from, double to);
  static Distribution log_uniform(double from, double to);
  /// Normal with a finite mean and sd > 0, cut off at both ends: from < to, which may be infinite.
  static Distribution normal(double mean, double sd, double from, double to);

  /// The value that part `fraction` of the distribution lies below, for 0 < fraction < 1. It rises
  /// with it and stays between the ends.
  double value_at(double fraction) const;

  /// Part of the whole normal distribution between the ends; 1 of the others. Below `kLeastPart`
  /// there are too few digits to draw from.
  double part_left() const;
  static constexpr double kLeastPart = 1e-290;

 private:
  enum class Kind { kUniform, kLogUniform, kNormal };
  Distribution(Kind kind, double from, double to);

  Kind kind_;
  double from_;
  double to_;
  double mean_ = 0.0;
  double sd_ = 0.0;
  /// What is equally spaced, at the two ends: the value, its logarithm or the part of the normal
  /// distribution below it. Of the mirror image about the mean where more of the interval is above
  /// the mean, for small parts have more digits.
  exact_math::TwoDoubles at_from_;
  exact_math::TwoDoubles at_to_;
  bool is_mirrored_ = false;
};

}  // namespace oblique::sampling
