#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/explore/estimate.h"
#include "proto/recipe/sampling.h"

// Designs and estimators of global sensitivity analysis. The inputs are independent and uniform in
// the unit cube; the caller maps them to the quantiles of their distributions.
namespace oblique::client {

/// Maximum number of inputs of Saltelli's design: each needs two dimensions of Sobol's sequence.
inline constexpr std::size_t kMostSobolInputs = sampling::kSobolDimensions / 2;

/// Row `number` of Saltelli's design for d inputs: the d + 2 points A, B, A_B^1, ..., A_B^d, each
/// with its d coordinates. A is the first half and B the second half of point `number` of the
/// scrambled Sobol sequence in 2d dimensions; A_B^i is A with coordinate i of B. A balanced design
/// has 2^m rows, beginning with row 0: A. B. Owen, On dropping the first Sobol' point (2022).
/// Throws std::out_of_range for more than kMostSobolInputs.
std::vector<double> saltelli_row(std::size_t inputs, std::uint64_t seed, std::uint64_t number);

/// Sobol' indices of one output.
struct SobolIndices {
  std::vector<Estimate> first = {};  ///< S_i of each input
  std::vector<Estimate> total = {};  ///< S_Ti of each input
  double mean = 0.0;
  double variance = 0.0;
  std::uint64_t rows = 0;     ///< of the design that were used
  std::uint64_t dropped = 0;  ///< rows with a value that is not finite
};

/// The indices from the outputs at the points of a design, row by row: f(A), f(B), f(A_B^1), ....
/// M. J. W. Jansen, Analysis of variance designs for model output, Comput. Phys. Commun. 117
/// (1999); A. Saltelli et al., Variance based sensitivity analysis of model output, Comput. Phys.
/// Commun. 181 (2010), table 2 (c) and (f):
///
///   S_i  = 1 - sum_n (f(B) - f(A_B^i))^2 / (2 N V)
///   S_Ti =     sum_n (f(A) - f(A_B^i))^2 / (2 N V)
///
/// V is the variance of all f(A) and f(B). A row with a value that is not finite is dropped whole.
/// Intervals are percentiles of `bootstrap`; they ignore that Sobol points are spread more evenly
/// than random ones and are therefore rather too wide. All indices of an output without variance
/// are NaN.
SobolIndices sobol_indices(std::span<const double> outputs, std::size_t inputs, std::uint64_t seed);

/// Trajectory `number` of Morris' design for d inputs: M. D. Morris, Factorial sampling plans for
/// preliminary computational experiments, Technometrics 33 (1991). Each coordinate has one of the
/// levels (j + 1/2)/8, j = 0 ... 7, and changes once, by 1/2 up or down.
struct MorrisTrajectory {
  std::vector<double> points = {};        ///< d + 1, each with its d coordinates
  std::vector<std::size_t> changed = {};  ///< the input that changes after each point but the last
};
MorrisTrajectory morris_trajectory(std::size_t inputs, std::uint64_t seed, std::uint64_t number);

/// Elementary effects of one output: its change over the change of the coordinate, 1 being the
/// whole distribution of the input.
struct MorrisEffects {
  std::vector<Estimate> mu = {};       ///< mean of the effects of each input
  std::vector<Estimate> mu_star = {};  ///< mean of their magnitudes: how much the input matters
  std::vector<Estimate> sigma = {};    ///< their deviation: curvature or interaction
  std::uint64_t trajectories = 0;      ///< that were used
  std::uint64_t dropped = 0;           ///< with a value that is not finite
};

/// The effects from the outputs at the points of trajectories 0, 1, ... of that seed. mu_star:
/// F. Campolongo, J. Cariboni and A. Saltelli, An effective screening design for sensitivity
/// analysis of large models, Environ. Model. Softw. 22 (2007). All are NaN for fewer than two
/// trajectories.
MorrisEffects morris_effects(std::span<const double> outputs, std::size_t inputs,
                             std::uint64_t seed);

}  // namespace oblique::client
