#pragma once

#include <cstdint>

#include "proto/oblique.pb.h"

// Sample points in the unit cube, each computed from its number, and quantiles of distributions.
namespace oblique::sampling {

inline constexpr std::uint64_t kMaxSamples = std::uint64_t{1} << 44;
inline constexpr std::uint32_t kSobolDimensions = 32;
inline constexpr int kSobolBits = 52;

/// Returns coordinate `dimension` of point `index`, in (0, 1). The kind of the sample determines
/// the points: they are independent, or there is one in each of `count` equal strata (Latin
/// hypercube), or they are Sobol's sequence with Owen's scrambling. The cost does not depend on
/// index and count. Throws std::out_of_range for a dimension or point outside the sample.
double fraction(const protocol::Sample& sample, std::uint32_t dimension, std::uint64_t index);

/// Returns element `index` of the SplitMix64 sequence of `key` (Steele, Lea and Flood, Fast
/// splittable pseudorandom number generators, 2014), without computing the elements before it.
std::uint64_t hashed(std::uint64_t key, std::uint64_t index);

/// Returns element `index` < 2^52 of Sobol's sequence in one dimension, times 2^52, in Gray code
/// order. Throws std::out_of_range if the dimension is `kSobolDimensions` or more.
std::uint64_t sobol_bits(std::uint64_t index, std::uint32_t dimension);

/// Returns `bits` after nested uniform scrambling (A. B. Owen, Randomly permuted (t,m,s)-nets and
/// (t,s)-sequences, 1995). A random bit, which depends on all digits before a digit, decides
/// whether the digit is flipped. So every elementary interval of base 2 keeps its number of points.
std::uint64_t owen_scrambled(std::uint64_t bits, std::uint64_t key);

/// The quantiles of a checked distribution. A normal distribution is truncated at `from` and `to`
/// if these are set.
class Quantiles {
 public:
  explicit Quantiles(const protocol::Axis& axis);

  /// Returns the quantile for 0 < fraction < 1. It rises with `fraction` and is between the ends.
  double value_at(double fraction) const;

  /// Returns the probability of the normal distribution between the ends; 1 for other kinds. If the
  /// result is subnormal, it has too few digits for sampling.
  double part_left() const { return below_to_ - below_from_; }

 private:
  protocol::DistributionKind kind_;
  double mean_;
  double sd_;
  double from_;
  double to_;
  /// Probability of the normal distribution below each end. An interval whose middle lies
  /// above the mean is mirrored about the mean, because probabilities near 1 are less precise.
  double below_from_ = 0.0;
  double below_to_ = 1.0;
  bool is_mirrored_ = false;
};

/// Returns the quantile of the standard normal distribution for 0 < p < 1, to about 1e-15.
double normal_quantile(double p);

/// Returns the probability of the standard normal distribution below z. The relative error is about
/// 1e-15, even far below the mean.
double normal_part_below(double z);

}  // namespace oblique::sampling
