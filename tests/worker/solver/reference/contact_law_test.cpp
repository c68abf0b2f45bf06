#include "worker/solver/reference/contact_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace oblique::solver {
namespace {

constexpr ContactParameters kParameters{2.7e7, 1.25, 0.5, 0.7};
constexpr TipState kTouch{0.6, -1.0, -3.0, -2.0};

/// Returns a law with nonzero anchors, in slip or stick, after `turns` sign changes of V_n.
ContactLaw law_after(int turns, bool stick) {
  TipState tip{0.6, -1.0, stick ? -0.5 : -3.0, -2.0};
  ContactLaw law(kParameters, tip);
  tip.y_m -= 1e-4;
  tip.x_m -= 2e-5;
  for (int i = 0; i < turns; ++i) {
    law.turn(tip);
    tip.y_m += i % 2 == 0 ? 2e-5 : -3e-5;
    tip.x_m -= 1e-5;
  }
  return law;
}

std::vector<ContactLaw> all_regimes() {
  std::vector<ContactLaw> laws;
  for (int turns = 0; turns < 4; ++turns) {
    laws.push_back(law_after(turns, false));
    laws.push_back(law_after(turns, true));
  }
  return laws;
}

TipState random_tip(std::mt19937_64& generator) {
  std::uniform_real_distribution<double> way(-1e-4, 1e-4);
  std::uniform_real_distribution<double> speed(-3.0, 3.0);
  return {0.6 + way(generator), -1.0 - 1e-4 + way(generator), speed(generator), speed(generator)};
}

TEST(ContactLaw, TouchBeginsInCompressionWithoutForces) {
  const ContactLaw law(kParameters, kTouch);
  EXPECT_TRUE(law.is_compression());
  EXPECT_EQ(law.fn_N(kTouch), 0.0);
  EXPECT_EQ(law.ft_N(kTouch), 0.0);
}

TEST(ContactLaw, SticksAtTouchExactlyIfTheTipMovesSteeplyEnoughForTheFriction) {
  // The tip sticks if |V_t/V_n| < mu eta2 = 0.625.
  EXPECT_TRUE(ContactLaw(kParameters, {0.0, 0.0, 0.6249, -1.0}).is_stick());
  EXPECT_TRUE(ContactLaw(kParameters, {0.0, 0.0, -0.6249, -1.0}).is_stick());
  EXPECT_FALSE(ContactLaw(kParameters, {0.0, 0.0, 0.625, -1.0}).is_stick());
  EXPECT_FALSE(ContactLaw(kParameters, {0.0, 0.0, 0.6251, -1.0}).is_stick());
  ContactParameters smooth = kParameters;
  smooth.mu = 0.0;
  EXPECT_FALSE(ContactLaw(smooth, {0.0, 0.0, 0.0, -1.0}).is_stick());
}

TEST(ContactLaw, FrictionOpposesTheSlidingOfP) {
  for (const double vt_m_s : {-3.0, 3.0}) {
    const TipState touch{0.0, 0.0, vt_m_s, -2.0};
    const ContactLaw law(kParameters, touch);
    const TipState pressed{0.0, -1e-4, vt_m_s, -2.0};
    EXPECT_EQ(law.slip_direction() > 0.0, vt_m_s > 0.0);
    EXPECT_LT(law.ft_N(pressed) * vt_m_s, 0.0);
    EXPECT_DOUBLE_EQ(std::abs(law.ft_N(pressed)), kParameters.mu * law.fn_N(pressed));
  }
}

TEST(ContactLaw, SlopesAreKInCompressionAndKOverTheSquareOfRestitutionAfterEveryTurn) {
  for (int turns = 0; turns < 4; ++turns) {
    const ContactLaw law = law_after(turns, false);
    EXPECT_EQ(law.is_compression(), turns % 2 == 0);
    const double k = kParameters.k_N_m / (turns % 2 == 0 ? 1.0 : 0.49);
    EXPECT_DOUBLE_EQ(law.normal_stiffness_N_m(), k);
    const TipState low{0.6, -1.0002, 0.0, 0.0};
    const TipState high{0.6, -1.0001, 0.0, 0.0};
    EXPECT_NEAR(law.fn_N(low) - law.fn_N(high), k * 1e-4, 1e-9 * k);
  }
}

TEST(ContactLaw, ForcesAreContinuousAtATurn) {
  std::mt19937_64 generator(1);
  for (const ContactLaw& before : all_regimes()) {
    const TipState tip = random_tip(generator);
    ContactLaw after = before;
    after.turn(tip);
    EXPECT_NE(after.is_compression(), before.is_compression());
    EXPECT_EQ(after.is_stick(), before.is_stick());
    EXPECT_EQ(after.fn_N(tip), before.fn_N(tip));
    EXPECT_EQ(after.ft_N(tip), before.ft_N(tip));
  }
}

TEST(ContactLaw, ForcesAreContinuousWhenPStartsToSlideInEitherDirection) {
  for (const double side : {-1.0, 1.0}) {
    ContactLaw law(kParameters, {0.0, 0.0, -0.1 * side, -1.0});
    ASSERT_TRUE(law.is_stick());
    TipState tip{0.0, -1e-4, -0.1 * side, -1.0};
    // Moves the tip until F_t = side mu F_n.
    tip.x_m = -side * kParameters.mu * law.fn_N(tip) / law.tangential_stiffness_N_m();
    const double fn_N = law.fn_N(tip);
    const double ft_N = law.ft_N(tip);
    ASSERT_NEAR(ft_N, side * kParameters.mu * fn_N, 1e-9 * fn_N);
    law.start_slip(tip, -side);
    EXPECT_FALSE(law.is_stick());
    EXPECT_EQ(law.slip_direction(), -side);
    EXPECT_EQ(law.fn_N(tip), fn_N);
    EXPECT_NEAR(law.ft_N(tip), ft_N, 1e-12 * fn_N);
  }
}

TEST(ContactLaw, WithoutFrictionPReversesInsteadOfSticking) {
  ContactParameters smooth = kParameters;
  smooth.mu = 0.0;
  ContactLaw law(smooth, kTouch);
  const double s = law.slip_direction();
  law.stop_slip({0.6, -1.0001, 0.0, -1.0});
  EXPECT_FALSE(law.is_stick());
  EXPECT_EQ(law.slip_direction(), -s);
}

TEST(ContactLaw, RatesAreTheDerivativesOfTheForcesAlongTheMotion) {
  std::mt19937_64 generator(3);
  for (const ContactLaw& law : all_regimes()) {
    const TipState tip = random_tip(generator);
    const double h_s = 1e-6;
    const auto moved = [&](double t_s) {
      return TipState{tip.x_m + t_s * tip.vx_m_s, tip.y_m + t_s * tip.vy_m_s, tip.vx_m_s,
                      tip.vy_m_s};
    };
    // Forces are affine in positions, so the central difference has only rounding errors.
    const double fn_rate = (law.fn_N(moved(h_s)) - law.fn_N(moved(-h_s))) / (2.0 * h_s);
    const double ft_rate = (law.ft_N(moved(h_s)) - law.ft_N(moved(-h_s))) / (2.0 * h_s);
    EXPECT_NEAR(law.fn_rate_N_s(tip), fn_rate, 1e-8 * kParameters.k_N_m);
    EXPECT_NEAR(law.ft_rate_N_s(tip), ft_rate, 1e-8 * kParameters.k_N_m);
  }
}

TEST(ContactLaw, PMovesWithTheSlipVelocityInSlipAndIsAtRestInStick) {
  std::mt19937_64 generator(4);
  for (const ContactLaw& law : all_regimes()) {
    const TipState tip = random_tip(generator);
    const double h_s = 1e-6;
    const auto xP_m = [&](double t_s) {
      const TipState moved{tip.x_m + t_s * tip.vx_m_s, tip.y_m + t_s * tip.vy_m_s, 0.0, 0.0};
      return moved.x_m - law.ux_m(moved);
    };
    const double vP_m_s = (xP_m(h_s) - xP_m(-h_s)) / (2.0 * h_s);
    EXPECT_NEAR(vP_m_s, law.is_stick() ? 0.0 : law.slip_velocity_m_s(tip), 1e-8);
  }
}

TEST(ContactLaw, AffineFormGivesTheSameForces) {
  std::mt19937_64 generator(5);
  for (const ContactLaw& law : all_regimes()) {
    for (int i = 0; i < 20; ++i) {
      const TipState tip = random_tip(generator);
      const auto force = law.affine();
      EXPECT_NEAR(force.fn_N(tip.y_m), law.fn_N(tip), 1e-10 * kParameters.k_N_m * 1e-4);
      EXPECT_NEAR(force.ft_N(tip.x_m, tip.y_m), law.ft_N(tip), 1e-10 * kParameters.k_N_m * 1e-4);
    }
  }
}

}  // namespace
}  // namespace oblique::solver
