#include "worker/solver/reference/contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

/// Tests the contact of a tip that moves along a given path, regardless of the forces.
namespace oblique::solver {
namespace {

constexpr double k_N_m = 1e6;
constexpr double kEta2 = 1.25;
constexpr double kPeriod_s = 1e-3;

using TipPath = std::function<TipState(double t_s)>;

struct Event {
  double t_s;
  std::string state;  ///< after the event
};

std::string state_of(const Contact& contact) {
  return {contact.law().is_stick() ? 'S' : 's', contact.law().is_compression() ? 'C' : 'R'};
}

/// Follows the path until separation or `until_s`. Returns the events.
std::vector<Event> followed(Contact& contact, const TipPath& path, double until_s) {
  std::vector<Event> events;
  while (!contact.finished() && contact.time_s() < until_s) {
    const int before = contact.events();
    contact.judge(path(contact.time_s() + contact.trial_step_s()), {});
    if (contact.events() != before) {
      events.push_back({contact.time_s(), state_of(contact)});
    }
  }
  return events;
}

std::string mode_of(const Contact& contact) {
  return contact.record().result().mode;
}

TEST(Contact, AnAsymmetricCrossingInsideAStepIsLocated) {
  // V_n is above zero between 0.55 and 0.9 of the first step, and below zero at both of its ends.
  constexpr double kStep_s = 1e-4;
  const TipPath path = [](double t_s) -> TipState {
    const double z = t_s / kStep_s;
    const double way = -z * z * z / 3.0 + 1.45 * z * z / 2.0 - 0.495 * z;
    return {t_s, kStep_s * way, 1.0, -(z - 0.55) * (z - 0.9)};
  };
  Contact contact({k_N_m, kEta2, 0.5, 1.0}, path(0.0), {kStep_s, kStep_s});
  const auto events = followed(contact, path, kStep_s);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].t_s, 0.55 * kStep_s, 1e-12);
  EXPECT_EQ(events[0].state, "sR");
  EXPECT_NEAR(events[1].t_s, 0.9 * kStep_s, 1e-12);
  EXPECT_EQ(events[1].state, "sC");
}

/// Returns a path in which both forces rise and fall together for half a period. In the middle, the
/// end of compression coincides with the extremum of F_t. At the end, separation coincides with
/// slip in both directions. The tangential motion leads by `lead_s`. `skew` changes the errors of
/// the polynomials that approximate a step.
TipPath in_step(double lead_s, double skew = 0.0) {
  return [lead_s, skew](double t_s) -> TipState {
    constexpr double kRate = M_PI / kPeriod_s;
    const double z = kRate * t_s;
    const double ahead = kRate * (t_s + lead_s);
    const double sine = std::sin(ahead);
    return {3e-5 * sine * (1.0 + skew * sine * sine), -1e-4 * std::sin(z),
            3e-5 * kRate * std::cos(ahead) * (1.0 + 3.0 * skew * sine * sine),
            -1e-4 * kRate * std::cos(z)};
  };
}

TEST(Contact, EventsThatCoincideAreTakenInTheirStatedOrder) {
  // Events less than 1e-12 s apart count as simultaneous, in either order.
  for (const double lead_s : {0.0, 4e-13, -4e-13}) {
    SCOPED_TRACE(lead_s);
    const TipPath path = in_step(lead_s);
    Contact contact({k_N_m, kEta2, 0.5, 1.0}, path(0.0), {0.7e-4, 0.7e-4});
    const auto events = followed(contact, path, 2.0 * kPeriod_s);
    ASSERT_EQ(events.size(), 3U) << "turn, extremum of F_t, separation; no slip before it";
    EXPECT_NEAR(events[0].t_s, 0.5 * kPeriod_s, 1e-11);
    EXPECT_EQ(events[0].state, "SR") << "the turn comes before the extremum";
    EXPECT_NEAR(events[1].t_s, 0.5 * kPeriod_s, 1e-11);
    EXPECT_EQ(events[1].state, "SR");
    EXPECT_NEAR(events[2].t_s, kPeriod_s, 1e-11);
    EXPECT_TRUE(contact.finished());
    EXPECT_EQ(mode_of(contact), "SC SR");
  }
}

TEST(Contact, WhileAnEventIsLocatedACoincidingOneOfHigherRankReplacesIt) {
  // In the first step that contains both events, the polynomials have the extremum of F_t before
  // the turn (the end of compression). So the extremum is located first, and the turn is found only
  // at the common instant.
  struct Step {
    double skew;
    double h_s;
  };
  for (const auto [skew, h_s] : {Step{-0.3, 0.9e-4}, Step{-0.1, 1.1e-4}, Step{0.3, 0.7e-4}}) {
    SCOPED_TRACE(skew);
    const TipPath path = in_step(-4e-13, skew);
    Contact contact({k_N_m, kEta2, 0.5, 1.0}, path(0.0), {h_s, h_s});
    const auto events = followed(contact, path, 0.6 * kPeriod_s);
    ASSERT_GE(events.size(), 2U);
    EXPECT_EQ(events[0].state, "SR") << "the turn comes before the extremum";
    EXPECT_NEAR(events[0].t_s, 0.5 * kPeriod_s, 1e-11);
    EXPECT_EQ(events[1].state, "SR");
    EXPECT_NEAR(events[1].t_s, 0.5 * kPeriod_s, 1e-11);
  }
}

TEST(Contact, ATurnAndAnExtremumAtTheSameInstantHappenOnceEach) {
  // The polynomials may have their roots in any order, and rounding may separate them by any
  // distance.
  for (const double skew : {-0.3, -0.2, -0.1, -0.05, 0.05, 0.1, 0.2, 0.3}) {
    for (const double step_s : {0.6e-4, 0.7e-4, 0.9e-4, 1.1e-4}) {
      SCOPED_TRACE(skew);
      SCOPED_TRACE(step_s);
      const TipPath path = in_step(0.0, skew);
      Contact contact({k_N_m, kEta2, 0.5, 1.0}, path(0.0), {step_s, step_s});
      std::vector<Event> events;
      ASSERT_NO_THROW(events = followed(contact, path, 0.6 * kPeriod_s));
      ASSERT_EQ(events.size(), 2U);
      EXPECT_EQ(events[1].state, "SR");
      EXPECT_NEAR(events[0].t_s, 0.5 * kPeriod_s, 1e-11);
      EXPECT_NEAR(events[1].t_s, 0.5 * kPeriod_s, 1e-11);
    }
  }
}

TEST(Contact, ASlipThatRoundingPutsJustBeforeSeparationIsNotInTheMode) {
  for (const double skew : {-0.3, 0.3}) {
    SCOPED_TRACE(skew);
    const TipPath path = in_step(0.0, skew);
    Contact contact({k_N_m, kEta2, 0.5, 1.0}, path(0.0), {0.7e-4, 0.7e-4});
    const auto events = followed(contact, path, 2.0 * kPeriod_s);
    ASSERT_TRUE(contact.finished());
    EXPECT_EQ(events[0].state, "SR");
    EXPECT_EQ(mode_of(contact), "SC SR");
  }
}

TEST(Contact, ARegimeOfZeroDurationIsNotInTheMode) {
  // V_t and V_n reach zero together. The end of compression comes first, then stick begins.
  const TipPath path = [](double t_s) -> TipState {
    constexpr double kRate = M_PI / kPeriod_s;
    const double z = kRate * t_s;
    return {2e-4 * std::sin(z), -1e-4 * std::sin(z), 2e-4 * kRate * std::cos(z),
            -1e-4 * kRate * std::cos(z)};
  };
  Contact contact({k_N_m, kEta2, 0.5, 1.0}, path(0.0), {0.7e-4, 0.7e-4});
  const auto events = followed(contact, path, 0.6 * kPeriod_s);
  ASSERT_GE(events.size(), 2U);
  EXPECT_EQ(events[0].state, "sR");
  EXPECT_EQ(events[1].state, "SR");
  EXPECT_NEAR(events[1].t_s, events[0].t_s, 1e-12);
  followed(contact, path, 2.0 * kPeriod_s);
  ASSERT_TRUE(contact.finished());
  EXPECT_EQ(mode_of(contact).substr(0, 5), "sC SR");
}

}  // namespace
}  // namespace oblique::solver
