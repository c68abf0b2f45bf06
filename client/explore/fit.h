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

  /// Value at the share (1 + cos w) / 2 of the range, on a logarithmic scale if both bounds are
  /// positive. Every angle w gives a value in the range: pi gives `from`, 2 pi gives `to`.
  double value_at(double angle) const;
  double angle_of(double value) const;
};

/// A fit of predictions f(theta) to measured numbers y with standard deviations sigma. It minimises
/// chi2 = sum r_i^2 with the residuals r_i = (f_i - y_i) / sigma_i.
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

  /// Throws solver::InputError if a start is not between its bounds, if there is no unknown, or if
  /// there are more unknowns than measured numbers.
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
  Eigen::MatrixXd jacobian;   ///< derivatives of the residuals with respect to the angles
  double chi2 = 0.0;
};

/// Minimises chi2 by Levenberg and Marquardt's method in the angles, from `start`, with central
/// differences. Each trial is one call of `evaluate`. Ends when the linearised model predicts that
/// chi2 falls by less than `tolerance`, or when trials become very short without success. Throws
/// solver::SolveError if a prediction is missing at the start, and after 200 trials.
FitStep minimise(const FitProblem& problem, const Eigen::VectorXd& start, double tolerance = 1e-6);

/// A fitted parameter. Numbers that the data do not determine are NaN.
struct FittedUnknown {
  Estimate estimate;  ///< profile-likelihood interval; an end at the unknown's bound is NaN
  double sd = kNaN;   ///< from the covariance
  bool is_at_bound = false;
  bool has_effect = true;  ///< on any prediction, between the bounds
  bool is_cut = false;     ///< chi2 jumps, or an output is missing, at an end of the interval
};

/// Unknowns of which the data determine some combinations much worse than others.
struct Combination {
  std::vector<std::size_t> unknowns;
  bool is_undetermined;  ///< true: not determined at all; false: poorly determined
};

struct Fit {
  FitStep minimum;
  std::vector<FittedUnknown> unknowns;
  Eigen::MatrixXd covariance;  ///< of the unknowns' angles; 0 if at a bound or without effect
  /// Measured numbers without the combinations of unknowns that they determine.
  std::size_t degrees_of_freedom = 0;
  double scale = 1.0;  ///< factor of all variances
  double limit = 0.0;  ///< rise of chi2 to the ends of the intervals
  std::vector<Combination> combinations;

  double correlation(Eigen::Index i, Eigen::Index j) const;
};

/// Finds the least chi2, the covariance (J^T J)^-1 and 95 % profile-likelihood intervals. An
/// interval contains the values of an unknown for which chi2, minimised over the others, is at most
/// `limit` above its minimum: 3.84, the 95 % quantile of chi2 with one degree of freedom. The fit
/// starts from the best of the given start and 15 points of Sobol's sequence. It restarts up to
/// three times if the search for intervals finds a smaller chi2. This search takes at most 40 calls
/// of `evaluate`. With `is_scaled` the standard deviations are known up to one factor: scale is
/// chi2 / degrees of freedom, which needs more data than unknowns, and `limit` is scale t^2 with
/// the 97.5 % quantile t of Student's distribution. Otherwise scale is 1. Throws the errors of
/// `FitProblem::check` and `minimise`.
Fit fit(const FitProblem& problem, bool is_scaled = false);

}  // namespace oblique::client
