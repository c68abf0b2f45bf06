#include "worker/solver/reference/contact_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "worker/solver/reference/contact.h"

namespace oblique::solver {
namespace {

constexpr ContactParameters kParameters{1e6, 1.25, 0.5, 1.0};
/// Tangential stiffness in stick: F_t = -kTangential_N_m x.
constexpr double kTangential_N_m = 1e6 / 1.25;

constexpr TipState at(double x_m, double y_m) {
  return {x_m, y_m, 0.0, 0.0};
}

/// Advances a contact step by step: law, record and position of the tip.
struct RecordedContact {
  explicit RecordedContact(double vt_in_m_s)
      : tip{0.0, 0.0, vt_in_m_s, -1.0}, law(kParameters, tip), record(law, tip) {}

  void step_to(const TipState& end, const ContactIntegrals<double>& integrals = {}) {
    record.add_step(law, tip, end, integrals);
    tip = end;
  }
  void turn(double t_s) {
    record.add_turn(law, tip, t_s);
    law.turn(tip);
    record.add_state(law, tip, t_s);
  }
  void slip(double t_s) {
    law.start_slip(tip, law.ft_N(tip) > 0.0 ? -1.0 : 1.0);
    record.add_state(law, tip, t_s);
  }
  void stick(double t_s) {
    law.stop_slip(tip);
    record.add_state(law, tip, t_s);
  }
  CaseResult finished(double t_s) {
    record.finish(law, tip, t_s);
    return record.result();
  }

  TipState tip;
  ContactLaw law;
  ContactRecord record;
};

constexpr double kSticking_m_s = 0.1;
constexpr double kSliding_m_s = 1.0;

TEST(ContactRecord, StickThroughATurnIsOneInterval) {
  RecordedContact contact(kSticking_m_s);
  contact.step_to(at(1e-6, -1e-4));
  contact.turn(1e-4);
  contact.step_to(at(1e-6, -5e-5));
  contact.slip(1.5e-4);
  contact.step_to(at(1e-6, 0.0));
  const CaseResult result = contact.finished(2e-4);
  EXPECT_EQ(result.mode, "SC SR sR");
  ASSERT_EQ(result.stick_intervals.size(), 1U);
  EXPECT_EQ(result.stick_intervals[0].t0_s, 0.0);
  EXPECT_EQ(result.stick_intervals[0].t1_s, 1.5e-4);
  EXPECT_EQ(result.stick_total_s, 1.5e-4);
}

TEST(ContactRecord, AStateOfZeroDurationIsNotInTheMode) {
  RecordedContact contact(kSliding_m_s);
  contact.step_to(at(1e-6, -1e-4));
  contact.turn(1e-4);   // a phase sR of zero duration
  contact.stick(1e-4);  // SR
  contact.step_to(at(1e-6, 0.0));
  const CaseResult result = contact.finished(2e-4);
  EXPECT_EQ(result.mode, "sC SR");
  ASSERT_EQ(result.stick_intervals.size(), 1U);
  EXPECT_EQ(result.stick_intervals[0].t0_s, 1e-4);
}

TEST(ContactRecord, AStateThatBeginsAtSeparationIsNotInTheMode) {
  RecordedContact contact(kSticking_m_s);
  contact.step_to(at(1e-6, -1e-4));
  contact.turn(1e-4);
  contact.step_to(at(0.0, 0.0));
  contact.slip(2e-4);
  const CaseResult result = contact.finished(2e-4);
  EXPECT_EQ(result.mode, "SC SR");
  ASSERT_EQ(result.stick_intervals.size(), 1U);
  EXPECT_EQ(result.stick_intervals[0].t1_s, 2e-4);
}

TEST(ContactRecord, TheTangentialForceOfAPeakIncludesAdjacentValleys) {
  RecordedContact contact(kSticking_m_s);
  contact.step_to(at(-4e-5, -1e-4));
  contact.turn(1e-4);
  contact.step_to(at(-5e-5, -5e-5));  // a minimum of F_n, where |F_t| is largest
  contact.turn(2e-4);
  contact.step_to(at(-1e-5, -8e-5));
  contact.turn(3e-4);
  contact.step_to(at(0.0, 0.0));
  const CaseResult result = contact.finished(4e-4);
  ASSERT_EQ(result.peaks.size(), 2U);
  EXPECT_DOUBLE_EQ(result.peaks[0].ft_N, kTangential_N_m * 5e-5);
  EXPECT_DOUBLE_EQ(result.peaks[1].ft_N, kTangential_N_m * 5e-5);
  EXPECT_DOUBLE_EQ(result.ft_peak_N, kTangential_N_m * 5e-5);
}

TEST(ContactRecord, ExchangedWorkIsTheSumOfAbsoluteValuesInBothDirections) {
  RecordedContact contact(kSticking_m_s);
  ContactIntegrals<double> integrals;
  integrals.work_t = 0.25;
  contact.step_to(at(0.0, -1e-3), integrals);
  contact.turn(1e-4);
  integrals.work_t = -0.375;
  contact.step_to(at(0.0, 0.0), integrals);
  const CaseResult result = contact.finished(2e-4);
  // A normal force of up to 1e6 N/m * 1e-3 m exchanges half a joule in compression and half a joule
  // in restitution. The tangential work is added.
  EXPECT_DOUBLE_EQ(result.energy.exchanged_J, 0.5 + 0.5 + 0.25 + 0.375);
  EXPECT_DOUBLE_EQ(result.energy.friction_J, 0.125);
  EXPECT_NEAR(result.energy.restitution_J, 0.0, 1e-15);
}

using testing::ElementsAreArray;

TEST(WithoutRipples, KeepsPeaksAndValleysThatDifferByAtLeastFivePercentOfTheLargestPeak) {
  struct Case {
    const char* what;
    std::vector<double> fn_N;
    std::vector<bool> survives;
  };
  const Case cases[] = {
      {"nothing", {}, {}},
      {"one peak", {100}, {true}},
      {"two deep peaks", {100, 50, 90}, {true, true, true}},
      {"exactly 5 % apart stays", {100, 45, 50}, {true, true, true}},
      {"just less goes", {100, 45.1, 50}, {true, false, false}},
      {"ripple on the way up", {40, 37, 100}, {false, false, true}},
      {"ripple on the way down", {100, 30, 33}, {true, false, false}},
      {"ripple on the way down, then a peak",
       {100, 30, 33, 10, 60},
       {true, false, false, true, true}},
      {"ripple at the foot of a later peak",
       {100, 20, 23, 21, 80},
       {true, true, false, false, true}},
      {"the shallowest goes first", {100, 50, 54, 51, 90}, {true, true, false, false, true}},
      {"two ripples on one slope", {100, 70, 72, 40, 43}, {true, false, false, false, false}},
      {"all ripples leave the largest", {98, 96, 100, 97, 99}, {false, false, true, false, false}},
  };
  for (const Case& c : cases) {
    EXPECT_THAT(without_ripples(c.fn_N), ElementsAreArray(c.survives)) << c.what;
  }
}

TEST(WithoutRipples, RemainingExtremaAlternateStartAndEndWithAPeakAndContainTheLargest) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<double> fn_N{uniform(generator)};
    const int ripples = trial % 8;
    for (int i = 0; i < ripples; ++i) {
      fn_N.push_back(fn_N.back() * uniform(generator));
      fn_N.push_back(fn_N.back() + uniform(generator) * (i % 2 == 0 ? 0.05 : 1.0));
    }
    const auto survives = without_ripples(fn_N);
    const double largest = *std::max_element(fn_N.begin(), fn_N.end());
    std::vector<double> left;
    bool expect_peak = true;
    for (std::size_t i = 0; i < fn_N.size(); ++i) {
      if (survives[i]) {
        EXPECT_EQ(i % 2 == 0, expect_peak) << "peaks and valleys alternate";
        expect_peak = !expect_peak;
        left.push_back(fn_N[i]);
      }
    }
    ASSERT_EQ(left.size() % 2, 1U);
    EXPECT_EQ(*std::max_element(left.begin(), left.end()), largest);
    for (std::size_t i = 1; i < left.size(); ++i) {
      EXPECT_GE(std::abs(left[i] - left[i - 1]), 0.05 * largest);
    }
  }
}

constexpr double k_N_m = 1e6;
constexpr double kEta2 = 1.25;
constexpr double kStep_s = 0.97e-6;  // no step of this length ends at an event

/// Returns the tip's state during half a period, in which V_n goes from -1 to 1 m/s.
TipState half_period(double t_s, double vt_m_s) {
  constexpr double kRate = M_PI / 1e-4;
  return {vt_m_s * t_s, -std::sin(kRate * t_s) / kRate, vt_m_s, -std::cos(kRate * t_s)};
}

/// Returns a tip whose V_n rises from -1 m/s to -`nearest_m_s` in 50 us and falls back to -1 m/s.
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

TEST(ContactMargin, OfANearTurnIsTheSmallestDistanceOfTheVelocityFromZero) {
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

TEST(ContactMargin, OfARippleIsTheLargestVelocityBetweenItsTurns) {
  for (const double beyond_m_s : {1e-2, 1e-4, 1e-6}) {
    const Contact contact =
        followed([=](double t_s) { return grazing(t_s, -beyond_m_s); }, 0.0, 1e-4);
    ASSERT_EQ(contact.events(), 2) << "two turns";
    const auto margin = margin_of(contact);
    EXPECT_NEAR(margin.distance * std::hypot(20.0, 1.0), beyond_m_s, 1e-7 + 1e-2 * beyond_m_s);
    EXPECT_EQ(margin.event, "turn");
  }
}

TEST(ContactMargin, AtTouchIsTheDistanceBetweenStickAndSlip) {
  for (const double vt_m_s : {0.5 * kEta2 - 1e-3, 0.5 * kEta2 + 1e-3}) {
    const Contact contact =
        followed([=](double t_s) { return half_period(t_s, vt_m_s); }, 0.5, kStep_s);
    const auto margin = margin_of(contact);
    EXPECT_NEAR(margin.distance * std::hypot(vt_m_s, 1.0), 1e-3, 1e-12);
    EXPECT_EQ(margin.event, "touch");
  }
}

TEST(ContactMargin, OfASimpleBounceWithoutFrictionIsOne) {
  // The contact has one compression, and the tip leaves as fast as it arrived. Stick does not
  // count, because P never sticks without friction.
  const Contact contact = followed([](double t_s) { return half_period(t_s, 1e-9); }, 0.0, 1e-3);
  ASSERT_TRUE(contact.finished());
  EXPECT_EQ(contact.margin().nearest(100.0).distance, 1.0);
}

constexpr double kDuration_s = 3.0;

/// Returns the mean of the sine over an interval.
double mean_of_sine(double begin, double end) {
  return end > begin ? (std::cos(begin) - std::cos(end)) / (end - begin) : std::sin(begin);
}

void add(ReactionPeaks& peaks, double end_s, double width_s, double force_N) {
  const double squared_N2 = force_N * force_N;
  peaks.add(end_s, width_s, &squared_N2);
}

TEST(ReactionPeaks, MeansOverIntervalsGiveThePeakOfTheFunction) {
  ReactionPeaks peaks(1);
  constexpr double kSpan_s = 0.2;
  for (double t_s = 0.05; t_s < kDuration_s; t_s += kSpan_s) {
    add(peaks, t_s + kSpan_s, kSpan_s, 7.0 * mean_of_sine(t_s, t_s + kSpan_s));
  }
  const ReactionPeak peak = peaks.peaks().at(0);
  // The mean over an interval is lower than the peak by the fraction 0.2^2/24 = 1.7e-3.
  // ReactionPeaks corrects this error; an error of order 4 remains.
  EXPECT_NEAR(peak.force_N, 7.0, 7.0 * 1e-4);
  EXPECT_NEAR(peak.t_s, M_PI / 2.0, 1e-3);
}

TEST(ReactionPeaks, ValuesAtInstantsGiveThePeakBetweenThem) {
  ReactionPeaks peaks(1);
  for (double t_s = 0.0; t_s < kDuration_s; t_s += 0.2) {
    add(peaks, t_s, 0.0, 7.0 * std::sin(t_s));
    add(peaks, t_s, 0.0, 7.0 * std::sin(t_s));  // added twice, like the rows of an event
  }
  const ReactionPeak peak = peaks.peaks().at(0);
  EXPECT_NEAR(peak.force_N, 7.0, 7.0 * 2e-4);
  EXPECT_NEAR(peak.t_s, M_PI / 2.0, 5e-3);
}

TEST(ReactionPeaks, IntervalsOfOtherLengthsBesideThePeakChangeLittle) {
  ReactionPeaks peaks(1);
  double t_s = 0.0;
  for (const double width_s :
       {0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.07, 0.13, 0.2, 0.2, 0.05, 0.2}) {
    add(peaks, t_s + width_s, width_s, mean_of_sine(t_s, t_s + width_s));
    t_s += width_s;
  }
  EXPECT_NEAR(peaks.peaks().at(0).force_N, 1.0, 1e-3);
}

TEST(ReactionPeaks, TheLargestOfSeveralPeaksCounts) {
  for (const double grows : {-0.1, 0.1}) {
    ReactionPeaks peaks(1);
    for (double t_s = 0.0; t_s < 6.0 * M_PI; t_s += 0.1) {
      add(peaks, t_s, 0.0, std::exp(grows * t_s) * (1.0 - std::cos(t_s)));
    }
    const double first_s = grows < 0.0 ? M_PI : 5.0 * M_PI;
    EXPECT_NEAR(peaks.peaks().at(0).t_s, first_s, 0.2);
    EXPECT_NEAR(peaks.peaks().at(0).force_N, 2.0 * std::exp(grows * first_s),
                0.02 * 2.0 * std::exp(grows * first_s));
  }
}

TEST(ReactionPeaks, APeakBetweenInstantsCountsEvenIfAnInstantOfAnotherPeakIsHigher) {
  // The maximum of 1 - (t - 1)^2 is at an instant of the loop. The maximum of 1.005 - (t - 3.1)^2
  // is in the middle between two instants.
  ReactionPeaks peaks(1);
  for (int i = 0; i <= 20; ++i) {
    const double t_s = 0.2 * i;
    const double first = 1.0 - (t_s - 1.0) * (t_s - 1.0);
    const double second = 1.005 - (t_s - 3.1) * (t_s - 3.1);
    add(peaks, t_s, 0.0, std::max({first, second, 0.0}));
  }
  EXPECT_NEAR(peaks.peaks().at(0).force_N, 1.005, 1e-12);
  EXPECT_NEAR(peaks.peaks().at(0).t_s, 3.1, 1e-12);
}

TEST(ReactionPeaks, AMonotonicForceIsLargestAtAnEnd) {
  ReactionPeaks falls(1);
  ReactionPeaks rises(1);
  for (int i = 0; i < 5; ++i) {
    add(falls, 0.2 * (i + 1), 0.2, 10.0 - (i + 0.5));
    add(rises, 0.2 * (i + 1), 0.2, 5.0 + (i + 0.5));
  }
  EXPECT_NEAR(falls.peaks().at(0).force_N, 10.0, 1e-12);
  EXPECT_NEAR(falls.peaks().at(0).t_s, 0.0, 1e-12);
  EXPECT_NEAR(rises.peaks().at(0).force_N, 10.0, 1e-12);
  EXPECT_NEAR(rises.peaks().at(0).t_s, 1.0, 1e-12);
}

TEST(ReactionPeaks, TheMeanOfASingleIntervalIsThePeak) {
  ReactionPeaks peaks(1);
  add(peaks, 0.2, 0.2, 3.0);
  EXPECT_EQ(peaks.peaks().at(0).force_N, 3.0);
}

}  // namespace
}  // namespace oblique::solver
