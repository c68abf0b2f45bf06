#include "client/explore/paper_fit.h"

#include <cstddef>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "client/explore/fit.h"
#include "worker/solver/fall_cache.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

solver::ModelParameters model_of(solver::ModelParameters model, const VectorXd& parameters) {
  for (std::size_t i = 0; i < kFittedKeys.size(); ++i) {
    solver::find_model_key(kFittedKeys[i])->set(model, parameters[static_cast<Index>(i)]);
  }
  return model;
}

/// Differences from the predictions of a model; 0 for values that the model does not have.
std::vector<Difference> with_ours(std::vector<Difference> differences,
                                  const VectorXd& predictions) {
  for (std::size_t i = 0; i < differences.size(); ++i) {
    const double ours = predictions[static_cast<Index>(i)];
    differences[i].ours = ours == 0.0 ? std::nullopt : std::optional(ours);
  }
  return differences;
}

VectorXd predictions_of(const std::vector<Difference>& differences) {
  VectorXd predictions(static_cast<Index>(differences.size()));
  for (std::size_t i = 0; i < differences.size(); ++i) {
    predictions[static_cast<Index>(i)] = differences[i].ours.value_or(0.0);
  }
  return predictions;
}

}  // namespace

PaperFitStep fit_paper(const PublishedTable& published, const solver::ModelParameters& start,
                       const std::function<void(const PaperFitStep&)>& after_each) {
  constexpr double kTimes = 3.0;
  constexpr double kRelativeDeviation = 0.01;
  constexpr double kTolerance = 1e-3;
  const auto numbers = compare(published, OwnCases(published.cases.size()));
  FitProblem problem;
  problem.measured.resize(static_cast<Index>(numbers.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    problem.measured[static_cast<Index>(i)] = numbers[i].published;
    problem.names.emplace_back("a published number");
  }
  problem.sd = kRelativeDeviation * problem.measured;
  for (const auto name : kFittedKeys) {
    const double value = solver::find_model_key(name)->get(start);
    problem.unknowns.push_back({std::string(name), value / kTimes, value * kTimes, value});
  }
  solver::FallCache falls;
  problem.evaluate = [&](const std::vector<VectorXd>& points, const std::string& /*what*/) {
    std::vector<solver::ModelParameters> models;
    for (const VectorXd& point : points) {
      models.push_back(model_of(start, point));
    }
    const auto fallen = falls.falls(models);
    std::vector<solver::Finger> fingers;
    for (std::size_t i = 0; i < models.size(); ++i) {
      if (!fallen[i].fallen) {
        throw solver::SolveError(fallen[i].error);
      }
      fingers.emplace_back(models[i], fallen[i].fallen);
    }
    std::vector<VectorXd> predictions;
    for (const OwnCases& cases : solved_cases(published, fingers)) {
      predictions.push_back(predictions_of(compare(published, cases)));
    }
    return predictions;
  };
  const auto paper_step = [&](const FitStep& step) {
    auto differences = with_ours(numbers, step.predictions);
    const auto summary = summary_of(differences);
    return PaperFitStep{step.iteration, model_of(start, step.parameters), std::move(differences),
                        summary};
  };
  return paper_step(
      minimise(problem, kTolerance, [&](const FitStep& step) { after_each(paper_step(step)); }));
}

}  // namespace oblique::client
