#include "worker/solver/reference/constrained_chain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/worker/solver/reference/from_eliminated.h"
#include "worker/solver/reference/generalized_alpha.h"
#include "worker/solver/reference/motion.h"

/// Compares the constrained chain, integrated by generalized-alpha, with the chain whose joints are
/// eliminated. Both describe the same system in different coordinates.
namespace oblique::solver {
namespace {

ModelParameters three_links() {
  ModelParameters model = preset("paper");
  model.lengths_m = {0.4, 0.3, 0.35};
  model.elements_per_link = 2;
  model.tip_mass_kg = 0.05;
  return model;
}

ChainState bent_and_moving(const Chain& chain) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  ChainState state = chain.at_rest();
  for (Eigen::Index i = 2; i < state.q.size(); ++i) {
    state.q(i) += 1e-4 * uniform(generator);
    state.v(i) = uniform(generator);
  }
  return state;
}

const AffineContactForce<double> kStick{900.0, -250.0, 2.7e7, 0.0, 2.1e7, 1.05, 0.0};

TEST(ConstrainedChain, HasTheEnergiesOfTheEliminatedChain) {
  const Chain eliminated(three_links());
  const ConstrainedChain constrained(three_links());
  const ChainState state = bent_and_moving(eliminated);
  const ChainState same = from_eliminated(constrained, state);
  const auto expect_equal = [](double a, double b) { EXPECT_NEAR(a, b, 1e-12 * std::abs(b)); };
  expect_equal(constrained.kinetic_energy_J(same.v), eliminated.kinetic_energy_J(state.v));
  expect_equal(constrained.strain_energy_J(same.q), eliminated.strain_energy_J(state.q));
  expect_equal(constrained.gravity_energy_J(same.q), eliminated.gravity_energy_J(state.q));
  EXPECT_EQ(constrained.tip(same).y_m, eliminated.tip(state).y_m);
}

TEST(ConstrainedChain, ConstraintsHoldForEveryStateOfTheEliminatedChain) {
  const Chain eliminated(three_links());
  const ConstrainedChain constrained(three_links());
  const ChainState same = from_eliminated(constrained, bent_and_moving(eliminated));
  Coordinates residual = Coordinates::Zero(2, constrained.rows());
  constrained.set_constraints(same.q, 1.0, residual);
  EXPECT_EQ(residual, Coordinates::Zero(2, constrained.rows()));
}

TEST(ConstrainedChain, ConstraintForcesDoWorkOnlyOnViolationsOfConstraints) {
  // dq . (Phi_qᵀ lambda) = lambda . Phi(dq) for every displacement dq, because a joint exerts
  // opposite forces on its two links. Only the pin exerts an external force.
  const ConstrainedChain chain(three_links());
  std::mt19937_64 generator(2);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto random = [&](Eigen::Index columns) {
    return Coordinates(Coordinates::NullaryExpr(2, columns, [&] { return uniform(generator); }));
  };
  for (int i = 0; i < 20; ++i) {
    Coordinates dq = random(chain.rows());
    const Coordinates multipliers_N = random(static_cast<Eigen::Index>(chain.links()));
    Coordinates forces = Coordinates::Zero(2, chain.rows());
    Coordinates breach = forces;
    chain.add_constraint_forces(multipliers_N, forces);
    chain.set_constraints(dq, 1.0, breach);
    const Coordinates breach_by_link = chain.take_multipliers(breach);
    EXPECT_NEAR(dq.cwiseProduct(forces).sum(), multipliers_N.cwiseProduct(breach_by_link).sum(),
                1e-13);
    EXPECT_EQ(breach.norm(), 0.0);
  }
}

TEST(ConstrainedChain, ConsistentAccelerationsAndReactionsAreThoseOfTheEliminatedChain) {
  const Chain eliminated(three_links());
  const ExplicitMotion by_elimination(eliminated);
  const GeneralizedAlphaMotion by_constraints(three_links());
  const ChainState state = bent_and_moving(eliminated);
  ChainState same = from_eliminated(by_constraints.chain(), state);
  by_constraints.restart(kStick, same);
  const TipState tip = eliminated.tip(state);
  Coordinates a(2, eliminated.rows());
  eliminated.accelerations(state.q.data(), kStick.ft_N(tip.x_m, tip.y_m), kStick.fn_N(tip.y_m),
                           a.data());
  const Eigen::Vector2d at_tip = a.col(eliminated.tip_row());
  const Eigen::Vector2d same_at_tip = same.acceleration.col(by_constraints.chain().tip_row());
  EXPECT_LT((same_at_tip - at_tip).norm(), 1e-9 * at_tip.norm());
  Eigen::Matrix2Xd expected_N;
  Eigen::Matrix2Xd reactions_N;
  by_elimination.reactions(kStick, state, expected_N);
  by_constraints.reactions(kStick, same, reactions_N);
  ASSERT_EQ(reactions_N.cols(), expected_N.cols());
  for (Eigen::Index joint = 0; joint < reactions_N.cols(); ++joint) {
    EXPECT_LT((reactions_N - expected_N).col(joint).norm(), 1e-8 * expected_N.col(joint).norm());
  }
}

TEST(GeneralizedAlpha, ParametersGiveSecondOrderForEverySpectralRadius) {
  for (const double xi : {0.0, 0.3, 0.9, 1.0}) {
    const GeneralizedAlphaParameters p(xi);
    EXPECT_NEAR(p.gamma, 0.5 - p.alpha_m + p.alpha_f, 1e-15);
    EXPECT_NEAR(p.beta, 0.25 * std::pow(p.gamma + 0.5, 2), 1e-15);
    EXPECT_NEAR(p.alpha_m, 3.0 * p.alpha_f - 1.0, 1e-15) << "least damping of low frequencies";
  }
}

}  // namespace
}  // namespace oblique::solver
