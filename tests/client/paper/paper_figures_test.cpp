// The paper's figures as we draw them.
#include "client/paper/figures/paper_figures.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

const std::vector<PaperFigure>& figures() {
  static const auto all =
      paper_figures(solved_groups(published_table(), solver::Finger(solver::preset("paper"))));
  return all;
}

std::size_t known_in(const PaperFigure& figure) {
  std::size_t count = 0;
  for (const auto& panel : figure.figure.panels) {
    count += panel.known.size();
  }
  return count;
}

/// The nearest that a line of the panel comes to the point, as a share of its height.
double nearest_share(const plot::Panel& panel, const plot::KnownPoint& known) {
  double nearest = 1e9;
  for (const auto& curve : panel.curves) {
    for (std::size_t i = 0; i + 1 < curve.x.size(); ++i) {
      if (curve.x[i] <= known.x && known.x <= curve.x[i + 1]) {
        nearest = std::min(nearest, std::abs(curve.y[i] - known.y) / std::abs(known.y));
      }
    }
  }
  return nearest;
}

TEST(PaperFigures, AreThreeToSevenWithTheGroupsOfThePaper) {
  ASSERT_EQ(figures().size(), 5U);
  const std::vector<std::pair<std::string, std::size_t>> expected{{"fig3_hysteresis", 3},
                                                                  {"fig4_forces", 8},
                                                                  {"fig5_deformation", 4},
                                                                  {"fig6_velocity_of_P", 4},
                                                                  {"fig7_trajectory", 3}};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(figures()[i].name, expected[i].first);
    EXPECT_EQ(figures()[i].figure.panels.size(), expected[i].second);
  }
}

TEST(PaperFigures, MarkEveryPublishedNumberOfTheirGroups) {
  EXPECT_EQ(known_in(figures()[0]), 9U);   // peaks at three e*
  EXPECT_EQ(known_in(figures()[1]), 60U);  // 6 + 9 + 9 + 6 peaks of F_n, as many of F_t
  EXPECT_EQ(known_in(figures()[2]), 24U);  // 12 ends of phases over e*; those of e* = 1 thrice
  EXPECT_EQ(known_in(figures()[3]), 3U);   // ends of stick
  EXPECT_EQ(known_in(figures()[4]), 0U);   // nothing is published
}

TEST(PaperFigures, PublishedForcesLieOnOurLines) {
  for (const auto& panel : figures()[1].figure.panels) {
    for (const auto& known : panel.known) {
      EXPECT_LT(nearest_share(panel, known), 0.03) << panel.y.label << " at " << known.x;
    }
  }
}

}  // namespace
}  // namespace oblique::client
