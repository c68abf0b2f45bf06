#include "worker/solver/reference/generalized_alpha.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <utility>
#include <vector>

#include "tests/worker/solver/reference/chain_probe.h"
#include "tests/worker/solver/reference/from_eliminated.h"
#include "worker/solver/model/errors.h"

namespace oblique::solver {
namespace {

using testing::HasSubstr;

constexpr AffineContactForce<double> kNoContact{};

ModelParameters coarse_model() {
  ModelParameters model = preset("paper");
  model.elements_per_link = 2;
  return model;
}

/// Returns a contact force on the tip in both directions. It depends on the tip's displacement from
/// its present position.
AffineContactForce<double> push_at(const TipState& tip) {
  AffineContactForce<double> force;
  force.fn0 = 3000.0;
  force.ft0 = -1200.0;
  force.k_nn = 2.7e7;
  force.k_tn = 1.1e7;
  force.k_tt = 2.1e7;
  force.x0 = tip.x_m;
  force.y0 = tip.y_m;
  return force;
}

/// The state of a bent, moving chain, once with eliminated joints and once with constraints.
struct MovingChain {
  explicit MovingChain(const ModelParameters& parameters)
      : model(parameters), chain(model), motion(model) {
    std::mt19937_64 generator(7);
    state = chain.at_rest();
    state.q = ChainProbe(chain).random_coordinates(generator, 1e-4);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (Eigen::Index i = 2; i < state.v.size(); ++i) {
      state.v(i) = uniform(generator);
    }
    constrained = from_eliminated(motion.chain(), state);
  }
  /// Returns the largest gap Phi of positions or velocities at the pin and the joints.
  double largest_gap(const Coordinates& values) const {
    Coordinates gaps = Coordinates::Zero(2, motion.chain().rows());
    motion.chain().set_constraints(values, 1.0, gaps);
    return gaps.cwiseAbs().maxCoeff();
  }

  ModelParameters model = preset("paper");
  Chain chain;
  GeneralizedAlphaMotion motion;
  ChainState state;
  ChainState constrained;
};

TEST(GeneralizedAlpha, PinAndJointsHoldOverManySteps) {
  MovingChain moving(preset("paper"));
  const auto force = push_at(moving.chain.tip(moving.state));
  moving.motion.restart(force, moving.constrained);
  ChainState state = moving.constrained;
  ChainState next = state;
  for (int i = 0; i < 200; ++i) {
    moving.motion.step(state, force, 1e-6, next);
    std::swap(state, next);
    // The tolerance is the rounding of a coordinate of size 1.
    ASSERT_LE(moving.largest_gap(state.q), 1e-15);
  }
  EXPECT_LE(moving.largest_gap(state.v), 1e-9);
}

TEST(GeneralizedAlpha, TheReactionAtThePinCarriesTheHangingChain) {
  // The chain hangs straight down. The pin O carries the weight of the chain, and each joint
  // carries the weight below it. The links start unstretched, so the reactions oscillate around
  // these values.
  const ModelParameters model = preset("paper");
  const Chain chain(model);
  const GeneralizedAlphaMotion motion(model);
  ChainState state = chain.at_rest();
  state.q.row(1) = -state.q.row(0);
  state.q.row(0).setZero();
  state = from_eliminated(motion.chain(), state);
  motion.restart(kNoContact, state);
  ChainState next = state;
  Eigen::Matrix2Xd reactions_N;
  Eigen::Matrix<double, 2, 3> mean_N = Eigen::Matrix<double, 2, 3>::Zero();
  constexpr int kSteps = 20'000;
  for (int i = 0; i < kSteps; ++i) {
    motion.step(state, kNoContact, 2e-6, next);
    std::swap(state, next);
    motion.reactions(kNoContact, state, reactions_N);
    mean_N += reactions_N / kSteps;
    ASSERT_LT(reactions_N.row(0).cwiseAbs().maxCoeff(), 1e-6);
  }
  const double link_N = model.rho_kg_m3 * model.A_m2 * 0.4 * model.g_m_s2;
  for (int link = 0; link < 3; ++link) {
    EXPECT_NEAR(mean_N(1, link), link_N * (3 - link), 0.02 * link_N);
  }
}

/// Returns the fraction of a link's axial vibration that remains after `steps` steps. Each step is
/// a hundred times too long to resolve the vibration.
double stiff_vibration_left(double spectral_radius, int steps) {
  ModelParameters model = coarse_model();
  model.lengths_m = {0.4};
  model.g_m_s2 = 1e-12;
  model.spectral_radius = spectral_radius;
  const GeneralizedAlphaMotion motion(model);
  constexpr double kStretch_m = 1e-9;
  ChainState state = motion.at_rest();
  state.q(0, motion.chain().tip_row()) += kStretch_m;
  motion.restart(kNoContact, state);
  ChainState next = state;
  for (int i = 0; i < steps; ++i) {
    motion.step(state, kNoContact, 5e-3, next);
    std::swap(state, next);
  }
  return std::abs(motion.tip(state).x_m - 0.4) / kStretch_m;
}

TEST(GeneralizedAlpha, UnresolvedVibrationsDecayByTheSpectralRadius) {
  EXPECT_LT(stiff_vibration_left(0.0, 5), 1e-3);
  EXPECT_LT(stiff_vibration_left(0.5, 40), 1e-6);
  EXPECT_GT(stiff_vibration_left(0.9, 20), 0.1);
  EXPECT_LT(stiff_vibration_left(0.9, 200), 1e-5);
}

TEST(GeneralizedAlpha, AStepForWhichNewtonFailsIsASolveErrorWithItsTime) {
  MovingChain moving(coarse_model());
  moving.constrained.v *= 1e6;
  moving.motion.restart(kNoContact, moving.constrained);
  ChainState next;
  try {
    moving.motion.step(moving.constrained, kNoContact, 1.0, next);
    FAIL() << "the parameters were accepted";
  } catch (const SolveError& error) {
    EXPECT_THAT(error.what(), HasSubstr("step of 1 s"));
    EXPECT_THAT(error.what(), HasSubstr("at t = 1 s"));
  }
}

TEST(GeneralizedAlpha, StepsOfChangingLengthKeepTheOrder) {
  // Steps change their length around events. Half the step must give a quarter of the error.
  const auto error = [](int divisions) {
    MovingChain moving(coarse_model());
    const auto force = push_at(moving.chain.tip(moving.state));
    const auto run = [&](const std::vector<double>& pattern_s, int repeats) {
      ChainState state = moving.constrained;
      moving.motion.restart(force, state);
      ChainState next = state;
      for (int i = 0; i < repeats; ++i) {
        for (const double h_s : pattern_s) {
          moving.motion.step(state, force, h_s, next);
          std::swap(state, next);
        }
      }
      return moving.motion.tip(state);
    };
    const double h_s = 1e-6 / divisions;
    const TipState uneven = run({1.6 * h_s, 0.4 * h_s, 1.0 * h_s}, 10 * divisions);
    const TipState exact = run({3e-6 / 64}, 640);
    return std::hypot(uneven.x_m - exact.x_m, uneven.y_m - exact.y_m);
  };
  EXPECT_GT(error(2) / error(4), std::pow(2.0, 1.9));
}

}  // namespace
}  // namespace oblique::solver
