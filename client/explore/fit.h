#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace oblique::client {

/// A parameter to be fitted, between bounds. README.md has the mathematics.
struct Unknown {
  std::string name;
  double from;
  double to;
  double start;  ///< between the bounds and at neither of them

  /// Half way between the bounds: in logarithms where both are positive.
  static double usual_start(double from, double to);

  /// value(w) = middle + half cos(w), of ln(value) where both bounds are positive. The angle w runs
  /// from pi (`from`) to 2 pi (`to`), so that no step leaves the bounds.
  double value_at(double angle) const;
  double angle_of(double value) const;
  /// d value / d angle.
  double slope_at(double angle) const;

 private:
  struct Scale {
    bool is_logarithmic;
    double middle;
    double half;
  };
  Scale scale() const;
};

/// What is fitted: predictions f(theta) to measured numbers y with standard deviations sigma, by
/// the least chi2 = sum r_i^2, r_i = (f_i - y_i) / sigma_i.
struct FitProblem {
  /// The predictions of the model for each of the parameter vectors, in the order of `measured`;
  /// NaN if the model has no such value. `what` describes the round: "iteration 3, chi2 = 12.4". An
  /// exception ends the fit and is passed on.
  using Evaluate = std::function<std::vector<Eigen::VectorXd>(
      const std::vector<Eigen::VectorXd>& parameters, const std::string& what)>;

  std::vector<Unknown> unknowns;
  Eigen::VectorXd measured;
  Eigen::VectorXd sd;
  std::vector<std::string> names;  ///< of the measured numbers, for errors: "line 3: fn_peak_N"
  Evaluate evaluate;

  /// Throws solver::InputError if bounds do not ascend, a start is not between them, a standard
  /// deviation is not positive, there is no unknown, or there are more unknowns than measured
  /// numbers.
  void check() const;
};

/// Where a minimisation stands.
struct FitStep {
  int iteration = 0;  ///< 0: the start
  Eigen::VectorXd angles;
  Eigen::VectorXd parameters;
  Eigen::VectorXd predictions;
  Eigen::MatrixXd jacobian;  ///< of the residuals by the angles
  double chi2 = 0.0;
};

/// The least chi2 by Levenberg and Marquardt's method (Eigen's, after MINPACK's lmder) in the
/// angles of the unknowns, with derivatives by central differences. An iteration is one call of
/// `evaluate`, with the point and all disturbed ones. Ends when the linearised model predicts that
/// chi2 falls by less than `tolerance`, or when the method makes no progress. `after_each` is
/// called with the start and each iteration. Throws solver::InputError as `check`, and
/// solver::SolveError when predictions are missing at the start, and after 200 trials.
FitStep minimise(const FitProblem& problem, double tolerance = 1e-6,
                 const std::function<void(const FitStep&)>& after_each = {});

/// One fitted parameter.
struct Estimate {
  double value;
  std::optional<double> sd;  ///< from the covariance; nothing at a bound or if it is undetermined
  /// Ends of the 95 % profile-likelihood interval; nothing if it reaches the bound.
  std::optional<double> lower;
  std::optional<double> upper;
  bool is_at_bound = false;
};

struct Fit {
  FitStep minimum;
  std::vector<Estimate> estimates;  ///< in the order of the unknowns
  Eigen::MatrixXd correlation;      ///< 0 for unknowns at a bound
  std::size_t degrees_of_freedom = 0;
  double scale = 1.0;                       ///< by which variances are multiplied
  std::vector<std::size_t> without_effect;  ///< unknowns that hardly change any prediction
  /// Sets of unknowns of which the data determine only a combination.
  std::vector<std::vector<std::size_t>> inseparable;
  /// Pairs whose correlation is beyond 0.99, of those that are not in such a set.
  std::vector<std::pair<std::size_t, std::size_t>> correlated;
};

/// The least chi2 with covariance (J^T J)^-1, what the data cannot determine, and
/// profile-likelihood intervals: the values of an unknown for which the least chi2 over the others
/// is at most 3.84 scale above the minimum. When a profile finds a smaller chi2 than the minimum,
/// the fit starts again from there. With `is_scaled` the standard deviations are known up to one
/// factor: scale is chi2 / degrees of freedom, which needs more data than unknowns; else it is 1.
/// Throws as `minimise` does.
Fit fit(const FitProblem& problem, bool is_scaled = false);

}  // namespace oblique::client
