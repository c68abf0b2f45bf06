#include "worker/solver/generalized_alpha.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <utility>
#include <vector>

#include "tests/worker/solver/chain_probe.h"
#include "worker/solver/beam_tangent.h"
#include "worker/solver/errors.h"

namespace oblique::solver {
namespace {

using testing::HasSubstr;

constexpr AffineContactForce<double> kNoContact{};

ModelParameters coarse_model() {
  ModelParameters model;
  model.elements_per_link = 2;
  return model;
}

/// A contact that pushes on the tip in both directions from where it is.
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

/// A bent chain in motion, in the coordinates of both systems.
struct MovingChain {
  explicit MovingChain(const ModelParameters& parameters)
      : model(parameters), chain(model), motion(model) {
    std::mt19937_64 generator(7);
    state = chain.at_rest();
    state.q = ChainProbe(chain).random_coordinates(generator, 1e-4);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (std::size_t i = 2; i < state.v.size(); ++i) {
      state.v[i] = uniform(generator);
    }
    constrained = motion.chain().from_eliminated(state);
  }
  /// Phi of positions or velocities: the largest gap at the pin and the joints.
  double largest_gap(const Coordinates& values) const {
    std::vector<double> rows(motion.chain().size(), 0.0);
    motion.chain().set_constraints(values, 1.0, rows);
    double largest = 0.0;
    for (const double gap : rows) {
      largest = std::max(largest, std::abs(gap));
    }
    return largest;
  }

  ModelParameters model;
  Chain chain;
  GeneralizedAlphaMotion motion;
  ChainState state;
  ChainState constrained;
};

TEST(BeamTangent, IsTheDerivativeOfTheElasticForce) {
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  constexpr double kLength = 0.1;
  constexpr double kHalfEALength = 50.0;
  constexpr double kBending = 0.7;
  std::array<double, 8> q{0.0, 0.0, 1.0, 0.0, kLength, 0.0, 1.0, 0.0};
  for (double& value : q) {
    value += kLength * uniform(generator);
  }
  const auto coefficients = [](const std::array<double, 8>& e) {
    return gradient_coefficients<double>({e[0], e[1]}, {e[2], e[3]}, {e[4], e[5]}, {e[6], e[7]},
                                         1.0 / kLength);
  };
  const auto map = gradient_map(1.0 / kLength);
  const auto force = [&](const std::array<double, 8>& e) {
    const auto f = elastic_gradient(coefficients(e), kHalfEALength, kBending);
    std::array<double, 8> result{};
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        result[i] += map[k][i / 2] * (i % 2 == 0 ? f.c[k].x : f.c[k].y);
      }
    }
    return result;
  };
  const ElementTangent tangent =
      elastic_tangent(coefficients(q), 1.0 / kLength, kHalfEALength, kBending);
  double largest = 0.0;
  for (const auto& row : tangent) {
    for (const double entry : row) {
      largest = std::max(largest, std::abs(entry));
    }
  }
  constexpr double kStep = 1e-6;
  for (std::size_t j = 0; j < 8; ++j) {
    auto forward = q;
    auto backward = q;
    forward[j] += kStep;
    backward[j] -= kStep;
    for (std::size_t i = 0; i < 8; ++i) {
      // The force is a cubic, so the central difference misses by its third derivative times h^2/6.
      EXPECT_NEAR(tangent[i][j], (force(forward)[i] - force(backward)[i]) / (2.0 * kStep),
                  1e-8 * largest)
          << i << ", " << j;
    }
  }
}

TEST(BandedLu, SolvesWhatADensePivotingSolverSolvesAlsoWithZerosOnTheDiagonal) {
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  constexpr std::size_t kBand = 3;
  for (const std::size_t n : {1U, 2U, 5U, 40U}) {
    BandedLu<kBand> banded(n);
    banded.set_zero();
    const auto size = static_cast<Eigen::Index>(n);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i < kBand ? 0 : i - kBand; j < std::min(n, i + kBand + 1); ++j) {
        // Every third diagonal entry is zero, as a multiplier's is, and others are tiny.
        const double value = n > 1 && i == j ? (i % 3 == 0 ? 0.0 : 1e-13) : uniform(generator);
        banded.add(i, j, value);
        dense(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = value;
      }
    }
    std::vector<double> right_side(n);
    for (double& value : right_side) {
      value = uniform(generator);
    }
    const Eigen::VectorXd expected =
        dense.fullPivLu().solve(Eigen::Map<const Eigen::VectorXd>(right_side.data(), size));
    ASSERT_TRUE(banded.factor());
    banded.solve(right_side);
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_NEAR(right_side[i], expected[static_cast<Eigen::Index>(i)],
                  1e-11 * expected.lpNorm<Eigen::Infinity>());
    }
  }
}

TEST(BandedLu, TellsASingularMatrix) {
  BandedLu<2> matrix(4);
  matrix.set_zero();
  for (std::size_t i = 0; i < 4; ++i) {
    matrix.add(i, i, i == 2 ? 0.0 : 1.0);
  }
  EXPECT_FALSE(matrix.factor());
}

TEST(ConstrainedChain, StateOfTheEliminatedChainKeepsItsEnergiesAndTip) {
  const MovingChain moving(ModelParameters{});
  const ConstrainedChain& constrained = moving.motion.chain();
  EXPECT_NEAR(constrained.kinetic_energy_J(moving.constrained.v),
              moving.chain.kinetic_energy_J(moving.state.v),
              1e-13 * moving.chain.kinetic_energy_J(moving.state.v));
  EXPECT_NEAR(constrained.strain_energy_J(moving.constrained.q),
              moving.chain.strain_energy_J(moving.state.q),
              1e-13 * moving.chain.strain_energy_J(moving.state.q));
  EXPECT_NEAR(constrained.gravity_energy_J(moving.constrained.q),
              moving.chain.gravity_energy_J(moving.state.q), 1e-13);
  const TipState one = moving.chain.tip(moving.state);
  const TipState other = constrained.tip(moving.constrained);
  EXPECT_EQ(one.x_m, other.x_m);
  EXPECT_EQ(one.y_m, other.y_m);
  EXPECT_EQ(one.vx_m_s, other.vx_m_s);
  EXPECT_EQ(one.vy_m_s, other.vy_m_s);
  EXPECT_EQ(moving.largest_gap(moving.constrained.q), 0.0);
}

TEST(GeneralizedAlpha, ConsistentAccelerationsAndReactionsAreThoseOfTheEliminatedChain) {
  MovingChain moving(ModelParameters{});
  const auto force = push_at(moving.chain.tip(moving.state));
  moving.motion.restart(force, moving.constrained);
  ChainState eliminated = moving.state;
  const TipState tip = moving.chain.tip(moving.state);
  moving.chain.accelerations(moving.state.q.data(), force.ft_N(tip.x_m, tip.y_m),
                             force.fn_N(tip.y_m), eliminated.v.data());
  const Coordinates expected = moving.motion.chain().from_eliminated(eliminated).v;
  double scale = 0.0;
  for (const double a : expected) {
    scale = std::max(scale, std::abs(a));
  }
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(moving.constrained.acceleration[i], expected[i], 1e-11 * scale);
  }
  const auto one = moving.motion.reactions(force, moving.constrained);
  const auto other = ExplicitMotion(moving.chain).reactions(force, moving.state);
  ASSERT_EQ(one.size(), 3U);
  for (std::size_t link = 0; link < one.size(); ++link) {
    const double size_N = std::hypot(other[link].x_N, other[link].y_N);
    EXPECT_GT(size_N, 100.0);
    EXPECT_NEAR(one[link].x_N, other[link].x_N, 1e-10 * size_N);
    EXPECT_NEAR(one[link].y_N, other[link].y_N, 1e-10 * size_N);
  }
}

TEST(GeneralizedAlpha, PinAndJointsHoldOverManySteps) {
  MovingChain moving(ModelParameters{});
  const auto force = push_at(moving.chain.tip(moving.state));
  moving.motion.restart(force, moving.constrained);
  ChainState state = moving.constrained;
  ChainState next = state;
  for (int i = 0; i < 200; ++i) {
    moving.motion.step(state, force, 1e-6, next);
    std::swap(state, next);
    // One rounding of a coordinate of about 1.
    ASSERT_LE(moving.largest_gap(state.q), 1e-15);
  }
  EXPECT_LE(moving.largest_gap(state.v), 1e-9);
}

TEST(GeneralizedAlpha, ReactionAtThePinHoldsTheHangingChain) {
  // Straight down and at rest: O carries the weight, each joint what hangs below it. The links
  // stretch a little from rest, so the reactions swing about that.
  const ModelParameters model;
  const Chain chain(model);
  const GeneralizedAlphaMotion motion(model);
  ChainState state = chain.at_rest();
  for (std::size_t i = 0; i < state.q.size(); i += 2) {
    state.q[i + 1] = -state.q[i];
    state.q[i] = 0.0;
  }
  state = motion.chain().from_eliminated(state);
  motion.restart(kNoContact, state);
  ChainState next = state;
  std::vector<double> mean_N(3, 0.0);
  constexpr int kSteps = 20'000;
  for (int i = 0; i < kSteps; ++i) {
    motion.step(state, kNoContact, 2e-6, next);
    std::swap(state, next);
    const auto reactions = motion.reactions(kNoContact, state);
    for (std::size_t link = 0; link < 3; ++link) {
      mean_N[link] += reactions[link].y_N / kSteps;
      ASSERT_NEAR(reactions[link].x_N, 0.0, 1e-6);
    }
  }
  const double link_N = model.rho_kg_m3 * model.A_m2 * 0.4 * model.g_m_s2;
  for (std::size_t link = 0; link < 3; ++link) {
    EXPECT_NEAR(mean_N[link], link_N * static_cast<double>(3 - link), 0.02 * link_N);
  }
}

TEST(GeneralizedAlpha, ParametersAreThoseOfTheSpectralRadius) {
  const GeneralizedAlphaParameters half(0.5);
  EXPECT_DOUBLE_EQ(half.alpha_m, 0.0);
  EXPECT_DOUBLE_EQ(half.alpha_f, 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(half.gamma, 0.5 + 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(half.beta, 4.0 / 9.0);
}

/// What is left, after `steps` steps a hundred times too long for it, of a link's vibration along
/// itself.
double stiff_vibration_left(double spectral_radius, int steps) {
  ModelParameters model = coarse_model();
  model.lengths_m = {0.4};
  model.g_m_s2 = 1e-12;
  model.spectral_radius = spectral_radius;
  const GeneralizedAlphaMotion motion(model);
  constexpr double kStretch_m = 1e-9;
  ChainState state = motion.at_rest();
  state.q[motion.chain().tip_index()] += kStretch_m;
  motion.restart(kNoContact, state);
  ChainState next = state;
  for (int i = 0; i < steps; ++i) {
    motion.step(state, kNoContact, 5e-3, next);
    std::swap(state, next);
  }
  return std::abs(motion.tip(state).x_m - 0.4) / kStretch_m;
}

TEST(GeneralizedAlpha, SpectralRadiusSaysHowFastUnresolvedVibrationsGo) {
  EXPECT_LT(stiff_vibration_left(0.0, 5), 1e-3);
  EXPECT_LT(stiff_vibration_left(0.5, 40), 1e-6);
  EXPECT_GT(stiff_vibration_left(0.9, 20), 0.1);
  EXPECT_LT(stiff_vibration_left(0.9, 200), 1e-5);
}

TEST(GeneralizedAlpha, SpectralRadiusOfOneIsRefusedWithTheReason) {
  ModelParameters model;
  model.spectral_radius = 1.0;
  try {
    const GeneralizedAlphaMotion motion(model);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("spectral_radius = 1"));
    EXPECT_THAT(error.what(), HasSubstr("nothing damps the multipliers"));
  }
}

TEST(GeneralizedAlpha, StepThatNewtonCannotSolveIsASolveErrorWithItsTime) {
  MovingChain moving(coarse_model());
  for (double& rate : moving.constrained.v) {
    rate *= 1e6;
  }
  moving.motion.restart(kNoContact, moving.constrained);
  ChainState next;
  try {
    moving.motion.step(moving.constrained, kNoContact, 1.0, next);
    FAIL() << "accepted";
  } catch (const SolveError& error) {
    EXPECT_THAT(error.what(), HasSubstr("step of 1 s"));
    EXPECT_THAT(error.what(), HasSubstr("at t = 1 s"));
  }
}

TEST(GeneralizedAlpha, StepOfNoLengthChangesNothing) {
  MovingChain moving(coarse_model());
  moving.motion.restart(kNoContact, moving.constrained);
  ChainState next;
  const auto integrals = moving.motion.step(moving.constrained, kNoContact, 0.0, next);
  EXPECT_EQ(next.q, moving.constrained.q);
  EXPECT_EQ(next.v, moving.constrained.v);
  EXPECT_EQ(integrals.impulse_n, 0.0);
}

TEST(GeneralizedAlpha, AShorterStepAfterALongOneKeepsTheOrder) {
  // Steps of changing length, as events make them, against equal ones: errors fall by four.
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
