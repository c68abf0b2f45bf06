#include "worker/solver/chain/constrained_chain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "worker/solver/motion/generalized_alpha.h"
#include "worker/solver/motion/motion.h"

/// The constrained chain and generalized-alpha against the eliminated chain: the same system in
/// other coordinates.
namespace oblique::solver {
namespace {

ModelParameters three_links() {
  ModelParameters model;
  model.lengths_m = {0.4, 0.3, 0.35};
  model.elements_per_link = 2;
  model.tip_mass_kg = 0.05;
  return model;
}

ChainState bent_and_moving(const Chain& chain) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  ChainState state = chain.at_rest();
  for (std::size_t i = 2; i < state.q.size(); ++i) {
    state.q[i] += 1e-4 * uniform(generator);
    state.v[i] = uniform(generator);
  }
  return state;
}

const AffineContactForce<double> kStick{900.0, -250.0, 2.7e7, 0.0, 2.1e7, 1.05, 0.0};

TEST(ConstrainedChain, HasTheEnergiesOfTheEliminatedOne) {
  const Chain eliminated(three_links());
  const ConstrainedChain constrained(three_links());
  const ChainState state = bent_and_moving(eliminated);
  const ChainState same = constrained.from_eliminated(state);
  const auto expect_equal = [](double a, double b) { EXPECT_NEAR(a, b, 1e-12 * std::abs(b)); };
  expect_equal(constrained.kinetic_energy_J(same.v), eliminated.kinetic_energy_J(state.v));
  expect_equal(constrained.strain_energy_J(same.q), eliminated.strain_energy_J(state.q));
  expect_equal(constrained.gravity_energy_J(same.q), eliminated.gravity_energy_J(state.q));
  EXPECT_EQ(constrained.tip(same).y_m, eliminated.tip(state).y_m);
}

TEST(ConstrainedChain, ConstraintsHoldForEveryStateOfTheEliminatedOne) {
  const Chain eliminated(three_links());
  const ConstrainedChain constrained(three_links());
  const ChainState same = constrained.from_eliminated(bent_and_moving(eliminated));
  std::vector<double> residual(constrained.size(), 0.0);
  constrained.set_constraints(same.q, 1.0, residual);
  for (const double value : residual) {
    EXPECT_EQ(value, 0.0);
  }
}

TEST(ConstrainedChain, ConstraintForcesWorkOnNothingButTheBreachOfConstraints) {
  // For every displacement, dq . (Phi_qᵀ lambda) = lambda . Phi(dq): a joint pushes both of its
  // links alike, and the pin is the only force from outside.
  const ConstrainedChain chain(three_links());
  std::mt19937_64 generator(2);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 20; ++i) {
    Coordinates dq(chain.size(), 0.0);
    std::vector<double> multipliers_N(2 * chain.links());
    std::generate(dq.begin(), dq.end(), [&] { return uniform(generator); });
    std::generate(multipliers_N.begin(), multipliers_N.end(), [&] { return uniform(generator); });
    std::vector<double> forces(chain.size(), 0.0);
    std::vector<double> breach(chain.size(), 0.0);
    chain.add_constraint_forces(multipliers_N, forces);
    chain.set_constraints(dq, 1.0, breach);
    double work = 0.0;
    double expected = 0.0;
    for (std::size_t k = 0; k < dq.size(); ++k) {
      work += dq[k] * forces[k];
    }
    for (std::size_t link = 0; link < chain.links(); ++link) {
      for (std::size_t c = 0; c < 2; ++c) {
        expected += multipliers_N[2 * link + c] * breach[chain.multiplier_index(link) + c];
      }
    }
    EXPECT_NEAR(work, expected, 1e-13);
  }
}

TEST(ConstrainedChain, ConsistentAccelerationsAndReactionsAreThoseOfTheEliminatedOne) {
  const Chain eliminated(three_links());
  const ExplicitMotion by_elimination(eliminated);
  const GeneralizedAlphaMotion by_constraints(three_links());
  const ChainState state = bent_and_moving(eliminated);
  ChainState same = by_constraints.chain().from_eliminated(state);
  by_constraints.restart(kStick, same);
  const TipState tip = eliminated.tip(state);
  Coordinates a(state.q.size());
  eliminated.accelerations(state.q.data(), kStick.ft_N(tip.x_m, tip.y_m), kStick.fn_N(tip.y_m),
                           a.data());
  const std::size_t i = 2 * eliminated.tip_row();
  const std::size_t j = by_constraints.chain().tip_index();
  const double scale = std::hypot(a[i], a[i + 1]);
  EXPECT_NEAR(same.acceleration[j], a[i], 1e-9 * scale);
  EXPECT_NEAR(same.acceleration[j + 1], a[i + 1], 1e-9 * scale);
  const auto expected = by_elimination.reactions(kStick, state);
  const auto reactions = by_constraints.reactions(kStick, same);
  ASSERT_EQ(reactions.size(), expected.size());
  for (std::size_t joint = 0; joint < reactions.size(); ++joint) {
    const double force_N = std::hypot(expected[joint].x_N, expected[joint].y_N);
    EXPECT_NEAR(reactions[joint].x_N, expected[joint].x_N, 1e-8 * force_N);
    EXPECT_NEAR(reactions[joint].y_N, expected[joint].y_N, 1e-8 * force_N);
  }
}

TEST(GeneralizedAlpha, ParametersAreThoseOfSecondOrderForEveryRadius) {
  for (const double xi : {0.0, 0.3, 0.9, 1.0}) {
    const GeneralizedAlphaParameters p(xi);
    EXPECT_NEAR(p.gamma, 0.5 - p.alpha_m + p.alpha_f, 1e-15);
    EXPECT_NEAR(p.beta, 0.25 * std::pow(p.gamma + 0.5, 2), 1e-15);
    EXPECT_NEAR(p.alpha_m, 3.0 * p.alpha_f - 1.0, 1e-15) << "least damping of low frequencies";
  }
}

TEST(GeneralizedAlpha, ErrorUnderAContactForceFallsFourfoldWhenTheStepHalves) {
  const Chain eliminated(three_links());
  const ExplicitMotion by_elimination(eliminated);
  const GeneralizedAlphaMotion by_constraints(three_links());
  // A smooth motion: a fall of the straight chain under a growing contact force.
  const auto tip_after = [](const Motion& motion, ChainState state, int steps) {
    motion.restart(kStick, state);
    ChainState next;
    for (int i = 0; i < steps; ++i) {
      motion.step(state, kStick, 100e-6 / steps, next);
      std::swap(state, next);
    }
    return motion.tip(state);
  };
  const TipState exact = tip_after(by_elimination, by_elimination.at_rest(), 400);
  const auto error = [&](int steps) {
    const TipState tip = tip_after(by_constraints, by_constraints.at_rest(), steps);
    return std::hypot(tip.x_m - exact.x_m, tip.y_m - exact.y_m);
  };
  const double fine = error(1600);
  EXPECT_NEAR(error(800) / fine, 4.0, 0.5);
  const double swing_m = std::hypot(exact.x_m - 1.05, exact.y_m);
  EXPECT_LT(fine, 1e-3 * swing_m);
}

}  // namespace
}  // namespace oblique::solver
