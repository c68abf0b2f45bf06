#include "client/paper/parameter_fit.h"

#include <cmath>
#include <future>

#include <spdlog/fmt/fmt.h>
#include <unsupported/Eigen/LevenbergMarquardt>

#include "worker/solver/model/errors.h"

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

/// r_i(x) = ours_i / published_i - 1 with the parameters start exp(x).
class Residuals : public Eigen::DenseFunctor<double> {
 public:
  Residuals(const PublishedTable& published, const solver::ModelParameters& start, int values)
      : Eigen::DenseFunctor<double>(int{kFittedKeys.size()}, values),
        published_(published),
        start_(start) {}

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
    residuals = of(differences_of(published_, model_at(x)));
    return 0;
  }

  int df(const VectorXd& x, MatrixXd& jacobian) const {
    std::vector<VectorXd> at(kFittedKeys.size() + 1);  // the last one undisturbed
    std::vector<std::future<void>> solved;
    for (std::size_t i = 0; i < at.size(); ++i) {
      solved.push_back(std::async(std::launch::async, [&, i] {
        VectorXd disturbed = x;
        if (i < kFittedKeys.size()) {
          disturbed[static_cast<Index>(i)] += kDifferenceStep;
        }
        (*this)(disturbed, at[i]);
      }));
    }
    for (auto& each : solved) {
      each.get();
    }
    for (std::size_t i = 0; i < kFittedKeys.size(); ++i) {
      jacobian.col(static_cast<Index>(i)) = (at[i] - at.back()) / kDifferenceStep;
    }
    return 0;
  }

 private:
  const PublishedTable& published_;
  const solver::ModelParameters& start_;
};

}  // namespace

std::vector<Difference> differences_of(const PublishedTable& published,
                                       const solver::ModelParameters& model) {
  return compare(published, solved_cases(published, solver::Finger(model)));
}

FitStep fit_parameters(const PublishedTable& published, const solver::ModelParameters& start,
                       const std::function<void(const FitStep&)>& after_each) {
  FitStep step{.iteration = 0,
               .model = start,
               .differences = differences_of(published, start),
               .summary = {}};
  step.summary = summary_of(step.differences);
  after_each(step);
  Residuals residuals(published, start, static_cast<int>(step.differences.size()));
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
    step = {.iteration = step.iteration + 1,
            .model = residuals.model_at(x),
            .differences = differences_of(published, residuals.model_at(x)),
            .summary = {}};
    step.summary = summary_of(step.differences);
    after_each(step);
  }
  return step;
}

}  // namespace oblique::client
