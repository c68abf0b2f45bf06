#include "client/explore/paper_fit.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "client/explore/fit.h"
#include "worker/solver/fall_cache.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

solver::ModelParameters model_of(solver::ModelParameters model, const VectorXd& parameters) {
  for (std::size_t i = 0; i < kFittedKeys.size(); ++i) {
    solver::find_model_key(kFittedKeys.at(i))->set(model, parameters[static_cast<Index>(i)]);
  }
  return model;
}

}  // namespace

PaperFitStep fit_paper(const PublishedTable& published, const solver::ModelParameters& start,
                       const std::function<void(const PaperFitStep&)>& after_each) {
  constexpr double kTimes = 3.0;
  constexpr double kRelativeDeviation = 0.01;
  constexpr double kTolerance = 1e-3;
  const auto numbers = compare(published, OwnCases(published.cases.size()));
  FitProblem problem;
  problem.names.assign(numbers.size(), "a published number");
  problem.measured.resize(static_cast<Index>(numbers.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    problem.measured[static_cast<Index>(i)] = numbers[i].published;
  }
  problem.sd = kRelativeDeviation * problem.measured;
  for (const auto name : kFittedKeys) {
    const double value = solver::find_model_key(name)->get(start);
    problem.unknowns.push_back({std::string(name), value / kTimes, value * kTimes, value});
  }
  const auto falls = std::make_shared<solver::FallCache>();
  problem.evaluate = [&](const std::vector<VectorXd>& points, const std::string& /*what*/) {
    std::vector<solver::Finger> fingers;
    for (const VectorXd& point : points) {
      fingers.emplace_back(model_of(start, point), falls);
    }
    std::vector<VectorXd> predictions;
    for (const OwnCases& cases : solved_cases(published, fingers)) {
      auto& prediction = predictions.emplace_back(problem.measured.size());
      Index i = 0;
      for (const Difference& difference : compare(published, cases)) {
        prediction[i++] = difference.ours.value_or(0.0);
      }
    }
    return predictions;
  };
  const auto paper_step = [&](const FitStep& step) {
    auto differences = numbers;
    for (std::size_t i = 0; i < differences.size(); ++i) {
      const double ours = step.predictions[static_cast<Index>(i)];
      differences[i].ours = ours == 0.0 ? std::nullopt : std::optional(ours);
    }
    const auto summary = summary_of(differences);
    return PaperFitStep{step.iteration, model_of(start, step.parameters), std::move(differences),
                        summary};
  };
  return paper_step(
      minimise(problem, kTolerance, [&](const FitStep& step) { after_each(paper_step(step)); }));
}

}  // namespace oblique::client
