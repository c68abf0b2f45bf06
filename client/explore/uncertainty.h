#pragma once

#include <cstdint>
#include <span>

#include "client/explore/estimate.h"

// Statistics of independent draws, with 95 % intervals. Values are finite. A statistic that too few
// values do not determine is NaN.
namespace oblique::client {

/// The 97.5 % quantile of Student's t distribution with `degrees` >= 1 degrees of freedom.
double t_quantile(std::uint64_t degrees);

/// The mean, with the interval mean -+ t sd/sqrt(n), t with n - 1 degrees of freedom. It holds for
/// normal values, and for more than about 30 other values.
Estimate mean_of(std::span<const double> values);
/// The standard deviation sqrt(sum (x - mean)^2/(n - 1)).
double deviation_of(std::span<const double> values);

/// The quantile 0 < p < 1 of ascending values, interpolated at place (n - 1) p from 0. The interval
/// holds for any continuous distribution: the number B of values below the quantile is binomial, so
/// the quantile lies between value l and value u, counted from 1, with P(B < l) <= 0.025 and
/// P(B >= u) <= 0.025 (H. A. David and H. N. Nagaraja, Order Statistics (2003), section 7.1).
Estimate quantile_of(std::span<const double> ascending, double p);

/// The probability of an event that happened in `hits` of `n` draws. E. B. Wilson, Probable
/// inference, the law of succession, and statistical inference, J. Am. Stat. Assoc. 22 (1927):
///
///   (q + z^2/2n -+ z sqrt(q (1 - q)/n + z^2/4n^2))/(1 + z^2/n),  q = hits/n, z = 1.96
Estimate probability_of(std::uint64_t hits, std::uint64_t n);

/// Pearson's correlation of pairs, with the interval tanh(atanh(r) -+ 1.96/sqrt(n - 3)) (R. A.
/// Fisher, 1921). NaN for fewer than four pairs and for constant values.
Estimate correlation_of(std::span<const double> x, std::span<const double> y);

}  // namespace oblique::client
