#include "worker/solver/fast/lane_falls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tests/worker/solver/reference/known_falls.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/reference/fall.h"

namespace oblique::solver {
namespace {

using testing::HasSubstr;

constexpr double kAccuracy = 1e-5;

ModelParameters model_of(int elements_per_link) {
  ModelParameters model = preset("paper");
  model.elements_per_link = elements_per_link;
  return model;
}

FallRequest request_for(const Chain& chain, double accuracy = kAccuracy,
                        FallProgress* progress = nullptr) {
  return {&chain, nullptr, 0.0, accuracy, progress};
}

/// A chain with its fall. The type is not movable, because its members refer to each other.
struct Fallen {
  explicit Fallen(const ModelParameters& model, double accuracy = kAccuracy)
      : chain(model), solved(solve(accuracy)), fall(*solved) {}
  Fallen(const Fallen&) = delete;
  Fallen& operator=(const Fallen&) = delete;
  ~Fallen() = default;

  std::shared_ptr<const Fall> solve(double accuracy) const {
    const FallRequest request = request_for(chain, accuracy);
    const FallSolution solution = solve_by_collocation({&request, 1}).front();
    if (!solution.fall) {
      throw SolveError(solution.error);
    }
    return solution.fall;
  }
  TipState tip_at(double H_m) const { return chain.tip(fall.state_at(H_m)); }
  double energy_J(const ChainState& state) const {
    return chain.kinetic_energy_J(state.v) + chain.strain_energy_J(state.q) +
           chain.gravity_energy_J(state.q);
  }
  Chain chain;
  std::shared_ptr<const Fall> solved;
  const Fall& fall;
};

const Fallen& paper() {
  static const Fallen fallen{preset("paper")};
  return fallen;
}

TEST(CollocationFall, StateAtATimeAgreesWithTheStateAtTheDropReachedThen) {
  const Fallen fallen{model_of(1)};
  EXPECT_EQ(fallen.fall.state_at_time(0.0).q, fallen.chain.at_rest().q);
  for (int i = 0; i < 40; ++i) {
    const ChainState state = fallen.fall.state_at_time(0.01 * i);
    const double H_m = -fallen.chain.tip(state).y_m;
    if (H_m > 0.0) {
      EXPECT_NEAR(fallen.fall.state_at(H_m).t_s, state.t_s, 1e-12) << H_m;
    }
  }
}

TEST(CollocationFall, TipHasTheKnownStateAtTheDropsOfThePaper) {
  expect_known_falls(paper().chain, paper().fall);
}

/// Largest differences from a fall that was solved in small explicit steps.
struct Difference {
  double time_s = 0.0;
  double velocity_m_s = 0.0;
};

Difference difference(const Fallen& fallen, const Fall& explicit_fall) {
  Difference largest;
  for (const double part : {0.02, 0.3, 0.7, 0.95, 0.999}) {
    const double H_m = part * explicit_fall.largest_drop_m();
    const ChainState one = fallen.fall.state_at(H_m);
    const ChainState other = explicit_fall.state_at(H_m);
    const TipState a = fallen.chain.tip(one);
    const TipState b = fallen.chain.tip(other);
    largest.time_s = std::max(largest.time_s, std::abs(one.t_s - other.t_s));
    largest.velocity_m_s =
        std::max(largest.velocity_m_s, std::hypot(a.vx_m_s - b.vx_m_s, a.vy_m_s - b.vy_m_s));
  }
  return largest;
}

TEST(CollocationFall, AgreesWithSmallStepsForSoftStiffLoadedAndSingleLinks) {
  ModelParameters soft = model_of(2);
  soft.E_Pa *= 1e-4;
  ModelParameters softest = model_of(2);
  softest.E_Pa *= 1e-5;  // links so soft that they sag and swing
  ModelParameters stiff = model_of(2);
  stiff.E_Pa *= 100.0;
  ModelParameters loaded = model_of(2);
  loaded.tip_mass_kg = 5.0;
  ModelParameters single = model_of(3);
  single.lengths_m = {1.0};
  ModelParameters uneven = model_of(2);
  uneven.lengths_m = {0.7, 0.05, 0.3};
  for (const ModelParameters& model : {soft, softest, stiff, loaded, single, uneven}) {
    SCOPED_TRACE("E = " + std::to_string(model.E_Pa) + ", links " +
                 std::to_string(model.lengths_m.size()) + ", tip " +
                 std::to_string(model.tip_mass_kg));
    const Fallen fallen(model);
    const double limit_s = 2.9894 / fallen.chain.highest_frequency_rad_s(0.0);
    const auto solved = solve_stepped_fall(fallen.chain, 0.4 * limit_s);
    const Fall& steps = *solved;
    const Difference apart = difference(fallen, steps);
    EXPECT_LT(apart.time_s, 1e-7);
    EXPECT_LT(apart.velocity_m_s, 1e-3);
    EXPECT_NEAR(fallen.fall.largest_drop_m(), steps.largest_drop_m(), 1e-6);
  }
}

TEST(CollocationFall, ErrorFollowsTheRequestedAccuracy) {
  const auto solved = solve_stepped_fall(paper().chain, 2e-6);
  const Fall& steps = *solved;
  const Fallen tight(preset("paper"), kAccuracy / 100.0);
  const Fallen loose(preset("paper"), kAccuracy * 10.0);
  EXPECT_LT(difference(tight, steps).velocity_m_s, 5e-6);
  EXPECT_LT(difference(paper(), steps).velocity_m_s, 1e-4);
  EXPECT_LT(difference(paper(), steps).time_s, 1e-9);
  EXPECT_GT(difference(loose, steps).velocity_m_s, 5e-6);
  EXPECT_LT(difference(loose, steps).velocity_m_s, 2e-3);
}

TEST(CollocationFall, EnergyIsConserved) {
  for (const int n : {2, 8}) {
    const Fallen fallen(model_of(n));
    const double start_J = fallen.energy_J(fallen.chain.at_rest());
    for (const double H_m : {0.3, 0.6, 0.9, 1.0, 1.1}) {
      EXPECT_NEAR(fallen.energy_J(fallen.fall.state_at(H_m)), start_J, 1e-8)
          << n << ", H = " << H_m << ": a billionth of the 10 J of the fall";
    }
  }
}

TEST(CollocationFall, DropIsLocatedToRounding) {
  for (const double H_m : {1e-9, 1e-3, 0.1, 0.5, 1.0, 1.17, 1.179}) {
    EXPECT_NEAR(paper().tip_at(H_m).y_m, -H_m, 1e-15 + 4e-16 * H_m) << H_m;
  }
}

TEST(CollocationFall, TipIsAtRestAtTheLargestDrop) {
  const double largest_m = paper().fall.largest_drop_m();
  const TipState tip = paper().tip_at(largest_m);
  EXPECT_NEAR(-tip.y_m, largest_m, 1e-15);
  EXPECT_NEAR(tip.vy_m_s, 0.0, 1e-3)
      << "near the largest drop the instant is known to the square root of rounding";
  EXPECT_LT(paper().tip_at(largest_m - 1e-9).vy_m_s, 0.0);
}

/// Returns different chains of one shape, more than any kernel has lanes.
std::deque<Chain> different_chains() {
  std::deque<Chain> chains;
  for (int i = 0; i < 11; ++i) {
    const double more = 1.0 + 0.13 * i;
    ModelParameters model = model_of(1);
    model.E_Pa *= more * (i % 3 == 0 ? 1e-3 : 1.0);
    model.I_m4 *= i % 2 == 0 ? more : 1.0;
    model.lengths_m = {0.3 * more, 0.4, 0.35};
    model.tip_mass_kg = i % 4 == 1 ? 0.2 * more : 0.0;
    chains.emplace_back(model);
  }
  return chains;
}

void expect_same_bits(const Fall& one, const Fall& other) {
  ASSERT_EQ(one.largest_drop_m(), other.largest_drop_m());
  for (const double part : {1e-6, 0.2, 0.51, 0.9, 1.0}) {
    const ChainState a = one.state_at(part * one.largest_drop_m());
    const ChainState b = other.state_at(part * one.largest_drop_m());
    EXPECT_EQ(a.t_s, b.t_s);
    EXPECT_EQ(a.q, b.q);
    EXPECT_EQ(a.v, b.v);
  }
}

using Solve = std::vector<FallSolution>(std::span<const FallRequest>, const LaneKernel&);

void expect_same_bits_alone_and_beside_others(const std::vector<FallRequest>& requests,
                                              Solve& solve) {
  for (const LaneKernel& kernel : runnable_lane_kernels()) {
    SCOPED_TRACE(kernel.name);
    const std::vector<FallSolution> together = solve(requests, kernel);
    const std::vector<FallRequest> reversed(requests.rbegin(), requests.rend());
    const std::vector<FallSolution> backwards = solve(reversed, kernel);
    for (std::size_t i = 0; i < requests.size(); ++i) {
      SCOPED_TRACE(i);
      ASSERT_EQ(together[i].error, "");
      const FallSolution alone = solve({&requests[i], 1}, kernel).front();
      expect_same_bits(*alone.fall, *together[i].fall);
      expect_same_bits(*alone.fall, *backwards[requests.size() - 1 - i].fall);
    }
  }
}

TEST(CollocationFall, HasTheSameBitsAloneAndBesideOthers) {
  const std::deque<Chain> chains = different_chains();
  std::vector<FallRequest> requests;
  for (const Chain& chain : chains) {
    requests.push_back(request_for(chain));
  }
  expect_same_bits_alone_and_beside_others(requests, solve_by_collocation);
}

TEST(CollocationFall, InstructionSetsDifferByRoundingOnly) {
  const Chain chain(model_of(2));
  const FallRequest request = request_for(chain);
  std::vector<double> times_s;
  for (const LaneKernel& kernel : runnable_lane_kernels()) {
    times_s.push_back(solve_by_collocation({&request, 1}, kernel).front().fall->state_at(1.0).t_s);
    EXPECT_NEAR(times_s.back(), times_s.front(), 1e-10) << kernel.name;
  }
}

TEST(CollocationFall, AFailingFallDoesNotAffectOthers) {
  // The second request has an accuracy of 0, which no step reaches.
  const Chain chain(model_of(1));
  const std::vector<FallRequest> requests{request_for(chain), request_for(chain, 0.0),
                                          request_for(chain)};
  const std::vector<FallSolution> solutions = solve_by_collocation(requests);
  EXPECT_THAT(solutions[1].error, HasSubstr("still do not converge"));
  EXPECT_EQ(solutions[1].fall, nullptr);
  ASSERT_NE(solutions[0].fall, nullptr);
  ASSERT_NE(solutions[2].fall, nullptr);
  expect_same_bits(*solutions[0].fall, *solutions[2].fall);
}

FallRequest by_steps(const Chain& chain, double dt_s = 8e-6) {
  return {&chain, std::make_shared<ExplicitMotion>(chain), dt_s, 0.0};
}

TEST(FallBySteps, HasTheSameBitsAloneAndBesideOthers) {
  std::deque<Chain> chains;
  std::vector<FallRequest> requests;
  for (int i = 0; i < 11; ++i) {
    ModelParameters model = model_of(2);
    model.lengths_m = {0.4 + 0.05 * i};
    model.E_Pa *= 1.0 - 0.05 * i;
    requests.push_back(by_steps(chains.emplace_back(model)));
  }
  expect_same_bits_alone_and_beside_others(requests, solve_by_steps);
}

TEST(FallBySteps, AgreesWithTheScalarFall) {
  ModelParameters model = model_of(2);
  model.lengths_m = {0.55};
  const Chain chain(model);
  const FallRequest request = by_steps(chain);
  const FallSolution solution = solve_by_steps({&request, 1}).front();
  const auto alone = solve_stepped_fall(chain, request.dt_s);
  ASSERT_TRUE(solution.fall) << solution.error;
  EXPECT_NEAR(solution.fall->largest_drop_m(), alone->largest_drop_m(), 1e-11);
  EXPECT_NEAR(solution.fall->state_at(0.4).t_s, alone->state_at(0.4).t_s, 1e-12);
}

TEST(FallBySteps, AFailingFallDoesNotAffectOthers) {
  const Chain chain(model_of(1));
  const auto falls = solve_by_steps(
      std::vector{by_steps(chain), by_steps(chain, 1.0), by_steps(chain), by_steps(chain, 1e-300)});
  EXPECT_THAT(falls[1].error, HasSubstr("diverged"));
  EXPECT_THAT(falls[3].error, HasSubstr("more than 1e+09 steps"));
  ASSERT_TRUE(falls[0].fall && falls[2].fall && !falls[1].fall && !falls[3].fall);
  expect_same_bits(*falls[0].fall, *falls[2].fall);
}

}  // namespace
}  // namespace oblique::solver
