#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "client/explore/estimate.h"

namespace oblique::client {

/// A parameter to be fitted, between bounds. README.md has the mathematics.
struct Unknown {
  std::string name;
  double from;
  double to;
  double start;  ///< strictly between the bounds

  /// share = (1 + cos w) / 2 of the range, in logarithms where both bounds are positive. The angle
  /// w runs from pi (`from`) to 2 pi (`to`), so that no step leaves the bounds.
  double value_at(double angle) const;
  double angle_of(double value) const;
};

/// What is fitted: predictions f(theta) to measured numbers y with standard deviations sigma, by
/// the least chi2 = sum r_i^2, r_i = (f_i - y_i) / sigma_i.
struct FitProblem {
  /// Returns the predictions for each parameter vector, in the order of `measured`; NaN where the
  /// model lacks one. `what` describes the round: "iteration 3, chi2 = 12.4". Exceptions end the
  /// fit.
  using Evaluate = std::function<std::vector<Eigen::VectorXd>(
      const std::vector<Eigen::VectorXd>& parameters, const std::string& what)>;

  std::vector<Unknown> unknowns;
  Eigen::VectorXd measured;
  Eigen::VectorXd sd;
  std::vector<std::string> names;  ///< of the measured numbers, for errors: "line 3: fn_peak_N"
  Evaluate evaluate;

  /// Throws solver::InputError for a start that is not between the bounds, no unknown, and more
  /// unknowns than measured numbers.
  void check() const;
  Eigen::VectorXd start() const;  ///< angles
};

/// The model at one parameter vector.
struct FitStep {
  int iteration = 0;  ///< 0: the start
  Eigen::VectorXd angles;
  Eigen::VectorXd parameters;
  Eigen::VectorXd predictions;
  Eigen::VectorXd residuals;  ///< a missing prediction counts as 1e9
  Eigen::MatrixXd jacobian;   ///< of the residuals by the angles
  double chi2 = 0.0;
};

/// Minimises chi2 by Levenberg and Marquardt's method in the angles, from `start`, with central
/// differences. Each trial is one call of `evaluate`. Ends when the linearised model predicts that
/// chi2 falls by less than `tolerance`, or without progress. Throws solver::SolveError for missing
/// predictions at the start and after 200 trials.
FitStep minimise(const FitProblem& problem, const Eigen::VectorXd& start, double tolerance = 1e-6);

/// A fitted parameter; NaN for what the data do not determine.
struct FittedUnknown {
  Estimate estimate;  ///< with the profile-likelihood interval; an end is NaN if it is the bound
  double sd = kNaN;   ///< from the covariance
  bool is_at_bound = false;
  bool has_effect = true;  ///< on any prediction
  bool is_cut = false;     ///< an end of the interval is a jump of chi2, or a missing output
};

/// Unknowns of which the data determine some combinations much worse than others.
struct Combination {
  std::vector<std::size_t> unknowns;
  bool is_undetermined;  ///< completely; else it is only poorly determined
};

struct Fit {
  FitStep minimum;
  std::vector<FittedUnknown> unknowns;
  Eigen::MatrixXd covariance;  ///< of the angles; 0 for unknowns at a bound or without effect
  std::size_t degrees_of_freedom = 0;
  double scale = 1.0;  ///< by which variances are multiplied
  std::vector<Combination> combinations;

  double correlation(Eigen::Index i, Eigen::Index j) const;
};

/// The least chi2, the covariance (J^T J)^-1 and 95 % profile-likelihood intervals: the values of
/// an unknown for which the least chi2 over the others is at most 3.84 scale above the minimum. The
/// fit starts from the best of the starts and 15 points of Sobol's sequence, and restarts up to
/// three times where a profile finds a smaller chi2. All ends are searched side by side, in at most
/// 40 calls of `evaluate`. With `is_scaled` the standard deviations are known up to one factor:
/// scale is chi2 / degrees of freedom, which needs more data than unknowns; else it is 1. Throws as
/// `FitProblem::check` and `minimise`.
Fit fit(const FitProblem& problem, bool is_scaled = false);

}  // namespace oblique::client
