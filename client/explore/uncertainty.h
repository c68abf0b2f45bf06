#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/explore/estimate.h"

// Statistics of a sample of independent draws, with 95 % intervals. Values are finite.
namespace oblique::client {

/// Mean and standard deviation (n - 1). The interval of the mean is that of the normal
/// distribution, mean -+ 1.96 sd/sqrt(n), for more than about thirty values. NaN: too few values.
struct Moments {
  Estimate mean = {};
  double sd = 0.0;
};
Moments moments_of(std::span<const double> values);

/// The quantile 0 < p < 1 of rising values, interpolated at place (n - 1) p from 0. The interval is
/// that of order statistics, for any continuous distribution: the number of values below the
/// quantile is binomial, so the quantile lies between value l and value u, counted from 1, with
/// P(B < l) <= 0.025 and P(B >= u) <= 0.025 (H. A. David and H. N. Nagaraja, Order Statistics
/// (2003), section 7.1). An end is NaN where the values are too few for it.
Estimate quantile_of(std::span<const double> rising, double p);

/// The probability of an event that happened in `hits` of `n` draws. E. B. Wilson, Probable
/// inference, the law of succession, and statistical inference, J. Am. Stat. Assoc. 22 (1927):
///
///   (q + z^2/2n -+ z sqrt(q (1 - q)/n + z^2/4n^2))/(1 + z^2/n),  q = hits/n, z = 1.96
Estimate probability_of(std::uint64_t hits, std::uint64_t n);

/// Pearson's correlation of pairs, and Spearman's, which is that of ranks (equal values share the
/// mean of theirs). Intervals: tanh(atanh(r) -+ 1.96 s), s^2 = 1/(n - 3) (R. A. Fisher, 1921), for
/// ranks 1.06/(n - 3) (E. C. Fieller, H. O. Hartley and E. S. Pearson, Biometrika 44 (1957)).
/// NaN for fewer than four pairs, and where one side has a single value.
Estimate pearson(std::span<const double> x, std::span<const double> y);
Estimate spearman(std::span<const double> x, std::span<const double> y);

/// The ranks of values from 1; equal ones share the mean of theirs.
std::vector<double> ranks_of(std::span<const double> values);

/// n/8, n/4, n/2 and n, without those below `least` but for n itself.
std::vector<std::size_t> growing_parts(std::size_t n, std::size_t least = 8);

}  // namespace oblique::client
