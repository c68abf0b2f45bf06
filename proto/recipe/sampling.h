#pragma once

#include <cstdint>

#include "proto/oblique.pb.h"

// Sample points in the unit cube, each computed from its number, and quantiles of the distributions
// of axes.
namespace oblique::sampling {

inline constexpr std::uint64_t kMaxSamples = std::uint64_t{1} << 44;
inline constexpr std::uint32_t kSobolDimensions = 32;
inline constexpr int kSobolBits = 52;

/// Coordinate `dimension` of point `index`, in (0, 1). Depending on the kind of the sample, points
/// are independent, one per stratum of `count` equal strata (Latin hypercube), or Sobol's sequence
/// with Owen's scrambling. The cost does not depend on index and count. Throws std::out_of_range
/// for a dimension or point outside the sample.
double fraction(const protocol::Sample& sample, std::uint32_t dimension, std::uint64_t index);

/// Element `index` of the SplitMix64 sequence of `key` (Steele, Lea and Flood, Fast splittable
/// pseudorandom number generators, 2014), computed without its predecessors.
std::uint64_t hashed(std::uint64_t key, std::uint64_t index);

/// Element `index` < 2^52 of Sobol's sequence in one dimension, times 2^52, in Gray code order.
/// Throws std::out_of_range for a dimension of `kSobolDimensions` or more.
std::uint64_t sobol_bits(std::uint64_t index, std::uint32_t dimension);

/// `bits` after nested uniform scrambling (A. B. Owen, Randomly permuted (t,m,s)-nets and
/// (t,s)-sequences, 1995): each digit is flipped or not by a bit drawn for the digits before it, so
/// every elementary interval of base 2 keeps its number of points.
std::uint64_t owen_scrambled(std::uint64_t bits, std::uint64_t key);

/// The quantiles of an axis with a checked distribution. A normal distribution is truncated at its
/// ends if it has them.
class Quantiles {
 public:
  explicit Quantiles(const protocol::Axis& axis);

  /// The quantile for 0 < fraction < 1. It rises with `fraction` and stays between the ends.
  double value_at(double fraction) const;

  /// Probability of the normal distribution between the ends; 1 for the other kinds. A subnormal
  /// value has too few digits to draw from.
  double part_left() const { return below_to_ - below_from_; }

 private:
  protocol::DistributionKind kind_;
  double mean_;
  double sd_;
  double from_;
  double to_;
  /// Probability of the normal distribution below the ends. If more of the interval lies above the
  /// mean it is mirrored about the mean, because small probabilities have more digits.
  double below_from_ = 0.0;
  double below_to_ = 1.0;
  bool is_mirrored_ = false;
};

/// The quantile z of 0 < p < 1 in the standard normal distribution, to about 1e-15.
double normal_quantile(double p);

/// Probability of the standard normal distribution below z, to a relative error of about 1e-15 also
/// far below the mean.
double normal_part_below(double z);

}  // namespace oblique::sampling
