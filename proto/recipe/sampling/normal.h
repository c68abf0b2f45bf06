#pragma once

// The standard normal distribution, the same bits on every machine.
namespace oblique::sampling {

/// The z that part p of the distribution lies below, for 0 < p < 1. M. J. Wichura, Algorithm AS
/// 241: The percentage points of the normal distribution, Applied Statistics 37 (1988), PPND16:
/// relative error about 1e-16.
double normal_quantile(double p);

/// Part of the distribution below z; of values far below the mean too with 14 digits.
double normal_part_below(double z);

}  // namespace oblique::sampling
