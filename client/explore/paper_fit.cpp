#include "client/explore/paper_fit.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "worker/solver/fall_cache.h"
#include "worker/solver/solve.h"

namespace oblique::client {

using Eigen::Index;
using Eigen::VectorXd;

FitStep fit_paper(const PublishedTable& published, const solver::ModelParameters& start,
                  const std::function<void(const std::string& what)>& before_each) {
  constexpr double kTimes = 3.0;
  constexpr double kPercent = 0.01;
  constexpr double kTolerance = 1e-3;
  const auto numbers = compare(published, OwnCases(published.cases.size()));
  FitProblem problem;
  problem.names.assign(numbers.size(), "a published number");
  problem.measured.resize(static_cast<Index>(numbers.size()));
  std::ranges::transform(numbers, problem.measured.begin(), &Difference::published);
  problem.sd = kPercent * problem.measured;
  for (const auto name : kFittedKeys) {
    const double value = solver::find_model_key(name)->get(start);
    problem.unknowns.push_back({std::string(name), value / kTimes, value * kTimes, value});
  }
  const auto falls = std::make_shared<solver::FallCache>();
  problem.evaluate = [&](const std::vector<VectorXd>& points, const std::string& what) {
    before_each(what);
    std::vector<solver::Finger> fingers;
    for (const VectorXd& point : points) {
      auto model = start;
      for (std::size_t i = 0; i < kFittedKeys.size(); ++i) {
        solver::find_model_key(kFittedKeys.at(i))->set(model, point[static_cast<Index>(i)]);
      }
      fingers.emplace_back(model, falls);
    }
    std::vector<VectorXd> predictions;
    for (const OwnCases& cases : solved_cases(published, fingers)) {
      std::ranges::transform(
          compare(published, cases), predictions.emplace_back(problem.measured.size()).begin(),
          [](const Difference& difference) { return difference.ours.value_or(0.0); });
    }
    return predictions;
  };
  return minimise(problem, problem.start(), kTolerance);
}

}  // namespace oblique::client
