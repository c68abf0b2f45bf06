#include "client/explore/fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "client/explore/uncertainty.h"
#include "client/io/console.h"
#include "proto/recipe/sampling.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using solver::InputError;
using std::numbers::pi;

/// Step of an angle in central differences. Outputs of the solver are smooth up to relative errors
/// of about 1e-7, so derivatives have relative errors of about 1e-5.
constexpr double kDifference = 3e-3;
/// Residual of a missing prediction. It is so large that the fit rejects the step.
constexpr double kMissing = 1e9;
/// An unknown is at a bound if its angle differs from the bound's angle by less than this.
constexpr double kAtBound = 1e-2;
/// 95 % quantile of chi2 with one degree of freedom.
constexpr double kChi2Quantile = 3.841458820694124;

Index index_of(std::size_t number) {
  return static_cast<Index>(number);
}

/// The inverse of share = (1 + cos w) / 2.
double angle_at(double share) {
  return 2.0 * pi - std::acos(std::clamp(2.0 * share - 1.0, -1.0, 1.0));
}

}  // namespace

double Unknown::value_at(double angle) const {
  const double share = (1.0 + std::cos(angle)) / 2.0;
  const double value = from > 0.0 ? from * std::pow(to / from, share) : from + share * (to - from);
  return std::clamp(value, from, to);
}

double Unknown::angle_of(double value) const {
  return angle_at(from > 0.0 ? std::log(value / from) / std::log(to / from)
                             : (value - from) / (to - from));
}

VectorXd FitProblem::start() const {
  VectorXd angles(index_of(unknowns.size()));
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    angles[index_of(i)] = unknowns[i].angle_of(unknowns[i].start);
  }
  return angles;
}

void FitProblem::check() const {
  for (const auto& [name, from, to, start] : unknowns) {
    if (!(from < start && start < to)) {
      throw InputError(name,
                       fmt::format("{} from {} to {} with the start {}: the bounds must rise, "
                                   "and the start must be between them",
                                   name, solver::exact_number(from), solver::exact_number(to),
                                   solver::exact_number(start)));
    }
  }
  if (unknowns.empty() || index_of(unknowns.size()) > measured.size()) {
    throw InputError(fmt::format(
        "{} cannot be determined by {}: a fit needs one unknown or more, "
        "and one number or more for each",
        counted(unknowns.size(), "unknown", "unknowns"),
        counted(static_cast<std::size_t>(measured.size()), "measured number", "measured numbers")));
  }
}

namespace {

VectorXd parameters_at(const FitProblem& problem, const VectorXd& angles) {
  VectorXd values(angles.size());
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
    values[index_of(i)] = problem.unknowns[i].value_at(angles[index_of(i)]);
  }
  return values;
}

VectorXd residuals_of(const FitProblem& problem, const VectorXd& predictions) {
  return ((predictions - problem.measured).array() / problem.sd.array()).unaryExpr([](double r) {
    return std::isfinite(r) ? r : kMissing;
  });
}

/// The model with derivatives at several vectors of angles, by one call of `evaluate`.
std::vector<FitStep> steps_at(const FitProblem& problem, std::vector<VectorXd> places,
                              const std::string& what) {
  std::vector<VectorXd> points;
  for (VectorXd& angles : places) {
    // Mirrors an angle outside the bounds to the angle inside that has the same cosine.
    angles = 2.0 * pi - angles.array().unaryExpr(
                            [](double w) { return std::abs(std::remainder(w, 2.0 * pi)); });
    points.push_back(parameters_at(problem, angles));
    for (Index i = 0; i < angles.size(); ++i) {
      const VectorXd change = kDifference * VectorXd::Unit(angles.size(), i);
      points.push_back(parameters_at(problem, angles - change));
      points.push_back(parameters_at(problem, angles + change));
    }
  }
  const auto predictions = problem.evaluate(points, what);
  std::vector<FitStep> steps;
  for (std::size_t p = 0, at = 0; p < places.size(); ++p) {
    FitStep& step = steps.emplace_back();
    step.angles = places[p];
    step.parameters = points[at];
    step.predictions = predictions.at(at++);
    step.residuals = residuals_of(problem, step.predictions);
    step.chi2 = step.residuals.squaredNorm();
    step.jacobian.resize(step.residuals.size(), step.angles.size());
    for (Index i = 0; i < step.angles.size(); ++i, at += 2) {
      step.jacobian.col(i) = ((predictions.at(at + 1) - predictions[at]).array() /
                              problem.sd.array() / (2.0 * kDifference))
                                 .unaryExpr([](double s) { return std::isfinite(s) ? s : 0.0; });
    }
  }
  return steps;
}

/// Levenberg and Marquardt's step (J^T J + damping) delta = -J^T r, with the least damping from
/// 1e-3 for which the length of delta is at most `radius`. Even the least damping prevents steps
/// along combinations of unknowns that have no effect.
VectorXd damped_step(const MatrixXd& jacobian, const VectorXd& residuals,
                     double radius = HUGE_VAL) {
  MatrixXd normal = jacobian.transpose() * jacobian;
  normal.diagonal().array() += 1e-3;
  for (double damping = 1e-3;; damping *= 2.0) {
    VectorXd delta = normal.ldlt().solve(-jacobian.transpose() * residuals);
    if (!(delta.norm() > radius)) {
      return delta;
    }
    normal.diagonal().array() += damping;
  }
}

/// Returns the angles with the least chi2 among the given start and 15 points of Sobol's sequence.
VectorXd best_start(const FitProblem& problem) {
  constexpr std::uint64_t kPlaces = 16;
  std::vector<VectorXd> places(kPlaces, problem.start());
  std::vector<VectorXd> points;
  for (std::uint64_t p = 0; p < kPlaces; ++p) {
    for (Index i = 0; p > 0 && i < places[p].size(); ++i) {
      const auto bits = sampling::sobol_bits(p, static_cast<std::uint32_t>(i));
      places[p][i] = angle_at(std::ldexp(static_cast<double>(bits), -sampling::kSobolBits));
    }
    points.push_back(parameters_at(problem, places[p]));
  }
  const auto predictions = problem.evaluate(points, "starts");
  const auto best = std::ranges::min_element(
      predictions, {}, [&](const VectorXd& at) { return residuals_of(problem, at).squaredNorm(); });
  return places[static_cast<std::size_t>(best - predictions.begin())];
}

}  // namespace

FitStep minimise(const FitProblem& problem, const VectorXd& start, double tolerance) {
  constexpr int kMaxTrials = 200;
  constexpr double kFirstRadius = 0.5;
  constexpr double kLeastRadius = 1e-6;
  FitStep best = steps_at(problem, {start}, "start").front();
  for (Index i = 0; i < best.predictions.size(); ++i) {
    if (!std::isfinite(best.predictions[i])) {
      throw solver::SolveError(problem.names[static_cast<std::size_t>(i)] +
                               ": the model has no such output at the start; give other starts");
    }
  }
  double radius = kFirstRadius;
  for (int trial = 0; trial < kMaxTrials; ++trial) {
    const VectorXd newton = damped_step(best.jacobian, best.residuals);
    const double fall = best.chi2 - (best.residuals + best.jacobian * newton).squaredNorm();
    if (fall < tolerance || radius < kLeastRadius) {
      return best;
    }
    const VectorXd delta = damped_step(best.jacobian, best.residuals, radius);
    FitStep step = steps_at(problem, {best.angles + delta},
                            fmt::format("iteration {}, chi2 = {}", best.iteration + 1,
                                        solver::readable_number(best.chi2, 4)))
                       .front();
    if (step.chi2 < best.chi2) {
      radius = std::max(radius, 2.0 * delta.norm());
      step.iteration = best.iteration + 1;
      best = std::move(step);
    } else {
      radius = delta.norm() / 4.0;
    }
  }
  throw solver::SolveError(fmt::format("the fit has found no minimum in {} trials", kMaxTrials));
}

namespace {

/// Adds the covariance of the angles of the unknowns in `free`, and the combinations of unknowns
/// that the data do not determine. D scales the columns of J to length 1, and V L V^T is the
/// eigendecomposition of (J D)^T J D. The covariance is D V L^-1 V^T D. A small eigenvalue in L
/// means an undetermined combination: the unknowns with large components of its eigenvector in V.
void add_covariance(const FitProblem& problem, const std::vector<std::size_t>& free, Fit& fit) {
  constexpr double kUndetermined = 1e-6;  // upper limit of an eigenvalue; above numerical errors
  constexpr double kPoorlyDetermined = 1e-2;  // eigenvalue if two unknowns have correlation 0.99
  constexpr double kLeastPart = 0.2;          // component of a unit eigenvector
  MatrixXd columns = fit.minimum.jacobian(Eigen::all, free);
  const VectorXd scales = columns.colwise().norm().cwiseInverse();
  columns *= scales.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(columns.transpose() * columns);
  const VectorXd& values = eigen.eigenvalues();
  const MatrixXd root =
      scales.asDiagonal() * eigen.eigenvectors() *
      values.cwiseMax(kUndetermined / 100.0).cwiseSqrt().cwiseInverse().asDiagonal();
  fit.covariance(free, free) = root * root.transpose();
  for (const std::size_t i : free) {
    const Index at = index_of(i);
    const auto value = [&](double change) {
      return problem.unknowns[i].value_at(fit.minimum.angles[at] + change);
    };
    const double slope = (value(kDifference) - value(-kDifference)) / (2.0 * kDifference);
    fit.unknowns[i].sd = slope * std::sqrt(fit.covariance(at, at));
  }
  for (Index k = 0; k < values.size() && values[k] < kPoorlyDetermined; ++k) {
    Combination combination{.unknowns = {}, .is_undetermined = values[k] < kUndetermined};
    for (std::size_t i = 0; i < free.size(); ++i) {
      if (std::abs(eigen.eigenvectors()(index_of(i), k)) > kLeastPart) {
        combination.unknowns.push_back(free[i]);
        fit.unknowns[free[i]].sd = combination.is_undetermined ? kNaN : fit.unknowns[free[i]].sd;
      }
    }
    fit.combinations.push_back(std::move(combination));
  }
}

/// Sets `has_effect` of all unknowns. Where the derivatives vanish, as they do at a bound, a step
/// inwards decides. Returns the unknowns with derivatives.
std::vector<std::size_t> find_effects(const FitProblem& problem, Fit& fit) {
  constexpr double kLeastEffect = 0.1;  // effect from bound to bound, in standard deviations
  std::vector<std::size_t> steep;
  std::vector<std::size_t> flat;
  std::vector<VectorXd> points;
  for (std::size_t i = 0; i < fit.unknowns.size(); ++i) {
    if (fit.minimum.jacobian.col(index_of(i)).norm() * pi >= kLeastEffect) {
      steep.push_back(i);
    } else {
      flat.push_back(i);
      VectorXd angles = fit.minimum.angles;
      angles[index_of(i)] += pi / 2.0;  // from a bound to the middle of the range
      points.push_back(parameters_at(problem, angles));
    }
  }
  const auto predictions = flat.empty() ? points : problem.evaluate(points, "effects");
  for (std::size_t p = 0; p < flat.size(); ++p) {
    const VectorXd change = residuals_of(problem, predictions.at(p)) - fit.minimum.residuals;
    fit.unknowns[flat[p]].has_effect = change.norm() >= kLeastEffect;
  }
  return steep;
}

/// The result at a minimum, without intervals.
Fit fit_at(const FitProblem& problem, const FitStep& minimum, bool is_scaled) {
  constexpr double kLeastScale = 1e-6;  // if the data are exact, chi2 has only numerical errors
  Fit fit;
  fit.minimum = minimum;
  fit.unknowns.resize(problem.unknowns.size());
  fit.covariance = MatrixXd::Zero(minimum.angles.size(), minimum.angles.size());
  for (std::size_t i = 0; i < fit.unknowns.size(); ++i) {
    fit.unknowns[i].estimate.value = minimum.parameters[index_of(i)];
    fit.unknowns[i].is_at_bound = std::abs(std::sin(minimum.angles[index_of(i)])) < kAtBound;
  }
  auto free = find_effects(problem, fit);
  std::erase_if(free, [&](std::size_t i) { return fit.unknowns[i].is_at_bound; });
  if (!free.empty()) {
    add_covariance(problem, free, fit);
  }
  const auto undetermined = std::ranges::count_if(fit.combinations, &Combination::is_undetermined);
  fit.degrees_of_freedom = static_cast<std::size_t>(minimum.residuals.size()) - free.size() +
                           static_cast<std::size_t>(undetermined);
  fit.limit = kChi2Quantile;
  if (is_scaled) {
    fit.scale = std::max(minimum.chi2 / static_cast<double>(fit.degrees_of_freedom), kLeastScale);
    fit.limit = fit.scale * std::pow(t_quantile(fit.degrees_of_freedom), 2.0);
  }
  for (auto& unknown : fit.unknowns) {
    unknown.sd *= std::sqrt(fit.scale);
  }
  return fit;
}

/// Searches one end of a profile-likelihood interval: the farthest angle of an unknown for which
/// some values of the other angles give chi2 <= minimum + limit. If the angle changes by d, the
/// linearised model has the least residuals r + g d over the other angles. A trial starts from the
/// farthest step inside the interval and solves |r + g d|^2 = minimum + limit. A trial that ends
/// outside is corrected or shortened.
class IntervalEnd {
 public:
  /// `side` is -1 for the lower end, 1 for the upper one.
  IntervalEnd(const FitStep& minimum, Index unknown, double side, double limit)
      : minimum_(minimum.chi2), unknown_(unknown), side_(side), limit_(limit), inside_(minimum) {
    shortest_ = kShortest * choose_trial(minimum, reach(), 1.0);
  }

  const VectorXd& trial() const { return trial_; }
  bool is_open() const { return is_open_; }
  double angle() const { return inside_.angles[unknown_]; }
  bool is_at_bound() const { return reach() < kAtBound; }
  /// Whether chi2 jumps over the limit at this end.
  bool is_cut() const { return !is_at_bound() && rise_of(inside_) < 1.0 - kJump; }

  /// Takes the model at the trial, and chooses the next trial.
  void take(const FitStep& step) {
    const double rise = rise_of(step);
    if (rise < 1.0 + kTolerance) {
      inside_ = step;
      part_ = std::min(1.0, 2.0 * part_);
    } else if (!is_correction_ && step.predictions.allFinite() &&
               choose_trial(step, 0.0, 1.0) > shortest_) {
      is_correction_ = true;
      return;
    } else {
      const double least = rise_of(inside_);
      part_ *= std::clamp((1.0 - least) / (rise - least), 0.25, 0.9);
    }
    is_correction_ = false;
    is_open_ = !is_at_bound() && choose_trial(inside_, reach(), part_) > shortest_;
  }

 private:
  static constexpr double kTolerance = 2e-3;  ///< of `rise_of`
  static constexpr double kJump = 0.05;       ///< of `rise_of`
  static constexpr double kShortest = 5e-4;   ///< shortest step as a fraction of the first one

  /// sqrt((chi2 - minimum) / limit): 0 at the minimum, 1 at the end, linear for linear residuals.
  double rise_of(const FitStep& step) const {
    return std::sqrt(std::max(step.chi2 - minimum_, 0.0) / limit_);
  }
  /// Distance of the angle from the bound on this side.
  double reach() const { return side_ < 0.0 ? angle() - pi : 2.0 * pi - angle(); }

  /// Sets the trial to `base` plus the fraction `part` of the step to the end. The step is at most
  /// `farthest` long outwards. Returns how far beyond the farthest step inside the trial is.
  double choose_trial(const FitStep& base, double farthest, double part) {
    constexpr double kLongest = 0.5;
    MatrixXd others = base.jacobian;
    others.col(unknown_).setZero();
    VectorXd step = damped_step(others, base.residuals);
    VectorXd per_d = damped_step(others, base.jacobian.col(unknown_));
    per_d[unknown_] = 1.0;
    const VectorXd r = base.residuals + others * step;
    const VectorXd g = base.jacobian * per_d;
    const double a = std::max(g.squaredNorm(), 1e-9);
    const double b = g.dot(r);
    const double c = r.squaredNorm() - minimum_ - limit_;
    const double outwards = (std::sqrt(std::max(b * b - a * c, 0.0)) - side_ * b) / a;
    // Differences across a jump make the end seem near.
    const double least = rise_of(inside_) < 1.0 - kJump ? 2.0 * shortest_ : 0.0;
    const double d = side_ * std::min(std::max(outwards, least), farthest);
    step += d * per_d;
    step *= part * std::min(1.0, kLongest / step.norm());
    trial_ = base.angles + step;
    return side_ * (trial_[unknown_] - angle());
  }

  double minimum_;
  Index unknown_;
  double side_;
  double limit_;
  FitStep inside_;
  VectorXd trial_;
  double part_ = 1.0;  ///< fraction of the linearised model's step that a trial takes
  double shortest_ = 0.0;
  bool is_correction_ = false;  ///< the trial starts from a step outside the interval
  bool is_open_ = !is_at_bound();
};

/// Adds the intervals, all ends in parallel. Returns the step with the least chi2 of all trials.
FitStep add_intervals(const FitProblem& problem, Fit& fit) {
  constexpr int kMaxRounds = 40;
  std::vector<IntervalEnd> ends;
  for (Index i = 0; i < fit.covariance.rows(); ++i) {
    ends.emplace_back(fit.minimum, i, -1.0, fit.limit);
    ends.emplace_back(fit.minimum, i, 1.0, fit.limit);
  }
  FitStep least = fit.minimum;
  for (int round = 1; round <= kMaxRounds; ++round) {
    std::vector<IntervalEnd*> open;
    std::vector<VectorXd> places;
    for (IntervalEnd& end : ends) {
      if (end.is_open()) {
        open.push_back(&end);
        places.push_back(end.trial());
      }
    }
    if (open.empty()) {
      break;
    }
    const auto steps = steps_at(
        problem, places, fmt::format("intervals, round {}: {} ends open", round, open.size()));
    for (std::size_t i = 0; i < open.size(); ++i) {
      open[i]->take(steps[i]);
      least = steps[i].chi2 < least.chi2 ? steps[i] : least;
    }
  }
  for (std::size_t i = 0; i < fit.unknowns.size(); ++i) {
    const IntervalEnd& lower = ends[2 * i];
    const IntervalEnd& upper = ends[2 * i + 1];
    const auto value = [&](const IntervalEnd& end) {
      return end.is_at_bound() ? kNaN : problem.unknowns[i].value_at(end.angle());
    };
    fit.unknowns[i].estimate.from = value(lower);
    fit.unknowns[i].estimate.to = value(upper);
    fit.unknowns[i].is_cut = lower.is_cut() || upper.is_cut();
  }
  return least;
}

}  // namespace

double Fit::correlation(Index i, Index j) const {
  const double variances = covariance(i, i) * covariance(j, j);
  return variances > 0.0 ? covariance(i, j) / std::sqrt(variances) : 0.0;
}

Fit fit(const FitProblem& problem, bool is_scaled) {
  constexpr int kMaxStarts = 4;
  constexpr double kSmallerChi2 = 1e-4;  // minima that differ by less are the same
  problem.check();
  if (is_scaled && problem.measured.size() == index_of(problem.unknowns.size())) {
    throw InputError("the deviations can be scaled only with more measured numbers than unknowns");
  }
  Fit found;
  VectorXd start = best_start(problem);
  for (int i = 0; i < kMaxStarts; ++i) {
    found = fit_at(problem, minimise(problem, start), is_scaled);
    const FitStep least = add_intervals(problem, found);
    if (least.chi2 > found.minimum.chi2 - kSmallerChi2 - 0.01 * found.limit) {
      break;
    }
    start = least.angles;
  }
  return found;
}

}  // namespace oblique::client
