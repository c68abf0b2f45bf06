#include "client/explore/fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <Eigen/Dense>
#include <unsupported/Eigen/LevenbergMarquardt>

#include "client/io/console.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using solver::InputError;
using std::numbers::pi;

/// Angle of a central difference. Outputs of the solver are smooth to about 1e-7 of themselves, so
/// derivatives are good to about 1e-5.
constexpr double kDifference = 3e-3;
/// Residual of a missing prediction: large enough to have the step refused.
constexpr double kMissing = 1e9;
/// An unknown is at a bound if their angles differ by less.
constexpr double kAtBound = 1e-2;
/// 95 % quantile of chi2 with one degree of freedom.
constexpr double kChi2Quantile = 3.841458820694124;

Index index_of(std::size_t number) {
  return static_cast<Index>(number);
}

}  // namespace

double Unknown::value_at(double angle) const {
  const double share = (1.0 + std::cos(angle)) / 2.0;
  const double value = from > 0.0 ? from * std::pow(to / from, share) : from + share * (to - from);
  return std::clamp(value, from, to);
}

double Unknown::angle_of(double value) const {
  const double share =
      from > 0.0 ? std::log(value / from) / std::log(to / from) : (value - from) / (to - from);
  return 2.0 * pi - std::acos(std::clamp(2.0 * share - 1.0, -1.0, 1.0));
}

void FitProblem::check() const {
  for (const auto& [name, from, to, start] : unknowns) {
    if (!(from < start && start < to)) {
      throw InputError(name,
                       fmt::format("{} to {} with the start {}: the bounds must rise, and the "
                                   "start must be between them",
                                   solver::exact_number(from), solver::exact_number(to),
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

/// The model with derivatives at several vectors of angles, by one call of `evaluate`.
std::vector<FitStep> steps_at(const FitProblem& problem, const std::vector<VectorXd>& places,
                              const std::string& what) {
  const Index unknowns = index_of(problem.unknowns.size());
  std::vector<VectorXd> points;
  for (const VectorXd& angles : places) {
    for (Index i = 0; i < 2 * unknowns + 1; ++i) {
      VectorXd values = angles;
      if (i > 0) {
        values[(i - 1) / 2] += i % 2 == 1 ? -kDifference : kDifference;
      }
      for (std::size_t u = 0; u < problem.unknowns.size(); ++u) {
        values[index_of(u)] = problem.unknowns[u].value_at(values[index_of(u)]);
      }
      points.push_back(std::move(values));
    }
  }
  const auto predictions = problem.evaluate(points, what);
  std::vector<FitStep> steps;
  for (std::size_t p = 0, at = 0; p < places.size(); ++p) {
    FitStep& step = steps.emplace_back();
    step.angles = places[p];
    step.parameters = points[at];
    step.predictions = predictions[at++];
    step.is_complete = step.predictions.allFinite();
    step.residuals = ((step.predictions - problem.measured).array() / problem.sd.array())
                         .unaryExpr([](double r) { return std::isfinite(r) ? r : kMissing; });
    step.chi2 = step.residuals.squaredNorm();
    step.jacobian.resize(problem.measured.size(), unknowns);
    for (Index i = 0; i < unknowns; ++i, at += 2) {
      step.jacobian.col(i) =
          ((predictions[at + 1] - predictions[at]).array() / problem.sd.array() / kDifference / 2.0)
              .unaryExpr([](double slope) { return std::isfinite(slope) ? slope : 0.0; });
    }
  }
  return steps;
}

/// Gauss and Newton's step (J^T J + 1e-3) delta = -J^T r. The damping keeps combinations without
/// effect where they are.
VectorXd newton_step(const MatrixXd& jacobian, const VectorXd& residuals) {
  MatrixXd normal = jacobian.transpose() * jacobian;
  normal.diagonal().array() += 1e-3;
  return normal.ldlt().solve(-jacobian.transpose() * residuals);
}

/// By how much the linearised model lets chi2 fall.
double predicted_fall(const MatrixXd& jacobian, const VectorXd& residuals, const VectorXd& step) {
  return residuals.squaredNorm() - (residuals + jacobian * step).squaredNorm();
}

/// The problem in Eigen's form. Eigen requests derivatives only where it requested residuals last.
struct Residuals : public Eigen::DenseFunctor<double> {
  explicit Residuals(const FitProblem& fitted)
      : Eigen::DenseFunctor<double>(static_cast<int>(fitted.unknowns.size()),
                                    static_cast<int>(fitted.measured.size())),
        problem(fitted) {}

  int operator()(const VectorXd& angles, VectorXd& residuals) {
    last = steps_at(problem, {angles}, what).front();
    residuals = last.residuals;
    return 0;
  }
  int df(const VectorXd& /*angles*/, MatrixXd& jacobian) const {
    jacobian = last.jacobian;
    return 0;
  }

  const FitProblem& problem;
  std::string what{"start"};
  FitStep last;
};

}  // namespace

FitStep minimise(const FitProblem& problem, double tolerance,
                 const std::function<void(const FitStep&)>& after_each) {
  namespace Space = Eigen::LevenbergMarquardtSpace;
  constexpr int kMaxTrials = 200;
  problem.check();
  VectorXd angles(index_of(problem.unknowns.size()));
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
    angles[index_of(i)] = problem.unknowns[i].angle_of(problem.unknowns[i].start);
  }
  Residuals residuals(problem);
  Eigen::LevenbergMarquardt<Residuals> method(residuals);
  method.setFactor(0.1);  // the first step is at most this part of the vector of angles
  method.setExternalScaling(true);
  method.diag() = VectorXd::Ones(angles.size());
  method.setXtol(1e-7);
  method.setFtol(1e-9);
  method.setMaxfev(kMaxTrials);
  auto status = method.minimizeInit(angles);
  FitStep step = residuals.last;
  for (Index i = 0; i < step.predictions.size(); ++i) {
    if (!std::isfinite(step.predictions[i])) {
      throw solver::SolveError(problem.names[static_cast<std::size_t>(i)] +
                               ": the model has no such output at the start; give other starts");
    }
  }
  after_each(step);
  while ((status == Space::NotStarted || status == Space::Running) &&
         predicted_fall(step.jacobian, step.residuals, newton_step(step.jacobian, step.residuals)) >
             tolerance) {
    residuals.what = fmt::format("iteration {}, chi2 = {}", step.iteration + 1,
                                 solver::readable_number(step.chi2, 4));
    status = method.minimizeOneStep(angles);
    if (residuals.last.angles == angles) {  // else the last trial was refused
      residuals.last.iteration = step.iteration + 1;
      step = residuals.last;
      after_each(step);
    }
  }
  if (status == Space::TooManyFunctionEvaluation) {
    throw solver::SolveError(fmt::format("the fit has found no minimum in {} trials", kMaxTrials));
  }
  return step;
}

namespace {

/// Adds the covariance of the angles of the unknowns in `free` and what the data leave open. With
/// the columns of J scaled to length 1, J = U S V^T D, it is D^-1 V S^-2 V^T D^-1. A small singular
/// value is a combination that the data leave open; its unknowns are the large parts of its vector
/// in V.
void add_covariance(const FitProblem& problem, const std::vector<std::size_t>& free, Fit& fit) {
  constexpr double kUndetermined = 1e-3;     // singular value, from the noise of differences
  constexpr double kPoorlyDetermined = 0.1;  // as two unknowns with a correlation of 0.99
  constexpr double kLeastPart = 0.2;         // of a unit vector
  const MatrixXd columns = fit.minimum.jacobian(Eigen::all, free);
  const VectorXd shares = columns.colwise().norm().cwiseInverse();
  const Eigen::BDCSVD<MatrixXd> svd(columns * shares.asDiagonal(),
                                    Eigen::ComputeThinU | Eigen::ComputeThinV);
  const VectorXd& values = svd.singularValues();
  const MatrixXd root = shares.asDiagonal() * svd.matrixV() *
                        values.cwiseMax(kUndetermined / 10.0).cwiseInverse().asDiagonal();
  fit.covariance(free, free) = root * root.transpose();
  for (const std::size_t i : free) {
    const Index at = index_of(i);
    const auto value = [&](double change) {
      return problem.unknowns[i].value_at(fit.minimum.angles[at] + change);
    };
    const double slope = (value(kDifference) - value(-kDifference)) / (2.0 * kDifference);
    fit.unknowns[i].sd = slope * std::sqrt(fit.covariance(at, at) * fit.scale);
  }
  for (Index k = 0; k < values.size(); ++k) {
    if (values[k] >= kPoorlyDetermined) {
      continue;
    }
    auto& [unknowns, is_undetermined] =
        fit.combinations.emplace_back(Combination{{}, values[k] < kUndetermined});
    for (std::size_t i = 0; i < free.size(); ++i) {
      if (std::abs(svd.matrixV()(index_of(i), k)) > kLeastPart) {
        unknowns.push_back(free[i]);
        fit.unknowns[free[i]].sd = is_undetermined ? kNaN : fit.unknowns[free[i]].sd;
      }
    }
  }
}

/// The result at a minimum, without intervals.
Fit fit_at(const FitProblem& problem, const FitStep& minimum, bool is_scaled) {
  constexpr double kLeastEffect = 0.1;  // of the whole range [standard deviations]
  constexpr double kLeastScale = 1e-6;  // exact data: chi2 is the noise of the differences
  Fit fit;
  fit.minimum = minimum;
  fit.unknowns.resize(problem.unknowns.size());
  fit.covariance = MatrixXd::Zero(minimum.angles.size(), minimum.angles.size());
  fit.degrees_of_freedom =
      static_cast<std::size_t>(minimum.jacobian.rows() - minimum.jacobian.cols());
  if (is_scaled) {
    fit.scale = std::max(minimum.chi2 / static_cast<double>(fit.degrees_of_freedom), kLeastScale);
  }
  std::vector<std::size_t> free;
  for (std::size_t i = 0; i < fit.unknowns.size(); ++i) {
    auto& unknown = fit.unknowns[i];
    unknown.estimate.value = minimum.parameters[index_of(i)];
    unknown.is_at_bound = std::abs(std::sin(minimum.angles[index_of(i)])) < kAtBound;
    unknown.has_effect = minimum.jacobian.col(index_of(i)).norm() * pi >= kLeastEffect;
    if (!unknown.is_at_bound && unknown.has_effect) {
      free.push_back(i);
    }
  }
  if (!free.empty()) {
    add_covariance(problem, free, fit);
  }
  return fit;
}

/// Searches one end of a profile-likelihood interval, one trial at a time. The root of the rise of
/// chi2, f(w) = sqrt((least chi2 with the angle w - chi2) / limit), is 0 at the minimum and 1 at
/// the end, and linear where the residuals are. Trials go outwards until f > 1, then divide the
/// bracket. Each starts from the linearised model at the last angle with f < 1; steps of Gauss and
/// Newton in the other angles correct it.
class IntervalEnd {
 public:
  /// `side` is -1 for the lower end, 1 for the upper one.
  IntervalEnd(const FitStep& minimum, Index unknown, double side, double limit, double variance)
      : minimum_(minimum),
        unknown_(unknown),
        side_(side),
        limit_(limit),
        least_(minimum.angles[unknown]),
        bound_(side < 0.0 ? pi : 2.0 * pi),
        usual_distance_(std::min(variance > 0.0 ? std::sqrt(limit * variance) : kWithoutVariance,
                                 std::abs(bound_ - least_))),
        inside_(minimum),
        is_open_(std::abs(bound_ - least_) >= kAtBound) {
    try_at(outwards(usual_distance_ / 2.0));
  }

  bool is_open() const { return is_open_; }
  const VectorXd& trial() const { return trial_; }
  /// The last angle inside the interval; nothing if no angle outside was found.
  std::optional<double> angle() const {
    return outside_angle_ ? std::optional(inside_.angles[unknown_]) : std::nullopt;
  }
  bool is_cut() const { return is_cut_; }

  void take(const FitStep& step) {
    constexpr int kMaxCorrections = 4;
    constexpr double kSmallFall = 2e-3;  // of the limit
    const bool is_better = step.chi2 < best_.chi2 - kSmallFall * limit_;
    if (step.chi2 < best_.chi2) {
      best_ = step;
    }
    if (is_better && best_.is_complete && corrections_ < kMaxCorrections &&
        correct(best_, kSmallFall * limit_)) {
      ++corrections_;
      return;
    }
    judge();
  }

 private:
  static constexpr double kWithoutVariance = 0.6;

  double outwards(double distance) const {
    return least_ + side_ * std::min(distance, std::abs(bound_ - least_));
  }

  /// The next trial, at angle `w` of the unknown.
  void try_at(double w) {
    FitStep shifted = inside_;
    shifted.residuals += inside_.jacobian.col(unknown_) * (w - inside_.angles[unknown_]);
    shifted.angles[unknown_] = w;
    trial_ = shifted.angles;
    correct(shifted, 0.0);
    best_ = {};
    best_.chi2 = HUGE_VAL;
    corrections_ = 0;
  }

  /// Makes the Gauss-Newton step from `step` in the other angles the next trial. Returns false if
  /// chi2 would fall by less than `least_fall`.
  bool correct(const FitStep& step, double least_fall) {
    constexpr double kLongest = 0.5;
    MatrixXd others = step.jacobian;
    others.col(unknown_).setZero();
    VectorXd delta = newton_step(others, step.residuals);
    if (predicted_fall(others, step.residuals, delta) < least_fall) {
      return false;
    }
    delta *= std::min(1.0, kLongest / std::max(delta.norm(), kLongest));
    trial_ = (step.angles + delta).cwiseMax(pi + kAtBound).cwiseMin(2.0 * pi - kAtBound);
    trial_[unknown_] = step.angles[unknown_];
    return true;
  }

  double root_of_rise(double chi2) const {
    return std::sqrt(std::max(chi2 - minimum_.chi2, 0.0) / limit_);
  }

  /// Decides on which side of the end the last angle is, and where to go on.
  void judge() {
    constexpr double kTolerance = 2e-3;        // of f
    constexpr double kSmallestBracket = 5e-3;  // of the distance to the minimum, or the usual one
    constexpr double kJump = 0.1;              // of f, within the smallest bracket
    const double w = trial_[unknown_];
    const double f = root_of_rise(best_.chi2);
    if (f > 1.0) {
      outside_angle_ = w;
      outside_f_ = f;
    } else {
      inside_ = best_;
    }
    const bool is_end = std::abs(f - 1.0) < kTolerance;
    if (is_end) {
      inside_.angles[unknown_] = w;
      outside_angle_ = w;
    }
    if (is_end || (f <= 1.0 && std::abs(w - bound_) < 1e-9)) {
      is_open_ = false;
      return;
    }
    if (!outside_angle_) {
      try_at(outwards(std::clamp(1.05 / std::max(f, 1e-3), 1.1, 2.0) * std::abs(w - least_)));
      return;
    }
    const double inside_f = root_of_rise(inside_.chi2);
    const double width = *outside_angle_ - inside_.angles[unknown_];
    if (std::abs(width) <
        kSmallestBracket * std::max(std::abs(*outside_angle_ - least_), usual_distance_)) {
      is_cut_ = outside_f_ - inside_f > kJump;
      is_open_ = false;
      return;
    }
    // Halves where the straight line between the ends does not halve the bracket: f has a step.
    const bool is_slow = std::abs(width) > std::exchange(last_width_, std::abs(width)) / 2.0;
    const double part = is_slow ? 0.5 : (1.0 - inside_f) / (outside_f_ - inside_f);
    try_at(inside_.angles[unknown_] + std::clamp(part, 0.05, 0.95) * width);
  }

  const FitStep& minimum_;
  Index unknown_;
  double side_;
  double limit_;
  double least_;
  double bound_;
  double usual_distance_;  ///< of the end, by the covariance
  FitStep inside_;         ///< best trial at the farthest angle with f < 1
  std::optional<double> outside_angle_;
  double outside_f_ = HUGE_VAL;
  double last_width_ = HUGE_VAL;
  VectorXd trial_;
  FitStep best_;
  int corrections_ = 0;
  bool is_open_;
  bool is_cut_ = false;
};

/// Fills in the intervals, all ends side by side. Returns the step with the least chi2 if that is
/// below the minimum; with `ends_early` it returns it at once.
std::optional<FitStep> add_intervals(const FitProblem& problem, bool ends_early, Fit& fit) {
  constexpr int kMaxRounds = 40;
  constexpr double kSmallerChi2 = 1e-4;  // less is the same minimum
  const double limit = kChi2Quantile * fit.scale;
  std::vector<IntervalEnd> ends;
  for (Index i = 0; i < fit.covariance.rows(); ++i) {
    ends.emplace_back(fit.minimum, i, -1.0, limit, fit.covariance(i, i));
    ends.emplace_back(fit.minimum, i, 1.0, limit, fit.covariance(i, i));
  }
  std::optional<FitStep> better;
  double least = fit.minimum.chi2 - kSmallerChi2 - 0.01 * limit;
  for (int round = 1; round <= kMaxRounds && !(ends_early && better); ++round) {
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
      if (steps[i].chi2 < least) {
        least = steps[i].chi2;
        better = steps[i];
      }
    }
  }
  for (std::size_t i = 0; i < fit.unknowns.size(); ++i) {
    const auto value = [&](const IntervalEnd& end) {
      return end.angle() ? problem.unknowns[i].value_at(*end.angle()) : kNaN;
    };
    auto& unknown = fit.unknowns[i];
    unknown.estimate.from = value(ends[2 * i]);
    unknown.estimate.to = value(ends[2 * i + 1]);
    unknown.is_cut = ends[2 * i].is_cut() || ends[2 * i + 1].is_cut();
  }
  return better;
}

}  // namespace

double Fit::correlation(Index i, Index j) const {
  const double variances = covariance(i, i) * covariance(j, j);
  return variances > 0.0 ? covariance(i, j) / std::sqrt(variances) : 0.0;
}

Fit fit(FitProblem problem, bool is_scaled) {
  constexpr int kMaxStarts = 4;
  if (is_scaled && problem.measured.size() == index_of(problem.unknowns.size())) {
    throw InputError("the deviations can be scaled only with more measured numbers than unknowns");
  }
  for (int start = 1;; ++start) {
    Fit found = fit_at(problem, minimise(problem), is_scaled);
    const auto better = add_intervals(problem, start < kMaxStarts, found);
    if (!better || start == kMaxStarts) {
      found.has_other_minimum = better.has_value();
      return found;
    }
    for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
      problem.unknowns[i].start = better->parameters[index_of(i)];
    }
  }
}

}  // namespace oblique::client
