#include "worker/solver/motion/fall.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/motion/motion.h"

namespace oblique::solver {
namespace {

using testing::HasSubstr;

ModelParameters coarse_model() {
  ModelParameters model = preset("paper");
  model.elements_per_link = 1;
  return model;
}

struct FallOf {
  explicit FallOf(const ModelParameters& model, double dt_s) : chain(model), fall(chain, dt_s) {}
  TipState tip_at(double H_m) const { return chain.tip(fall.state_at(H_m)); }
  double energy_J(const ChainState& state) const {
    return chain.kinetic_energy_J(state.v) + chain.strain_energy_J(state.q) +
           chain.gravity_energy_J(state.q);
  }
  Chain chain;
  Fall fall;
};

struct Known {
  double H_m;
  double t_s;
  double x_m;
  double vx_m_s;
  double vy_m_s;
};

TEST(Fall, TipHasTheKnownStateAtTheDropsOfThePaper) {
  // An independent explicit solution, converged to nine digits.
  const FallOf paper(preset("paper"), 2.5e-6);
  for (const Known& known : {Known{0.96, 0.42263713, 0.6273702, -5.23465, -5.34110},
                             Known{1.00, 0.43018976, 0.5859693, -5.73783, -5.23380},
                             Known{1.04, 0.43798758, 0.5389964, -6.31882, -4.99916}}) {
    const TipState tip = paper.tip_at(known.H_m);
    EXPECT_NEAR(paper.fall.state_at(known.H_m).t_s, known.t_s, 1e-8);
    EXPECT_NEAR(tip.x_m, known.x_m, 1e-7);
    EXPECT_NEAR(tip.vx_m_s, known.vx_m_s, 5e-5);
    EXPECT_NEAR(tip.vy_m_s, known.vy_m_s, 5e-5);
  }
  EXPECT_NEAR(paper.fall.largest_drop_m(), 1.179, 5e-4);
}

TEST(Fall, StiffLinksFallAsRigidOnes) {
  ModelParameters model = coarse_model();
  model.E_Pa *= 100.0;
  const FallOf stiff(model, 1.5e-6);
  const ChainState state = stiff.fall.state_at(1.0);
  const TipState tip = stiff.chain.tip(state);
  // Three rigid links, whatever A and I. What is left of the bending falls as 1/E.
  EXPECT_NEAR(state.t_s, 0.430188812, 2e-8);
  EXPECT_NEAR(tip.vx_m_s, -5.738072, 1e-4);
  EXPECT_NEAR(tip.vy_m_s, -5.234437, 1e-4);
}

TEST(Fall, DropIsLocatedToRounding) {
  const FallOf coarse(coarse_model(), 9e-6);
  for (const double H_m : {1e-9, 1e-3, 0.1, 0.5, 1.0, 1.17, 1.179}) {
    EXPECT_NEAR(coarse.tip_at(H_m).y_m, -H_m, 1e-15 + 4e-16 * H_m) << H_m;
  }
}

TEST(Fall, StateAtATimeIsTheOneThatTheTipPassesThenAndIsKeptNowhere) {
  const FallOf coarse(coarse_model(), 9e-6);
  const std::size_t bytes = coarse.fall.bytes();
  const FallPath& path = *coarse.fall.path();
  EXPECT_EQ(path.state_at_time(0.0).q, coarse.chain.at_rest().q);
  for (const double H_m : {1e-9, 1e-3, 0.1, 0.5, 1.0, 1.17}) {
    const ChainState by_drop = coarse.fall.state_at(H_m);
    const ChainState by_time = path.state_at_time(by_drop.t_s);
    EXPECT_NEAR(by_time.t_s, by_drop.t_s, 9e-9);
    EXPECT_NEAR(coarse.chain.tip(by_time).y_m, -H_m, 9e-9 * 6.0) << "at 6 m/s at most";
    EXPECT_NEAR(coarse.energy_J(by_time), coarse.energy_J(by_drop), 1e-7);
  }
  for (const double steps : {1.0, 2.0, 4095.0, 4096.0, 4097.0, 40'000.0}) {
    EXPECT_EQ(path.state_at_time(steps * 9e-6).t_s, steps * 9e-6) << "a whole step is taken whole";
  }
  EXPECT_EQ(coarse.fall.bytes(), bytes);
}

TEST(Fall, StateAtADropHasTheSameBitsWhateverWasAskedBefore) {
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

TEST(Fall, DropThatIsNeverReachedIsAnErrorThatNamesTheLargestDrop) {
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

TEST(Fall, TipStandsStillAtTheLargestDrop) {
  const FallOf coarse(coarse_model(), 9e-6);
  const TipState tip = coarse.tip_at(coarse.fall.largest_drop_m());
  EXPECT_NEAR(tip.vy_m_s, 0.0, 1e-3) << "the drop fixes the instant only to the root of rounding";
  EXPECT_LT(coarse.tip_at(coarse.fall.largest_drop_m() - 1e-3).vy_m_s, -0.1);
}

TEST(Fall, TurnThatLiesEarlyInItsStepIsFoundAllTheSame) {
  const FallOf fine(coarse_model(), 9e-6);
  const double largest_m = fine.fall.largest_drop_m();
  const double turn_s = fine.fall.state_at(largest_m).t_s;
  // Just after the turn, in its middle, and just before the next step.
  for (const double fraction : {0.01, 0.5, 0.99}) {
    SCOPED_TRACE(fraction);
    const FallOf one(coarse_model(), turn_s / (std::floor(turn_s / 9e-6) + fraction));
    EXPECT_NEAR(one.fall.largest_drop_m(), largest_m, 1e-9);
    const ChainState top = one.fall.state_at(one.fall.largest_drop_m());
    EXPECT_NEAR(-one.chain.tip(top).y_m, one.fall.largest_drop_m(), 1e-15);
    EXPECT_NEAR(top.t_s, turn_s, 1e-6) << "the drop fixes the instant only to the root of rounding";
    // And just below it, on the way down.
    const ChainState below = one.fall.state_at(largest_m - 1e-9);
    EXPECT_LT(below.t_s, top.t_s);
    EXPECT_LT(one.chain.tip(below).vy_m_s, 0.0);
    EXPECT_NEAR(-one.chain.tip(below).y_m, largest_m - 1e-9, 1e-15);
  }
}

class FallOrder : public testing::Test {
 protected:
  static constexpr double kCoarse_s = 12e-6;
  static constexpr double kSmallestRatio = 11.3;  // order 3.5
  const std::vector<double> drops_m_{0.3, 0.6, 0.9, 1.0, 1.1};
};

TEST_F(FallOrder, EnergyIsKeptTheBetterByOrderFour) {
  const auto drift_J = [&](double dt_s) {
    const FallOf fall(coarse_model(), dt_s);
    const double start_J = fall.energy_J(fall.chain.at_rest());
    double largest = 0.0;
    for (const double H_m : drops_m_) {
      largest = std::max(largest, std::abs(fall.energy_J(fall.fall.state_at(H_m)) - start_J));
    }
    return largest;
  };
  const double coarse_J = drift_J(kCoarse_s);
  EXPECT_GT(coarse_J / drift_J(kCoarse_s / 2.0), kSmallestRatio);
  EXPECT_LT(coarse_J, 1e-5) << "of the 10 J of the fall";
}

TEST_F(FallOrder, TimeAndVelocityAtADropAreOfOrderFour) {
  const FallOf exact(coarse_model(), kCoarse_s / 8.0);
  struct Errors {
    double time_s = 0.0;
    double velocity_m_s = 0.0;
  };
  const auto errors = [&](double dt_s) {
    const FallOf fall(coarse_model(), dt_s);
    Errors largest;
    for (const double H_m : drops_m_) {
      const TipState tip = fall.tip_at(H_m);
      const TipState exact_tip = exact.tip_at(H_m);
      const double time_s = fall.fall.state_at(H_m).t_s - exact.fall.state_at(H_m).t_s;
      largest.time_s = std::max(largest.time_s, std::abs(time_s));
      largest.velocity_m_s =
          std::max(largest.velocity_m_s,
                   std::hypot(tip.vx_m_s - exact_tip.vx_m_s, tip.vy_m_s - exact_tip.vy_m_s));
    }
    return largest;
  };
  const Errors coarse = errors(kCoarse_s);
  const Errors fine = errors(kCoarse_s / 2.0);
  EXPECT_GT(coarse.time_s / fine.time_s, kSmallestRatio);
  EXPECT_GT(coarse.velocity_m_s / fine.velocity_m_s, kSmallestRatio);
}

TEST(Fall, StepBeyondTheStabilityLimitIsAnErrorNotANumber) {
  const Chain chain(coarse_model());
  EXPECT_THROW(Fall(chain, 40e-6), SolveError);
}

TEST(Fall, OneLinkFallsAsAPhysicalPendulum) {
  ModelParameters model = preset("paper");
  model.lengths_m = {1.0};
  model.elements_per_link = 2;
  const FallOf pendulum(model, 5e-6);
  // m g H/2 = m L^2 omega^2/6 for a rigid rod: V = omega L = sqrt(3 g H). Released unbent, the link
  // vibrates about its sag, 1e-4 m at 500 rad/s.
  for (const double H_m : {0.2, 0.5, 0.9}) {
    const TipState tip = pendulum.tip_at(H_m);
    EXPECT_NEAR(std::hypot(tip.vx_m_s, tip.vy_m_s), std::sqrt(3.0 * model.g_m_s2 * H_m), 5e-2);
  }
}

}  // namespace
}  // namespace oblique::solver
