#include "worker/solver/reference/pefrl.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>

#include "worker/solver/reference/motion.h"

namespace oblique::solver {
namespace {

struct Oscillator {
  double q = 1.0;
  double v = 0.0;
};

/// Advances the oscillator q'' = -q by one step.
void step(double h, Oscillator& state) {
  for (std::size_t i = 0; i < Pefrl::kKicks; ++i) {
    state.q += Pefrl::drift[i] * h * state.v;
    state.v -= Pefrl::kick[i] * h * state.q;
  }
  state.q += Pefrl::drift[Pefrl::kKicks] * h * state.v;
}

double largest_swing(double h, int steps) {
  Oscillator state;
  double largest = 0.0;
  for (int i = 0; i < steps; ++i) {
    step(h, state);
    largest = std::max(largest, std::abs(state.q));
  }
  return largest;
}

/// Provides a bent, moving chain of two links, on which the contact force of a stick phase acts.
class PefrlOnAChain : public testing::Test {
 protected:
  PefrlOnAChain() {
    ModelParameters model = preset("paper");
    model.lengths_m = {0.4, 0.3};
    model.elements_per_link = 2;
    chain_ = std::make_unique<Chain>(model);
    motion_ = std::make_unique<ExplicitMotion>(*chain_);
    start_ = chain_->at_rest();
    for (Eigen::Index i = 2; i < start_.q.size(); ++i) {
      const auto phase = static_cast<double>(i);
      start_.q(i) += 1e-4 * std::sin(phase);
      start_.v(i) = std::cos(0.7 * phase);
    }
    const TipState tip = chain_->tip(start_);
    force_.fn0 = 1000.0;
    force_.ft0 = -300.0;
    force_.k_nn = 2.7e7;
    force_.k_tn = 1e6;
    force_.k_tt = 2e7;
    force_.x0 = tip.x_m;
    force_.y0 = tip.y_m;
  }

  struct End {
    ChainState state;
    ContactIntegrals<double> integrals;
  };
  End advance(double duration_s, int steps) const {
    End end{start_, {}};
    ChainState next;
    for (int i = 0; i < steps; ++i) {
      const auto step = motion_->step(end.state, force_, duration_s / steps, next);
      end.integrals.impulse_n += step.impulse_n;
      end.integrals.impulse_t += step.impulse_t;
      end.integrals.work_t += step.work_t;
      std::swap(end.state, next);
    }
    return end;
  }

  std::unique_ptr<Chain> chain_;
  std::unique_ptr<ExplicitMotion> motion_;
  ChainState start_;
  AffineContactForce<double> force_;
};

double distance(const Coordinates& a, const Coordinates& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

TEST(Pefrl, AnOscillatorStaysBoundedBelowTheStabilityLimitAndGrowsAboveIt) {
  const double limit = Pefrl::stability_limit();
  EXPECT_LT(largest_swing(0.999 * limit, 100'000), 1e3);
  EXPECT_GT(largest_swing(1.001 * limit, 100'000), 1e10);
}

TEST(Pefrl, TheTraceOfAnOscillatorsStepMatrixIsMinusTwoAtTheStabilityLimit) {
  const auto trace = [](double h) {
    Oscillator of_q{1.0, 0.0};
    Oscillator of_v{0.0, 1.0};
    step(h, of_q);
    step(h, of_v);
    return of_q.q + of_v.v;
  };
  EXPECT_NEAR(trace(Pefrl::stability_limit()), -2.0, 1e-9);
  EXPECT_GT(trace(0.999 * Pefrl::stability_limit()), -2.0);
  EXPECT_LT(trace(1.001 * Pefrl::stability_limit()), -2.0);
}

TEST(Pefrl, DriftsAndKicksAddUpToOneStep) {
  double drift = Pefrl::drift[Pefrl::kKicks];
  double kick = 0.0;
  for (std::size_t i = 0; i < Pefrl::kKicks; ++i) {
    drift += Pefrl::drift[i];
    kick += Pefrl::kick[i];
  }
  EXPECT_NEAR(drift, 1.0, 1e-15);
  EXPECT_NEAR(kick, 1.0, 1e-15);
}

TEST(Pefrl, HalvingTheStepDividesTheErrorOfAnOscillatorBySixteen) {
  const auto error = [](int steps) {
    Oscillator state;
    for (int i = 0; i < steps; ++i) {
      step(10.0 / steps, state);
    }
    return std::hypot(state.q - std::cos(10.0), state.v + std::sin(10.0));
  };
  EXPECT_NEAR(error(50) / error(100), 16.0, 0.5);
  EXPECT_NEAR(error(100) / error(200), 16.0, 0.2);
}

TEST_F(PefrlOnAChain, SteppingBackReturnsToTheStart) {
  ChainState there;
  ChainState back;
  ChainState state = start_;
  for (int i = 0; i < 20; ++i) {
    motion_->step(state, force_, 2e-6, there);
    std::swap(state, there);
  }
  for (int i = 0; i < 20; ++i) {
    motion_->step(state, force_, -2e-6, back);
    std::swap(state, back);
  }
  // The tolerances allow for rounding. The slopes in q are of size 1. The rates in v change by up
  // to 1e6 per second.
  EXPECT_LT(distance(state.q, start_.q), 1e-13);
  EXPECT_LT(distance(state.v, start_.v), 1e-7);
  EXPECT_LT(distance(state.v, start_.v), 1e-8 * distance(advance(4e-5, 20).state.v, start_.v));
}

TEST_F(PefrlOnAChain, StateAndContactIntegralsAreOfOrderFour) {
  constexpr double kDuration_s = 40e-6;
  const End exact = advance(kDuration_s, 2560);
  const End coarse = advance(kDuration_s, 40);
  const End fine = advance(kDuration_s, 80);
  constexpr double kSmallestRatio = 11.3;  // order 3.5
  const auto ratio = [](double coarse_value, double fine_value, double exact_value) {
    return std::abs(coarse_value - exact_value) / std::abs(fine_value - exact_value);
  };
  EXPECT_GT(distance(coarse.state.q, exact.state.q) / distance(fine.state.q, exact.state.q),
            kSmallestRatio);
  EXPECT_GT(distance(coarse.state.v, exact.state.v) / distance(fine.state.v, exact.state.v),
            kSmallestRatio);
  EXPECT_GT(ratio(coarse.integrals.impulse_n, fine.integrals.impulse_n, exact.integrals.impulse_n),
            kSmallestRatio);
  EXPECT_GT(ratio(coarse.integrals.impulse_t, fine.integrals.impulse_t, exact.integrals.impulse_t),
            kSmallestRatio);
  EXPECT_GT(ratio(coarse.integrals.work_t, fine.integrals.work_t, exact.integrals.work_t),
            kSmallestRatio);
}

TEST_F(PefrlOnAChain, ContactIntegralsAreTheIntegralsOfTheForceAlongThePath) {
  constexpr int kSteps = 4000;
  constexpr double kDuration_s = 40e-6;
  ContactIntegrals<double> trapezoid;
  ChainState state = start_;
  ChainState next;
  for (int i = 0; i < kSteps; ++i) {
    motion_->step(state, force_, kDuration_s / kSteps, next);
    const TipState a = chain_->tip(state);
    const TipState b = chain_->tip(next);
    const double half_s = 0.5 * kDuration_s / kSteps;
    const double ft_a = force_.ft_N(a.x_m, a.y_m);
    const double ft_b = force_.ft_N(b.x_m, b.y_m);
    trapezoid.impulse_n += half_s * (force_.fn_N(a.y_m) + force_.fn_N(b.y_m));
    trapezoid.impulse_t += half_s * (ft_a + ft_b);
    trapezoid.work_t += half_s * (ft_a * a.vx_m_s + ft_b * b.vx_m_s);
    std::swap(state, next);
  }
  const auto integrals = advance(kDuration_s, kSteps).integrals;
  // The trapezoidal rule has a relative error of (step / time scale of the motion)^2 = 1e-6.
  EXPECT_NEAR(integrals.impulse_n, trapezoid.impulse_n, 1e-5 * std::abs(trapezoid.impulse_n));
  EXPECT_NEAR(integrals.impulse_t, trapezoid.impulse_t, 1e-5 * std::abs(trapezoid.impulse_t));
  EXPECT_NEAR(integrals.work_t, trapezoid.work_t, 1e-5 * std::abs(trapezoid.work_t));
}

TEST_F(PefrlOnAChain, AChainAtRestIsStableBelowTheLimitOfItsHighestFrequencyOnly) {
  const double limit_s = Pefrl::stability_limit() / chain_->highest_frequency_rad_s(0.0);
  const auto swing = [&](double h_s) {
    ChainState state = chain_->at_rest();
    const ChainState rest = state;
    state.q(0, chain_->tip_row()) += 1e-9;
    ChainState next;
    for (int i = 0; i < 3000; ++i) {
      motion_->step(state, {}, h_s, next);
      std::swap(state, next);
    }
    return std::abs(state.q(0, chain_->tip_row()) - rest.q(0, chain_->tip_row()));
  };
  EXPECT_LT(swing(0.98 * limit_s), 1e-3);
  EXPECT_FALSE(swing(1.02 * limit_s) < 1e-2) << "grows until the chain bends or numbers overflow";
}

}  // namespace
}  // namespace oblique::solver
