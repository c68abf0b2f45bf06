#include "worker/solver/reference/contact_margin.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>

#include "worker/solver/reference/contact.h"

/// The margin of contacts whose tip moves as the test says, whatever the forces.
namespace oblique::solver {
namespace {

constexpr double k_N_m = 1e6;
constexpr double kEta2 = 1.25;
constexpr double kStep_s = 0.97e-6;  // what happens does so inside steps

/// Half a period of V_n, in which it goes from -1 to 1 m/s, but for what is added to it.
TipState half_period(double t_s, double vt_m_s) {
  constexpr double kRate = M_PI / 1e-4;
  return {vt_m_s * t_s, -std::sin(kRate * t_s) / kRate, vt_m_s, -std::cos(kRate * t_s)};
}

/// V_n rises from -1 m/s to `nearest` below zero within 50 us, and falls to -1 m/s again.
TipState grazing(double t_s, double nearest_m_s) {
  constexpr double kRate = 2.0 * M_PI / 1e-4;
  const double amplitude = 0.5 * (1.0 - nearest_m_s);
  const double mean = -0.5 * (1.0 + nearest_m_s);
  return {20.0 * t_s, mean * t_s - amplitude / kRate * std::sin(kRate * t_s), 20.0,
          mean - amplitude * std::cos(kRate * t_s)};
}

using TipPath = std::function<TipState(double t_s)>;

Contact followed(const TipPath& path, double mu, double until_s) {
  Contact contact({k_N_m, kEta2, mu, 1.0}, path(0.0), {kStep_s, kStep_s});
  while (!contact.finished() && contact.time_s() < until_s) {
    contact.judge(path(contact.time_s() + contact.trial_step_s()), {});
  }
  return contact;
}

ContactMargin::Nearest margin_of(const Contact& contact) {
  return contact.margin().nearest(contact.law().fn_N(contact.tip()) + 100.0);
}

TEST(ContactMargin, OfAVelocityThatNearlyTurnsIsWhatItKeptFromZero) {
  for (const double nearest_m_s : {1e-2, 1e-4, 1e-6}) {
    const Contact contact =
        followed([=](double t_s) { return grazing(t_s, nearest_m_s); }, 0.0, 1e-4);
    ASSERT_EQ(contact.events(), 0);
    const auto margin = margin_of(contact);
    const double speed_m_s = std::hypot(20.0, 1.0);
    EXPECT_NEAR(margin.distance * speed_m_s, nearest_m_s, 1e-7 + 1e-2 * nearest_m_s);
    EXPECT_EQ(margin.event, "turn");
  }
}

TEST(ContactMargin, OfARippleIsHowFarTheVelocityWentBeyondZero) {
  for (const double beyond_m_s : {1e-2, 1e-4, 1e-6}) {
    const Contact contact =
        followed([=](double t_s) { return grazing(t_s, -beyond_m_s); }, 0.0, 1e-4);
    ASSERT_EQ(contact.events(), 2) << "there and back";
    const auto margin = margin_of(contact);
    EXPECT_NEAR(margin.distance * std::hypot(20.0, 1.0), beyond_m_s, 1e-7 + 1e-2 * beyond_m_s);
    EXPECT_EQ(margin.event, "turn");
  }
}

TEST(ContactMargin, AtTouchIsWhatSeparatesStickFromSlip) {
  for (const double vt_m_s : {0.5 * kEta2 - 1e-3, 0.5 * kEta2 + 1e-3}) {
    const Contact contact =
        followed([=](double t_s) { return half_period(t_s, vt_m_s); }, 0.5, kStep_s);
    const auto margin = margin_of(contact);
    EXPECT_NEAR(margin.distance * std::hypot(vt_m_s, 1.0), 1e-3, 1e-12);
    EXPECT_EQ(margin.event, "touch");
  }
}

TEST(ContactMargin, OfASimpleBounceWithoutFrictionIsTheLargest) {
  // It turns once and leaves as fast as it came; that P never sticks is no matter of chance.
  const Contact contact = followed([](double t_s) { return half_period(t_s, 1e-9); }, 0.0, 1e-3);
  ASSERT_TRUE(contact.finished());
  EXPECT_EQ(contact.margin().nearest(100.0).distance, 1.0);
}

}  // namespace
}  // namespace oblique::solver
