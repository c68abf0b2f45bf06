#include "worker/solver/reference/contact_events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <random>
#include <vector>

namespace oblique::solver {
namespace {

using testing::ElementsAre;

constexpr ContactParameters kParameters{1e6, 1.2, 0.5, 0.8};
constexpr double kStep_s = 1e-4;

/// Motion of the tip. Each function takes a time from 0 to the end of a step.
struct TipMotion {
  std::function<double(double)> x;
  std::function<double(double)> y;
  std::function<double(double)> vx;
  std::function<double(double)> vy;

  TipState at(double fraction) const {
    const double t = fraction * kStep_s;
    return {x(t), y(t), vx(t), vy(t)};
  }
};

/// Returns a motion with V_t = 1 and V_n = a + b z + c z^2; z goes from 0 to 1 in the step.
TipMotion with_normal_velocity(double a, double b, double c) {
  const double h = kStep_s;
  return {[](double t) { return t; },
          [=](double t) {
            const double z = t / h;
            return -1e-5 + h * (a * z + b * z * z / 2.0 + c * z * z * z / 3.0);
          },
          [](double) { return 1.0; },
          [=](double t) {
            const double z = t / h;
            return a + b * z + c * z * z;
          }};
}

std::optional<EventGuess> guess(const ContactLaw& law, ContactEvent event, const TipMotion& motion,
                                bool fresh = false) {
  return guess_event(law, event, motion.at(0.0), motion.at(1.0), kStep_s, 1.0, fresh);
}

ContactLaw slipping() {
  return ContactLaw(kParameters, {0.0, 0.0, 1.0, -1.0});
}
ContactLaw sticking() {
  return ContactLaw(kParameters, {0.0, 0.0, 0.1, -1.0});
}

/// Returns a law in restitution, with F_n = 10 N at y = -1e-5.
ContactLaw restitution(bool stick) {
  ContactLaw law = stick ? sticking() : slipping();
  law.turn({0.0, -1e-5, 1.0, 0.0});
  return law;
}

std::vector<ContactEvent> possible(const ContactLaw& law) {
  std::vector<ContactEvent> events;
  std::copy_if(kContactEvents.begin(), kContactEvents.end(), std::back_inserter(events),
               [&law](ContactEvent event) { return is_possible(law, event); });
  return events;
}

TEST(ContactEvents, EachRegimeHasItsEventsInTheirStatedOrder) {
  using enum ContactEvent;
  EXPECT_THAT(possible(slipping()), ElementsAre(kTurn, kStick));
  EXPECT_THAT(possible(restitution(false)), ElementsAre(kSeparation, kTurn, kStick));
  EXPECT_THAT(possible(sticking()),
              ElementsAre(kTurn, kSlipForward, kSlipBackward, kTangentialExtremum));
  EXPECT_THAT(possible(restitution(true)),
              ElementsAre(kSeparation, kTurn, kSlipForward, kSlipBackward, kTangentialExtremum));
}

TEST(ContactEvents, RatesAreTheDerivativesOfTheFunctionsDefinedByForces) {
  const TipMotion motion{[](double t) { return 2.0 * t; }, [](double t) { return -1e-5 - t; },
                         [](double) { return 2.0; }, [](double) { return -1.0; }};
  for (const ContactLaw& law : {slipping(), sticking(), restitution(false), restitution(true)}) {
    for (const ContactEvent event :
         {ContactEvent::kSeparation, ContactEvent::kSlipForward, ContactEvent::kSlipBackward}) {
      ASSERT_TRUE(is_force_event(event));
      const auto value = [&](double z) {
        return event_function(law, event, motion.at(z), 1.0).value;
      };
      // Forces are affine in time here, so the difference quotient has only rounding errors.
      EXPECT_NEAR(event_function(law, event, motion.at(0.5), 1.0).rate,
                  (value(1.0) - value(0.0)) / kStep_s, 1e-3);
    }
  }
}

TEST(ContactEvents, SignsAreThoseOfTheirDefinitions) {
  const ContactLaw compression = slipping();
  const TipState pressed{0.0, -1e-5, 1.0, -1.0};
  using enum ContactEvent;
  const auto value = [&](const ContactLaw& law, ContactEvent event, const TipState& tip) {
    return event_function(law, event, tip, 1.0).value;
  };
  EXPECT_LT(value(compression, kTurn, pressed), 0.0) << "moving down";
  EXPECT_GT(value(compression, kTurn, {0.0, -1e-5, 1.0, 1.0}), 0.0);
  EXPECT_GT(value(restitution(false), kTurn, pressed), 0.0) << "moving down again";
  EXPECT_LT(value(compression, kSeparation, pressed), 0.0) << "F_n > 0";
  EXPECT_LT(value(compression, kStick, {0.0, 0.0, 1.0, 0.0}), 0.0) << "P continues to slide";
  EXPECT_GT(value(compression, kStick, {0.0, 0.0, -1.0, 0.0}), 0.0);
  EXPECT_LT(value(sticking(), kSlipForward, pressed), 0.0) << "inside the cone";
  EXPECT_LT(value(sticking(), kSlipBackward, pressed), 0.0);
  EXPECT_GT(value(sticking(), kSlipForward, {1e-3, -1e-5, 1.0, 0.0}), 0.0) << "dragged forwards";
  EXPECT_GT(value(sticking(), kSlipBackward, {-1e-3, -1e-5, -1.0, 0.0}), 0.0);
}

TEST(GuessEvent, ATurnIsWhereVnRisesThroughZero) {
  struct Case {
    const char* what;
    double a, b, c;  ///< of V_n
    bool is_compression;
    bool is_fresh;
    double fraction;  ///< time of the event in steps; −1 without an event
    bool is_inside_only = false;
  };
  const Case cases[] = {
      {"(z - 0.3)(z + 2), crossed inside", -0.6, 1.7, 1.0, true, false, 0.3},
      {"stays below", -1.0, 0.5, 0.2, true, false, -1.0},
      {"in restitution V_n falls on its way to a turn", 0.5, -0.2, 0.0, false, false, -1.0},
      {"-(z - 0.4)(z - 0.6), above zero only between", -0.24, 1.0, -1.0, true, false, 0.4, true},
      {"a bump that stays below zero", -0.26, 1.0, -1.0, true, false, -1.0},
      {"zero at the end counts", -1.0, 1.0, 0.0, true, false, 1.0},
      {"zero at the start counts where it rises", 0.0, 1.0, 0.0, true, false, 0.0},
      {"above zero at the start", 0.1, 0.0, 0.0, true, false, 0.0},
      {"zero at the start, falling", 0.0, -1.0, 0.0, true, false, -1.0},
      {"fresh, falling", 0.0, -1.0, 0.0, true, true, -1.0},
      {"fresh, above zero by rounding, falling", 1e-16, -1.0, 0.0, true, true, -1.0},
      {"fresh, z (z - 0.7): falls, rises through zero later", 0.0, -0.7, 1.0, true, true, 0.7},
      {"fresh, rises all the way: left at once", 0.0, 1.0, 0.0, true, true, 0.0},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    const ContactLaw law = c.is_compression ? slipping() : restitution(false);
    const auto found =
        guess(law, ContactEvent::kTurn, with_normal_velocity(c.a, c.b, c.c), c.is_fresh);
    ASSERT_EQ(found.has_value(), c.fraction >= 0.0);
    if (found) {
      EXPECT_NEAR(found->fraction, c.fraction, 1e-12);
      EXPECT_NEAR(found->slope, c.b + 2.0 * c.c * c.fraction, 1e-10);
      EXPECT_EQ(found->inside_only, c.is_inside_only);
      if (c.is_inside_only) {
        EXPECT_NEAR(found->peak_fraction, 0.5, 1e-12);
      }
    }
  }
}

TEST(GuessEvent, AForceThatFallsToZeroAlongACubicIsFoundExactly) {
  // In restitution F_n = 10 N - k_n (y + 1e-5) with k_n = 1e6/0.64, so F_n is zero at y = -3.6e-6.
  const ContactLaw law = restitution(false);
  const TipMotion motion = with_normal_velocity(0.03, 0.04, 0.03);
  const auto found = guess(law, ContactEvent::kSeparation, motion);
  // F_n does not reach zero in this step.
  EXPECT_FALSE(found);
  const TipMotion faster = with_normal_velocity(0.1, 0.04, 0.03);
  const auto separation = guess(law, ContactEvent::kSeparation, faster);
  ASSERT_TRUE(separation) << "... but does within this one";
  EXPECT_NEAR(faster.at(separation->fraction).y_m, -3.6e-6, 1e-17);
}

TEST(GuessEvent, AFunctionThatIsZeroThroughoutIsNoEvent) {
  // The tip never moves along the ground.
  const TipMotion straight_down{[](double) { return 0.0; }, [](double t) { return -1e-5 - t; },
                                [](double) { return 0.0; }, [](double) { return -1.0; }};
  ContactParameters smooth = kParameters;
  smooth.mu = 0.0;
  const ContactLaw slip(smooth, {0.0, 0.0, 0.0, -1.0});
  const ContactLaw stick(kParameters, {0.0, 0.0, 0.0, -1.0});
  for (const bool fresh : {false, true}) {
    EXPECT_FALSE(guess(slip, ContactEvent::kStick, straight_down, fresh));
    EXPECT_FALSE(guess(stick, ContactEvent::kTangentialExtremum, straight_down, fresh));
  }
}

TEST(FarFromEvents, HoldsOnlyIfNoEventIsGuessedAndThenNearlyAlways) {
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int far = 0;
  int without_guess = 0;
  constexpr double h_s = 1e-6;
  const auto random_start = [&](double vx_m_s, double vy_m_s) {
    return TipState{1.5e-5 * uniform(generator), -2e-5 + 1e-5 * uniform(generator),
                    vx_m_s + uniform(generator), vy_m_s + 1.1 * uniform(generator)};
  };
  const auto random_end = [&](const TipState& start) {
    TipState end = start;
    end.vx_m_s += 0.2 * uniform(generator);
    end.vy_m_s += 0.2 * uniform(generator);
    end.x_m += h_s * (0.5 * (start.vx_m_s + end.vx_m_s) + 0.02 * uniform(generator));
    end.y_m += h_s * (0.5 * (start.vy_m_s + end.vy_m_s) + 0.02 * uniform(generator));
    return end;
  };
  for (const bool compression : {true, false}) {
    for (const bool stick : {true, false}) {
      for (int trial = 0; trial < 20'000; ++trial) {
        SCOPED_TRACE(trial);
        const ContactLaw law = compression ? (stick ? sticking() : slipping()) : restitution(stick);
        const double normal_m_s = compression ? -1.0 : 1.0;
        const TipState start = random_start(stick ? 0.5 : 1.0, normal_m_s);
        const TipState end = random_end(start);
        bool is_guessed = false;
        for (const ContactEvent event : possible(law)) {
          is_guessed = is_guessed || guess_event(law, event, start, end, h_s, 1.0, false);
        }
        const bool is_far = is_far_from_events(law, start, end, h_s, 1.0);
        EXPECT_FALSE(is_far && is_guessed);
        far += is_far ? 1 : 0;
        without_guess += is_guessed ? 0 : 1;
      }
    }
  }
  EXPECT_GT(far, 1000);
  EXPECT_GT(far, 0.8 * without_guess);
}

}  // namespace
}  // namespace oblique::solver
