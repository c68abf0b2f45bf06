// Tests that the margin of whole contacts is small only near changes of the mode.
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/worker/solver/cases/shared_fingers.h"

namespace oblique::solver {
namespace {

/// Two coefficients of friction between which the mode changes, and the critical event at each.
struct Change {
  double H_m;
  double e_star;
  double low_mu;
  double high_mu;
  const char* below;
  const char* above;
};

CaseResult solved(const Change& change, double mu) {
  return paper_finger().solve(change.H_m, mu, change.e_star);
}

/// Returns the coefficient of friction at which the mode changes.
double threshold(const Change& change) {
  double low = change.low_mu;
  double high = change.high_mu;
  const std::string mode = solved(change, low).mode;
  EXPECT_NE(solved(change, high).mode, mode);
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (solved(change, middle).mode == mode ? low : high) = middle;
  }
  return low;
}

TEST(Margin, FallsLinearlyToZeroOnBothSidesOfAChangeOfMode) {
  constexpr double kNear = 3e-5;
  for (const Change& change : {Change{1.0, 1.0, 0.58, 0.5866, "turn", "turn"},
                               Change{1.0, 1.0, 0.8733, 0.88, "touch", "touch"},
                               Change{1.0, 1.0, 0.9066, 0.9133, "separation", "separation"},
                               Change{1.0, 1.0, 1.08, 1.0866, "turn", "slip"},
                               Change{1.1, 1.0, 1.1666, 1.1733, "stick", "turn"},
                               Change{1.1, 0.8, 1.4533, 1.46, "slip", "slip"}}) {
    SCOPED_TRACE(change.low_mu);
    const double mu = threshold(change);
    for (const double side : {-1.0, 1.0}) {
      const CaseResult near = solved(change, mu * (1.0 + side * kNear));
      const CaseResult far = solved(change, mu * (1.0 + side * 2.0 * kNear));
      EXPECT_EQ(*near.margin_event, side < 0.0 ? change.below : change.above);
      EXPECT_EQ(*far.margin_event, *near.margin_event);
      // The margin has the order of magnitude of mu's relative distance from the change.
      EXPECT_GT(*near.margin, 0.03 * kNear);
      EXPECT_LT(*near.margin, 3.0 * kNear);
      EXPECT_NEAR(*far.margin / *near.margin, 2.0, 0.2);
    }
  }
}

TEST(Margin, IsTinyForTheKnownGrazingCaseAndNotForASmoothCase) {
  const CaseResult grazing = paper_finger().solve(1.0, 0.5844540064, 1.0);
  EXPECT_LT(*grazing.margin, 1e-5);
  EXPECT_EQ(*grazing.margin_event, "turn");
  EXPECT_GT(*paper_finger().solve(1.0, 0.4, 1.0).margin, 1e-2);
}

TEST(Margin, IsFromZeroToOneAndNamesAPossibleEvent) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    const double mu = i % 4 == 0 ? 0.0 : 2.0 * part(random);
    const CaseResult result =
        coarse_finger().solve(0.05 + 1.0 * part(random), mu, 0.3 + 0.7 * part(random));
    ASSERT_TRUE(result.margin.has_value());
    EXPECT_GE(*result.margin, 0.0);
    EXPECT_LE(*result.margin, 1.0);
    const auto names = mu == 0.0
                           ? std::set<std::string>{"separation", "turn"}
                           : std::set<std::string>{"touch", "separation", "turn", "slip", "stick"};
    EXPECT_TRUE(names.contains(*result.margin_event)) << *result.margin_event;
  }
}

}  // namespace
}  // namespace oblique::solver
