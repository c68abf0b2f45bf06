#include "client/explore/fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <Eigen/Dense>
#include <unsupported/Eigen/LevenbergMarquardt>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using solver::exact_number;
using solver::InputError;
using solver::readable_number;
using std::numbers::pi;

/// Angle of a central difference. Outputs of the solver are smooth to about 1e-7 of themselves, so
/// that derivatives are good to about 1e-5.
constexpr double kDifference = 3e-3;
/// The first step of a minimisation is at most this part of the vector of the angles, which are
/// between pi and 2 pi.
constexpr double kFirstStep = 0.1;
/// Residual of a missing prediction: large enough to have the step refused.
constexpr double kMissing = 1e9;
/// A minimum whose angle is this near to that of a bound counts as at the bound.
constexpr double kAtBound = 1e-2;
/// 95 % quantile of chi2 with one degree of freedom.
constexpr double kChi2Quantile = 3.841458820694124;
/// An unknown whose whole range changes the residuals by less, in standard deviations, has no
/// effect.
constexpr double kLeastEffect = 0.1;
/// Smallest singular value, of the Jacobian with columns of length 1, that is above the noise of
/// the differences.
constexpr double kLeastSingularValue = 1e-3;
/// Part of a unit vector from which on an unknown belongs to an undetermined combination.
constexpr double kLeastPart = 0.1;
constexpr double kLargestCorrelation = 0.99;
/// A chi2 that is smaller by less than this is the same minimum.
constexpr double kSmallerChi2 = 1e-4;
/// Least factor of variances: of exact data chi2 is the noise of the differences.
constexpr double kLeastScale = 1e-6;

Index index_of(std::size_t number) {
  return static_cast<Index>(number);
}

}  // namespace

double Unknown::usual_start(double from, double to) {
  return from > 0.0 ? std::sqrt(from) * std::sqrt(to) : from + (to - from) / 2.0;
}

Unknown::Scale Unknown::scale() const {
  const bool is_logarithmic = from > 0.0;
  const double low = is_logarithmic ? std::log(from) : from;
  const double high = is_logarithmic ? std::log(to) : to;
  return {is_logarithmic, (low + high) / 2.0, (high - low) / 2.0};
}

double Unknown::value_at(double angle) const {
  const auto [is_logarithmic, middle, half] = scale();
  const double value = middle + half * std::cos(angle);
  return std::clamp(is_logarithmic ? std::exp(value) : value, from, to);
}

double Unknown::angle_of(double value) const {
  const auto [is_logarithmic, middle, half] = scale();
  const double cosine = ((is_logarithmic ? std::log(value) : value) - middle) / half;
  return 2.0 * pi - std::acos(std::clamp(cosine, -1.0, 1.0));
}

double Unknown::slope_at(double angle) const {
  const auto [is_logarithmic, middle, half] = scale();
  return -half * std::sin(angle) * (is_logarithmic ? value_at(angle) : 1.0);
}

void FitProblem::check() const {
  if (unknowns.empty()) {
    throw InputError("nothing is to be fitted: at least one unknown is needed");
  }
  for (const Unknown& unknown : unknowns) {
    const auto range = fmt::format("{} = {} to {}", unknown.name, exact_number(unknown.from),
                                   exact_number(unknown.to));
    if (!(unknown.from < unknown.to)) {
      throw InputError(unknown.name, range + ": the lower bound must be below the upper one");
    }
    if (!(unknown.from < unknown.start && unknown.start < unknown.to)) {
      throw InputError(
          unknown.name,
          fmt::format("{}: the start {} must be between the bounds and at neither of them", range,
                      exact_number(unknown.start)));
    }
  }
  for (Index i = 0; i < measured.size(); ++i) {
    if (!(sd[i] > 0.0) || !std::isfinite(sd[i])) {
      throw InputError(fmt::format("{}: the standard deviation {} must be positive",
                                   names[static_cast<std::size_t>(i)], exact_number(sd[i])));
    }
  }
  if (index_of(unknowns.size()) > measured.size()) {
    throw InputError(
        fmt::format("{} unknowns cannot be determined by {} measured numbers: at least as many "
                    "numbers as unknowns are needed",
                    unknowns.size(), measured.size()));
  }
}

namespace {

/// The residuals of a problem and their derivatives by the angles of some of its unknowns; the
/// other angles are fixed.
class Residuals : public Eigen::DenseFunctor<double> {
 public:
  Residuals(const FitProblem& problem, VectorXd angles, std::vector<Index> free)
      : Eigen::DenseFunctor<double>(static_cast<int>(free.size()),
                                    static_cast<int>(problem.measured.size())),
        problem_(problem),
        angles_(std::move(angles)),
        free_(std::move(free)) {}

  /// Names the next calls of `evaluate`, for progress messages.
  void describe(std::string what) { what_ = std::move(what); }

  int operator()(const VectorXd& x, VectorXd& residuals) {
    residuals = at(x).residuals;
    return 0;
  }

  int df(const VectorXd& x, MatrixXd& jacobian) {
    jacobian = at(x).jacobian;
    return 0;
  }

  VectorXd all_angles(const VectorXd& x) const {
    VectorXd angles = angles_;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      angles[free_[i]] = x[index_of(i)];
    }
    return angles;
  }

  VectorXd free_angles() const {
    VectorXd x(index_of(free_.size()));
    for (std::size_t i = 0; i < free_.size(); ++i) {
      x[index_of(i)] = angles_[free_[i]];
    }
    return x;
  }

  VectorXd parameters_at(const VectorXd& x) const {
    VectorXd values = all_angles(x);
    for (Index i = 0; i < values.size(); ++i) {
      values[i] = problem_.unknowns[static_cast<std::size_t>(i)].value_at(values[i]);
    }
    return values;
  }

  struct Evaluation {
    VectorXd x;
    VectorXd predictions;
    VectorXd residuals;
    MatrixXd jacobian;
  };

  /// Solved once for each x.
  const Evaluation& at(const VectorXd& x) {
    const auto known =
        std::ranges::find_if(evaluations_, [&](const Evaluation& each) { return each.x == x; });
    return known != evaluations_.end() ? *known : evaluations_.emplace_back(evaluated(x));
  }

 private:
  Evaluation evaluated(const VectorXd& x) const {
    std::vector<VectorXd> points{parameters_at(x)};
    for (Index i = 0; i < x.size(); ++i) {
      for (const double side : {-1.0, 1.0}) {
        VectorXd disturbed = x;
        disturbed[i] += side * kDifference;
        points.push_back(parameters_at(disturbed));
      }
    }
    const auto predictions = problem_.evaluate(points, what_);
    Evaluation evaluation{
        x, predictions.front(), {}, MatrixXd(predictions.front().size(), x.size())};
    const VectorXd& here = evaluation.predictions;
    evaluation.residuals =
        ((here - problem_.measured).array() / problem_.sd.array()).unaryExpr([](double r) {
          return std::isfinite(r) ? r : kMissing;
        });
    for (Index i = 0; i < x.size(); ++i) {
      const VectorXd& below = predictions[static_cast<std::size_t>(2 * i + 1)];
      const VectorXd& above = predictions[static_cast<std::size_t>(2 * i + 2)];
      for (Index row = 0; row < here.size(); ++row) {
        const double sd = problem_.sd[row];
        evaluation.jacobian(row, i) =
            derivative((here[row] - below[row]) / sd, (above[row] - here[row]) / sd);
      }
    }
    return evaluation;
  }

  /// The derivative from the changes over one step below and one above: the central difference. If
  /// one change is missing, or one is so much larger that an output jumps there (as where the mode
  /// changes), the one-sided difference of the other; 0 if both are missing.
  static double derivative(double below, double above) {
    constexpr double kJump = 0.1;  // [standard deviations]
    constexpr double kTimes = 5.0;
    if (!std::isfinite(below) || !std::isfinite(above)) {
      const double known = std::isfinite(below) ? below : above;
      return std::isfinite(known) ? known / kDifference : 0.0;
    }
    const double least = std::abs(below) < std::abs(above) ? below : above;
    const double largest = std::max(std::abs(below), std::abs(above));
    if (std::abs(above - below) > kJump && largest > kTimes * std::abs(least)) {
      return least / kDifference;
    }
    return (above + below) / (2.0 * kDifference);
  }

  const FitProblem& problem_;
  VectorXd angles_;
  std::vector<Index> free_;
  std::string what_;
  std::vector<Evaluation> evaluations_;
};

/// Decrease of chi2 that the linearised model predicts: the squared length of the projection of the
/// residuals on the columns of the Jacobian.
double predicted_fall(const MatrixXd& jacobian, const VectorXd& residuals) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(jacobian);
  const VectorXd rotated = qr.householderQ().adjoint() * residuals;
  return rotated.head(qr.rank()).squaredNorm();
}

VectorXd start_angles(const FitProblem& problem) {
  VectorXd angles(index_of(problem.unknowns.size()));
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
    angles[index_of(i)] = problem.unknowns[i].angle_of(problem.unknowns[i].start);
  }
  return angles;
}

[[noreturn]] void throw_missing(const FitProblem& problem, const FitStep& step) {
  std::string values;
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
    values += fmt::format("{}{} = {}", i == 0 ? "" : ", ", problem.unknowns[i].name,
                          readable_number(step.parameters[index_of(i)]));
  }
  for (Index i = 0; i < step.predictions.size(); ++i) {
    if (!std::isfinite(step.predictions[i])) {
      throw solver::SolveError(
          fmt::format("{}: the model has no such output with {}; start from other values",
                      problem.names[static_cast<std::size_t>(i)], values));
    }
  }
  throw solver::SolveError("predictions are missing with " + values);
}

/// When a minimisation ends.
struct Stop {
  double tolerance;           ///< of the predicted fall of chi2
  double relative_tolerance;  ///< of chi2
  int most_trials;            ///< of steps, refused ones included
  bool may_run_out = false;   ///< of trials; else that is an error
};
constexpr Stop kAtMinimum{1e-6, 1e-9, 200};
/// In a profile, where chi2 is 3.84 above the minimum and matters to 1e-3.
constexpr Stop kInProfile{1e-3, 1e-4, 12, true};

/// Minimises over the angles of the unknowns in `free`, from `angles`, which fix the others.
FitStep minimise_over(const FitProblem& problem, const VectorXd& angles,
                      const std::vector<Index>& free, const Stop& stop, const std::string& what,
                      const std::function<void(const FitStep&)>& after_each) {
  Residuals residuals(problem, angles, free);
  VectorXd x = residuals.free_angles();
  residuals.describe(what.empty() ? "start" : what);
  const auto step_at = [&](int iteration) {
    const auto& here = residuals.at(x);
    return FitStep{iteration,        residuals.all_angles(x), residuals.parameters_at(x),
                   here.predictions, here.jacobian,           here.residuals.squaredNorm()};
  };
  FitStep step = step_at(0);
  if (!step.predictions.allFinite()) {
    throw_missing(problem, step);
  }
  const auto report = [&] {
    if (after_each) {
      after_each(step);
    }
  };
  report();
  if (free.empty()) {
    return step;
  }
  Eigen::LevenbergMarquardt<Residuals> method(residuals);
  method.setFactor(kFirstStep);
  method.setExternalScaling(true);
  method.diag() = VectorXd::Ones(x.size());
  method.setXtol(1e-7);
  method.setFtol(stop.relative_tolerance);
  method.setMaxfev(stop.most_trials);
  auto status = method.minimizeInit(x);
  while ((status == Eigen::LevenbergMarquardtSpace::NotStarted ||
          status == Eigen::LevenbergMarquardtSpace::Running) &&
         predicted_fall(step.jacobian, residuals.at(x).residuals) > stop.tolerance) {
    residuals.describe(fmt::format("{}iteration {}, chi2 = {}", what.empty() ? "" : what + ": ",
                                   step.iteration + 1, readable_number(step.chi2, 4)));
    status = method.minimizeOneStep(x);
    step = step_at(step.iteration + 1);
    report();
  }
  if (status == Eigen::LevenbergMarquardtSpace::TooManyFunctionEvaluation && !stop.may_run_out) {
    throw solver::SolveError(
        fmt::format("the fit has found no minimum in {} trials", stop.most_trials));
  }
  return step;
}

std::vector<Index> all_but(std::size_t count, std::optional<Index> fixed = {}) {
  std::vector<Index> numbers;
  for (Index i = 0; i < index_of(count); ++i) {
    if (i != fixed) {
      numbers.push_back(i);
    }
  }
  return numbers;
}

/// Which unknowns the data determine at a minimum, from the Jacobian.
struct Information {
  MatrixXd covariance;  ///< of the angles; 0 for unknowns at a bound and without effect
  MatrixXd correlation;
  std::vector<Index> free;  ///< unknowns neither at a bound nor without effect
  std::vector<std::size_t> without_effect;
  std::vector<std::vector<std::size_t>> inseparable;
};

bool is_at_bound(double angle) {
  return std::abs(std::sin(angle)) < kAtBound;
}

/// With the columns of J scaled to length 1, J = U S V^T D, and the covariance is D^-1 V S^-2 V^T
/// D^-1. A singular value no larger than the noise of the differences belongs to a combination of
/// unknowns that the data do not determine: those with large components in its vector of V.
Information information_of(const FitStep& minimum) {
  Information found;
  const MatrixXd& jacobian = minimum.jacobian;
  const Index unknowns = jacobian.cols();
  found.covariance = MatrixXd::Zero(unknowns, unknowns);
  found.correlation = MatrixXd::Zero(unknowns, unknowns);
  for (Index i = 0; i < unknowns; ++i) {
    if (is_at_bound(minimum.angles[i])) {
      continue;
    }
    if (jacobian.col(i).norm() * pi < kLeastEffect) {
      found.without_effect.push_back(static_cast<std::size_t>(i));
    } else {
      found.free.push_back(i);
    }
  }
  if (found.free.empty()) {
    return found;
  }
  const MatrixXd columns = jacobian(Eigen::all, found.free);
  const VectorXd lengths = columns.colwise().norm();
  const Eigen::BDCSVD<MatrixXd> svd(columns * lengths.cwiseInverse().asDiagonal(),
                                    Eigen::ComputeThinU | Eigen::ComputeThinV);
  const VectorXd values = svd.singularValues().cwiseMax(kLeastSingularValue / 10.0);
  for (Index k = 0; k < values.size(); ++k) {
    if (svd.singularValues()[k] < kLeastSingularValue) {
      auto& combination = found.inseparable.emplace_back();
      for (Index i = 0; i < lengths.size(); ++i) {
        if (std::abs(svd.matrixV()(i, k)) > kLeastPart) {
          combination.push_back(static_cast<std::size_t>(found.free[static_cast<std::size_t>(i)]));
        }
      }
    }
  }
  const MatrixXd half =
      lengths.cwiseInverse().asDiagonal() * svd.matrixV() * values.cwiseInverse().asDiagonal();
  const MatrixXd covariance = half * half.transpose();
  const VectorXd deviations = covariance.diagonal().cwiseSqrt();
  found.covariance(found.free, found.free) = covariance;
  found.correlation(found.free, found.free) =
      deviations.cwiseInverse().asDiagonal() * covariance * deviations.cwiseInverse().asDiagonal();
  return found;
}

/// Searches the ends of profile-likelihood intervals: the values of w where
/// f(w) = sqrt((min chi2 with w fixed - chi2) / limit) is 1. At the minimum f is 0. If the
/// residuals are linear in the unknowns, f is linear in w, too.
class Profile {
 public:
  Profile(const FitProblem& problem, const FitStep& minimum, const Information& information,
          double limit)
      : problem_(problem), minimum_(minimum), information_(information), limit_(limit) {}

  /// The angle at which the interval of unknown `j` ends below (`side` -1) or above (1) the
  /// minimum; nothing if it reaches the bound. Stops early if it finds `better_angles`.
  std::optional<double> end(Index j, double side) {
    constexpr int kMostSteps = 40;
    constexpr double kTolerance = 2e-3;        // of f
    constexpr double kSmallestBracket = 1e-3;  // of the distance to the minimum
    const double least = minimum_.angles[j];
    const double bound = side < 0.0 ? pi : 2.0 * pi;
    if (std::abs(bound - least) < kAtBound) {
      return {};
    }
    inside_ = {least, 0.0, minimum_.angles};
    outside_.reset();
    double w = first_step(j, side, bound);
    double width = HUGE_VAL;
    for (int step = 0; step < kMostSteps && better_.size() == 0; ++step) {
      const Trial trial = tried(j, w, side);
      if (std::abs(trial.f - 1.0) < kTolerance) {
        return w;
      }
      if (trial.f < 1.0 && w == bound) {
        return {};
      }
      if (trial.f < 1.0) {
        inside_ = trial;
      } else {
        outside_ = trial;
      }
      if (!outside_) {
        const double growth = std::clamp(1.05 / std::max(trial.f, 1e-3), 1.1, 3.0);
        w = least + side * std::min(growth * std::abs(w - least), std::abs(bound - least));
        continue;
      }
      const double last_width = std::exchange(width, outside_->w - inside_.w);
      if (std::abs(width) < kSmallestBracket * std::abs(outside_->w - least)) {
        return inside_.w;
      }
      // By halves where the straight line between the ends does not halve the bracket: f has a
      // step.
      const bool is_slow = std::abs(width) > std::abs(last_width) / 2.0;
      const double part = (1.0 - inside_.f) / (outside_->f - inside_.f);
      w = inside_.w + (is_slow ? 0.5 : std::clamp(part, 0.05, 0.95)) * width;
    }
    return inside_.w;
  }

  /// A point of smaller chi2 than the minimum, if one was found; else empty.
  const VectorXd& better_angles() const { return better_; }

 private:
  struct Trial {
    double w;
    double f;
    VectorXd angles;
  };

  double first_step(Index j, double side, double bound) const {
    constexpr double kWithoutVariance = 0.3;
    const double variance = information_.covariance(j, j);
    const double step = variance > 0.0 ? std::sqrt(limit_ * variance) : kWithoutVariance;
    return minimum_.angles[j] + side * std::min(step, std::abs(bound - minimum_.angles[j]));
  }

  /// The least chi2 with unknown `j` at `w`, from where the linearised model has the others.
  Trial tried(Index j, double w, double side) {
    VectorXd angles = inside_.angles;
    if (const double variance = information_.covariance(j, j); variance > 0.0) {
      angles += information_.covariance.col(j) / variance * (w - inside_.w);
    }
    angles = angles.cwiseMax(pi + kAtBound).cwiseMin(2.0 * pi - kAtBound);
    angles[j] = w;
    const auto& name = problem_.unknowns[static_cast<std::size_t>(j)].name;
    try {
      const FitStep step = minimise_over(
          problem_, angles, all_but(problem_.unknowns.size(), j), kInProfile,
          fmt::format("interval of {}, {} end", name, side < 0.0 ? "lower" : "upper"), {});
      const double rise = step.chi2 - minimum_.chi2;
      if (rise < -kSmallerChi2 - 0.01 * limit_) {
        better_ = step.angles;
      }
      return {w, std::sqrt(std::max(rise, 0.0) / limit_), step.angles};
    } catch (const solver::SolveError&) {
      // At this point the model has no value of a measured output.
      return {w, std::numeric_limits<double>::infinity(), angles};
    }
  }

  const FitProblem& problem_;
  const FitStep& minimum_;
  const Information& information_;
  double limit_;
  Trial inside_{};
  std::optional<Trial> outside_;
  VectorXd better_;
};

bool is_in(const std::vector<std::vector<std::size_t>>& sets, std::size_t number) {
  return std::ranges::any_of(
      sets, [number](const auto& set) { return std::ranges::find(set, number) != set.end(); });
}

/// Values, deviations and correlations at a minimum, still without intervals.
Fit fit_at(const FitProblem& problem, FitStep minimum, const Information& information,
           bool is_scaled) {
  Fit fit;
  fit.degrees_of_freedom =
      static_cast<std::size_t>(problem.measured.size()) - problem.unknowns.size();
  fit.scale = is_scaled ? minimum.chi2 / static_cast<double>(fit.degrees_of_freedom) : 1.0;
  fit.correlation = information.correlation;
  fit.without_effect = information.without_effect;
  fit.inseparable = information.inseparable;
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
    const double angle = minimum.angles[index_of(i)];
    auto& estimate = fit.estimates.emplace_back();
    estimate.value = minimum.parameters[index_of(i)];
    estimate.is_at_bound = is_at_bound(angle);
    const double variance = information.covariance(index_of(i), index_of(i)) * fit.scale;
    if (variance > 0.0 && !is_in(fit.inseparable, i)) {
      estimate.sd = std::abs(problem.unknowns[i].slope_at(angle)) * std::sqrt(variance);
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (std::abs(fit.correlation(index_of(i), index_of(j))) > kLargestCorrelation &&
          !(is_in(fit.inseparable, i) && is_in(fit.inseparable, j))) {
        fit.correlated.emplace_back(j, i);
      }
    }
  }
  fit.minimum = std::move(minimum);
  return fit;
}

/// Fills in the intervals. Returns false, with the angles from which to start again, when a smaller
/// chi2 was found.
bool add_intervals(const FitProblem& problem, const Information& information, Fit& fit,
                   VectorXd& angles) {
  Profile profile(problem, fit.minimum, information, kChi2Quantile * fit.scale);
  for (std::size_t i = 0; i < problem.unknowns.size(); ++i) {
    const auto end = [&](double side) -> std::optional<double> {
      const auto angle = profile.end(index_of(i), side);
      return angle ? std::optional(problem.unknowns[i].value_at(*angle)) : std::nullopt;
    };
    fit.estimates[i].lower = end(-1.0);
    fit.estimates[i].upper = end(1.0);
    if (profile.better_angles().size() > 0) {
      angles = profile.better_angles();
      return false;
    }
  }
  return true;
}

}  // namespace

FitStep minimise(const FitProblem& problem, double tolerance,
                 const std::function<void(const FitStep&)>& after_each) {
  problem.check();
  Stop stop = kAtMinimum;
  stop.tolerance = tolerance;
  return minimise_over(problem, start_angles(problem), all_but(problem.unknowns.size()), stop, "",
                       after_each);
}

Fit fit(const FitProblem& problem, bool is_scaled) {
  constexpr int kMostStarts = 5;
  problem.check();
  if (is_scaled && problem.measured.size() == index_of(problem.unknowns.size())) {
    throw InputError("the deviations can be scaled only with more measured numbers than unknowns");
  }
  VectorXd angles = start_angles(problem);
  for (int start = 1;; ++start) {
    const FitStep minimum =
        minimise_over(problem, angles, all_but(problem.unknowns.size()), kAtMinimum, "", {});
    const Information information = information_of(minimum);
    Fit result = fit_at(problem, minimum, information, is_scaled);
    if (add_intervals(problem, information, result, angles)) {
      return result;
    }
    if (start == kMostStarts) {
      throw solver::SolveError(fmt::format(
          "the fit has found smaller minima {} times: chi2 has many; start from other values",
          start));
    }
  }
}

}  // namespace oblique::client
