#include "client/paper/parameter_fit.h"

#include <cmath>
#include <span>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <unsupported/Eigen/LevenbergMarquardt>

#include "worker/solver/fall_cache.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostIterations = 50;
constexpr double kSmallestStep = 1e-5;
constexpr double kSmallestGain = 1e-3;
/// Of a parameter, for derivatives: the outputs are smooth to about 1e-7 of themselves.
constexpr double kDifferenceStep = 1e-4;

/// Every published number beside what each of the models gives. Falls that `falls` does not keep
/// are solved together.
std::vector<std::vector<Difference>> differences_of(const PublishedTable& published,
                                                    std::span<const solver::ModelParameters> models,
                                                    solver::FallCache& falls) {
  std::vector<solver::Finger> fingers;
  for (std::size_t i = 0; i < models.size(); ++i) {
    const auto fall = falls.fall(models[i], models.subspan(i));
    if (!fall.fallen) {
      throw solver::SolveError(fall.error);
    }
    fingers.emplace_back(models[i], fall.fallen);
  }
  std::vector<std::vector<Difference>> differences;
  for (const auto& cases : solved_cases(published, fingers)) {
    differences.push_back(compare(published, cases));
  }
  return differences;
}

/// r_i(x) = ours_i / published_i - 1 with the parameters start exp(x).
class Residuals : public Eigen::DenseFunctor<double> {
 public:
  Residuals(const PublishedTable& published, const solver::ModelParameters& start, int values,
            solver::FallCache& falls)
      : Eigen::DenseFunctor<double>(int{kFittedKeys.size()}, values),
        published_(published),
        start_(start),
        falls_(falls) {}

  solver::ModelParameters model_at(const VectorXd& x) const {
    auto model = start_;
    for (std::size_t i = 0; i < kFittedKeys.size(); ++i) {
      const auto& key = *solver::find_model_key(kFittedKeys[i]);
      key.set(model, key.get(start_) * std::exp(x[static_cast<Index>(i)]));
    }
    return model;
  }

  static VectorXd of(const std::vector<Difference>& differences) {
    VectorXd residuals(static_cast<Index>(differences.size()));
    for (std::size_t i = 0; i < differences.size(); ++i) {
      const auto percent = differences[i].percent();
      residuals[static_cast<Index>(i)] = percent ? *percent / 100.0 : -1.0;
    }
    return residuals;
  }

  int operator()(const VectorXd& x, VectorXd& residuals) const {
    const solver::ModelParameters model = model_at(x);
    residuals = of(differences_of(published_, {&model, 1}, falls_).front());
    return 0;
  }

  int df(const VectorXd& x, MatrixXd& jacobian) const {
    std::vector<solver::ModelParameters> models{model_at(x)};
    for (Index i = 0; i < Index{kFittedKeys.size()}; ++i) {
      VectorXd disturbed = x;
      disturbed[i] += kDifferenceStep;
      models.push_back(model_at(disturbed));
    }
    const auto differences = differences_of(published_, models, falls_);
    const VectorXd here = of(differences.front());
    for (std::size_t i = 0; i < kFittedKeys.size(); ++i) {
      jacobian.col(static_cast<Index>(i)) = (of(differences[i + 1]) - here) / kDifferenceStep;
    }
    return 0;
  }

 private:
  const PublishedTable& published_;
  const solver::ModelParameters& start_;
  solver::FallCache& falls_;
};

}  // namespace

FitStep fit_parameters(const PublishedTable& published, const solver::ModelParameters& start,
                       const std::function<void(const FitStep&)>& after_each) {
  solver::FallCache falls;
  const auto step_at = [&](int iteration, const solver::ModelParameters& model) {
    auto differences = differences_of(published, {&model, 1}, falls).front();
    const auto summary = summary_of(differences);
    return FitStep{iteration, model, std::move(differences), summary};
  };
  FitStep step = step_at(0, start);
  after_each(step);
  Residuals residuals(published, start, static_cast<int>(step.differences.size()), falls);
  Eigen::LevenbergMarquardt<Residuals> method(residuals);
  method.setXtol(kSmallestStep);
  method.setFtol(kSmallestGain);
  VectorXd x = VectorXd::Zero(Index{kFittedKeys.size()});
  auto status = method.minimizeInit(x);
  while (status == Eigen::LevenbergMarquardtSpace::NotStarted ||
         status == Eigen::LevenbergMarquardtSpace::Running) {
    if (step.iteration == kMostIterations) {
      throw solver::SolveError(
          fmt::format("the fit has found no minimum after {} iterations", kMostIterations));
    }
    status = method.minimizeOneStep(x);
    step = step_at(step.iteration + 1, residuals.model_at(x));
    after_each(step);
  }
  return step;
}

}  // namespace oblique::client
