#include "tests/client/explore/fit_coverage.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "client/explore/estimate.h"
#include "client/explore/fit.h"
#include "worker/solver/fall_cache.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::test {
namespace {

using client::Estimate;
using client::Fit;
using client::FitProblem;
using Eigen::Index;
using Eigen::VectorXd;

constexpr double kRelativeDeviation = 0.01;

/// The first three impacts slip throughout. The others begin with stick, which depends on eta2.
constexpr std::array<solver::Point, 5> kImpacts{
    {{0.8, 0.3, 1.0}, {0.9, 0.4, 0.9}, {1.0, 0.6, 1.0}, {1.0, 1.3, 1.0}, {0.9, 1.5, 1.0}}};
constexpr std::size_t kOutputs = 2;

/// Returns the peak forces of all impacts for each vector (k, eta2) in `points`.
std::vector<VectorXd> peak_forces(const std::vector<VectorXd>& points,
                                  const std::shared_ptr<solver::FallCache>& falls) {
  std::vector<solver::Finger> fingers;
  for (const VectorXd& point : points) {
    auto model = solver::preset("paper");
    model.k_N_m = point[0];
    model.eta2 = point[1];
    fingers.emplace_back(model, falls);
  }
  std::vector<VectorXd> predictions(points.size(), VectorXd(Index{kImpacts.size() * kOutputs}));
  std::uint64_t next = 0;
  solver::solve_points(
      [&]() -> std::optional<solver::FingerPoint> {
        if (next == points.size() * kImpacts.size()) {
          return {};
        }
        const auto number = next++;
        return solver::FingerPoint{fingers[number / kImpacts.size()], number,
                                   kImpacts.at(number % kImpacts.size())};
      },
      [&](solver::Outcome&& outcome) {
        auto& prediction = predictions[outcome.number / kImpacts.size()];
        const auto at = static_cast<Index>(kOutputs * (outcome.number % kImpacts.size()));
        prediction[at] = outcome.result.value().fn_peak_N;
        prediction[at + 1] = outcome.result->ft_peak_N;
      });
  return predictions;
}

bool covers(const Estimate& estimate, double truth) {
  return !(estimate.from > truth) && !(truth > estimate.to);
}

}  // namespace

Coverage fit_coverage(int fits, std::uint64_t seed, bool is_scaled) {
  const auto falls = std::make_shared<solver::FallCache>();
  const VectorXd truth{{2.7e7, 1.2463}};
  const VectorXd exact = peak_forces({truth}, falls).front();
  FitProblem problem;
  problem.unknowns = {{"k", 1e7, 1e8, 4e7}, {"eta2", 1.0, 1.8, 1.4}};
  const VectorXd noise = kRelativeDeviation * exact;
  problem.sd = (is_scaled ? 3.0 : 1.0) * noise;
  problem.names.assign(static_cast<std::size_t>(exact.size()), "a synthetic number");
  problem.evaluate = [&](const std::vector<VectorXd>& points, const std::string& /*what*/) {
    return peak_forces(points, falls);
  };
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Coverage coverage;
  while (coverage.fits < fits) {
    problem.measured = exact;
    for (Index i = 0; i < exact.size(); ++i) {
      problem.measured[i] += normal(random) * noise[i];
    }
    const Fit found = client::fit(problem, is_scaled);
    ++coverage.fits;
    coverage.k += covers(found.unknowns[0].estimate, truth[0]) ? 1 : 0;
    coverage.eta2 += covers(found.unknowns[1].estimate, truth[1]) ? 1 : 0;
  }
  return coverage;
}

}  // namespace oblique::test
