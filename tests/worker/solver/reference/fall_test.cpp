#include "worker/solver/reference/fall.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tests/worker/solver/reference/known_falls.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/motion.h"

namespace oblique::solver {
namespace {

using testing::HasSubstr;

ModelParameters coarse_model() {
  ModelParameters model = preset("paper");
  model.elements_per_link = 1;
  return model;
}

struct FallOf {
  FallOf(const ModelParameters& model, double dt_s)
      : chain(model), solved(solve_stepped_fall(chain, dt_s)), fall(*solved) {}
  FallOf(const FallOf&) = delete;
  FallOf& operator=(const FallOf&) = delete;
  ~FallOf() = default;

  TipState tip_at(double H_m) const { return chain.tip(fall.state_at(H_m)); }
  double energy_J(const ChainState& state) const {
    return chain.kinetic_energy_J(state.v) + chain.strain_energy_J(state.q) +
           chain.gravity_energy_J(state.q);
  }
  Chain chain;
  std::shared_ptr<const Fall> solved;
  const Fall& fall;
};

TEST(Fall, TipHasTheKnownStateAtTheDropsOfThePaper) {
  const FallOf paper(preset("paper"), 2.5e-6);
  expect_known_falls(paper.chain, paper.fall);
  EXPECT_NEAR(paper.fall.largest_drop_m(), 1.179, 5e-4);
}

TEST(Fall, DropIsLocatedToRounding) {
  const FallOf coarse(coarse_model(), 9e-6);
  for (const double H_m : {1e-9, 1e-3, 0.1, 0.5, 1.0, 1.17, 1.179}) {
    EXPECT_NEAR(coarse.tip_at(H_m).y_m, -H_m, 1e-15 + 4e-16 * H_m) << H_m;
  }
}

TEST(Fall, StateAtATimeAgreesWithTheStateAtADropAndIsNotKept) {
  const FallOf coarse(coarse_model(), 9e-6);
  const std::size_t bytes = coarse.fall.bytes();
  EXPECT_EQ(coarse.fall.state_at_time(0.0).q, coarse.chain.at_rest().q);
  for (const double H_m : {1e-9, 1e-3, 0.1, 0.5, 1.0, 1.17}) {
    const ChainState by_drop = coarse.fall.state_at(H_m);
    const ChainState by_time = coarse.fall.state_at_time(by_drop.t_s);
    EXPECT_NEAR(by_time.t_s, by_drop.t_s, 9e-9);
    EXPECT_NEAR(coarse.chain.tip(by_time).y_m, -H_m, 9e-9 * 6.0) << "at a speed of at most 6 m/s";
    EXPECT_NEAR(coarse.energy_J(by_time), coarse.energy_J(by_drop), 1e-7);
  }
  for (const double steps : {1.0, 2.0, 4095.0, 4096.0, 4097.0, 40'000.0}) {
    EXPECT_EQ(coarse.fall.state_at_time(steps * 9e-6).t_s, steps * 9e-6)
        << "a full step is not divided";
  }
  EXPECT_EQ(coarse.fall.bytes(), bytes);
}

TEST(Fall, StateAtADropHasTheSameBitsWhateverWasRequestedBefore) {
  const FallOf one(coarse_model(), 9e-6);
  const FallOf other(coarse_model(), 9e-6);
  const std::vector<double> drops{1e-6, 0.01, 0.1, 0.33, 0.5, 0.77, 0.99, 1.0, 1.0001, 1.17};
  std::vector<ChainState> forwards;
  for (const double H_m : drops) {
    forwards.push_back(one.fall.state_at(H_m));
  }
  for (std::size_t i = drops.size(); i-- > 0;) {
    const ChainState state = other.fall.state_at(drops[i]);
    EXPECT_EQ(state.q, forwards[i].q);
    EXPECT_EQ(state.v, forwards[i].v);
    EXPECT_EQ(state.t_s, forwards[i].t_s);
  }
}

TEST(Fall, ADropThatIsNeverReachedIsAnErrorThatNamesTheLargestDrop) {
  const FallOf coarse(coarse_model(), 9e-6);
  for (const double H_m : {1.18, 1.2, 0.0, -0.5}) {
    try {
      coarse.fall.state_at(H_m);
      FAIL() << H_m;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("H = "));
      EXPECT_THAT(error.what(), HasSubstr("1.179156"));
    }
  }
  EXPECT_THROW(coarse.fall.state_at(std::nan("")), InputError);
}

TEST(Fall, TipIsAtRestAtTheLargestDrop) {
  const FallOf coarse(coarse_model(), 9e-6);
  const TipState tip = coarse.tip_at(coarse.fall.largest_drop_m());
  EXPECT_NEAR(tip.vy_m_s, 0.0, 1e-3) << "the instant is known to the square root of rounding";
  EXPECT_LT(coarse.tip_at(coarse.fall.largest_drop_m() - 1e-3).vy_m_s, -0.1);
}

TEST(Fall, TheLargestDropIsFoundWhereverItLiesInItsStep) {
  const FallOf fine(coarse_model(), 9e-6);
  const double largest_m = fine.fall.largest_drop_m();
  const double turn_s = fine.fall.state_at(largest_m).t_s;
  // With these steps the lowest point of the fall is early, in the middle or late in a step.
  for (const double fraction : {0.01, 0.5, 0.99}) {
    SCOPED_TRACE(fraction);
    const FallOf one(coarse_model(), turn_s / (std::floor(turn_s / 9e-6) + fraction));
    EXPECT_NEAR(one.fall.largest_drop_m(), largest_m, 1e-9);
    const ChainState top = one.fall.state_at(one.fall.largest_drop_m());
    EXPECT_NEAR(-one.chain.tip(top).y_m, one.fall.largest_drop_m(), 1e-15);
    EXPECT_NEAR(top.t_s, turn_s, 1e-6) << "the instant is known to the square root of rounding";
    // Just below the largest drop, the tip is on its way down.
    const ChainState below = one.fall.state_at(largest_m - 1e-9);
    EXPECT_LT(below.t_s, top.t_s);
    EXPECT_LT(one.chain.tip(below).vy_m_s, 0.0);
    EXPECT_NEAR(-one.chain.tip(below).y_m, largest_m - 1e-9, 1e-15);
  }
}

TEST(Fall, AStepAboveTheStabilityLimitIsAnError) {
  const Chain chain(coarse_model());
  EXPECT_THROW(solve_stepped_fall(chain, 40e-6), SolveError);
}

}  // namespace
}  // namespace oblique::solver
