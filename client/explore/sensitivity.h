#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/explore/estimate.h"
#include "proto/recipe/sampling.h"

// Designs and estimators of global sensitivity analysis. The d inputs are independent and uniform
// in the unit cube; the caller maps them to the quantiles of their distributions. A row of a design
// is several points, each with its d coordinates.
namespace oblique::client {

/// Maximum number of inputs of Saltelli's design, which needs two dimensions of Sobol's sequence
/// for each.
inline constexpr std::size_t kMaxSobolInputs = sampling::kSobolDimensions / 2;

/// Row `number` of Saltelli's design: the points A, B, A_B^1, ..., A_B^d. A is the first half and B
/// the second half of point `number` of the scrambled Sobol sequence in 2d dimensions; A_B^i is A
/// with coordinate i of B. A balanced design has 2^m rows, beginning with row 0: A. B. Owen, On
/// dropping the first Sobol' point (2022). Throws std::out_of_range for more than kMaxSobolInputs.
std::vector<double> saltelli_row(std::size_t inputs, std::uint64_t seed, std::uint64_t number);

/// Row `number` of Morris' design, a trajectory of d + 1 points. Each coordinate has one of the
/// levels (j + 1/2)/8, j = 0 ... 7, and changes once, by 1/2 up or down: M. D. Morris, Factorial
/// sampling plans for preliminary computational experiments, Technometrics 33 (1991).
std::vector<double> morris_trajectory(std::size_t inputs, std::uint64_t seed, std::uint64_t number);

/// A measure of how much an output depends on each input.
struct Measure {
  std::string name;
  std::vector<Estimate> of_inputs = {};  ///< NaN: undefined
};
struct Sensitivity {
  std::vector<Measure> measures = {};
  std::uint64_t rows = 0;     ///< rows that were used
  std::uint64_t dropped = 0;  ///< rows with a value that is not finite
};

/// Sobol' indices `first` (S_i) and `total` (S_Ti) of an output. `values` are the output at the
/// points of rows 0, 1, ... of Saltelli's design. M. J. W. Jansen, Analysis of variance designs for
/// model output, Comput. Phys. Commun. 117 (1999); A. Saltelli et al., Variance based sensitivity
/// analysis of model output, Comput. Phys. Commun. 181 (2010), table 2 (c) and (f):
///
///   S_i  = 1 - sum_n (f(B) - f(A_B^i))^2 / (2 N V)
///   S_Ti =     sum_n (f(A) - f(A_B^i))^2 / (2 N V)
///
/// V is the variance of all f(A) and f(B). If V is 0 but for rounding errors, or there are fewer
/// than two rows, the indices are undefined. The ends of intervals are the 2.5 % and 97.5 %
/// percentiles of 1,000 bootstrap replicates (B. Efron and R. J. Tibshirani, An Introduction to the
/// Bootstrap, 1993). The intervals assume independent rows, so they are too wide for Sobol points.
Sensitivity sobol_indices(std::span<const double> values, std::size_t inputs, std::uint64_t seed);

/// Measures of the elementary effects of each input on an output. `values` are the output at the
/// points of rows 0, 1, ... of Morris' design, and `coordinates` the coordinates of these points.
/// They may be moved, as long as the coordinate that changes still changes. An elementary effect is
/// the change of the output divided by the change of the coordinate. `mu_star` is the mean of the
/// effects' magnitudes (F. Campolongo, J. Cariboni and A. Saltelli, An effective screening design
/// for sensitivity analysis of large models, Environ. Model. Softw. 22 (2007)), `sigma` their
/// standard deviation, and `mu` their mean. Intervals are as in `sobol_indices`. Fewer than two
/// rows leave the measures undefined. Measures that are only rounding errors of the output are 0.
Sensitivity morris_effects(std::span<const double> values, std::span<const double> coordinates,
                           std::size_t inputs, std::uint64_t seed);

}  // namespace oblique::client
