#include "worker/solver/reference/reaction_peaks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace oblique::solver {
namespace {

constexpr double kDuration_s = 3.0;

/// Mean of sin over a span, by its integral.
double mean_of_sine(double begin, double end) {
  return end > begin ? (std::cos(begin) - std::cos(end)) / (end - begin) : std::sin(begin);
}

void add(ReactionPeaks& peaks, double end_s, double width_s, double force_N) {
  const double squared_N2 = force_N * force_N;
  peaks.add(end_s, width_s, &squared_N2);
}

TEST(ReactionPeaks, MeansOverSpansGiveThePeakOfWhatTheyAreMeansOf) {
  ReactionPeaks peaks(1);
  constexpr double kSpan_s = 0.2;
  for (double t_s = 0.05; t_s < kDuration_s; t_s += kSpan_s) {
    add(peaks, t_s + kSpan_s, kSpan_s, 7.0 * mean_of_sine(t_s, t_s + kSpan_s));
  }
  const ReactionPeak peak = peaks.peaks().at(0);
  // The mean is (0.2)^2/24 = 1.7e-3 low; what is left is of order 4.
  EXPECT_NEAR(peak.force_N, 7.0, 7.0 * 1e-4);
  EXPECT_NEAR(peak.t_s, M_PI / 2.0, 1e-3);
}

TEST(ReactionPeaks, ValuesAtInstantsGiveThePeakBetweenThem) {
  ReactionPeaks peaks(1);
  for (double t_s = 0.0; t_s < kDuration_s; t_s += 0.2) {
    add(peaks, t_s, 0.0, 7.0 * std::sin(t_s));
    add(peaks, t_s, 0.0, 7.0 * std::sin(t_s));  // both sides of an event
  }
  const ReactionPeak peak = peaks.peaks().at(0);
  EXPECT_NEAR(peak.force_N, 7.0, 7.0 * 2e-4);
  EXPECT_NEAR(peak.t_s, M_PI / 2.0, 5e-3);
}

TEST(ReactionPeaks, SpansOfOtherLengthsBesideThePeakChangeLittle) {
  ReactionPeaks peaks(1);
  double t_s = 0.0;
  for (const double width_s :
       {0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.07, 0.13, 0.2, 0.2, 0.05, 0.2}) {
    add(peaks, t_s + width_s, width_s, mean_of_sine(t_s, t_s + width_s));
    t_s += width_s;
  }
  EXPECT_NEAR(peaks.peaks().at(0).force_N, 1.0, 1e-3);
}

TEST(ReactionPeaks, TheLargestOfSeveralCountsWhereverItLies) {
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

TEST(ReactionPeaks, APeakBetweenInstantsCountsThoughAnInstantOfAnotherIsHigher) {
  // 1 - (t - 1)^2 is met at its top, 1.005 - (t - 3.1)^2 a tenth beside it on either side.
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

TEST(ReactionPeaks, AForceThatOnlyFallsOrRisesIsLargestAtItsEnd) {
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

TEST(ReactionPeaks, OneSpanAloneIsItsOwnPeak) {
  ReactionPeaks peaks(1);
  add(peaks, 0.2, 0.2, 3.0);
  EXPECT_EQ(peaks.peaks().at(0).force_N, 3.0);
}

}  // namespace
}  // namespace oblique::solver
