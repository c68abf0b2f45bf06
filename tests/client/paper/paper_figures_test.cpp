// The paper's figures, drawn with our results.
#include "client/paper/paper_figures.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
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

/// Returns the curve of a panel's published numbers, drawn as diamonds; an empty curve if the panel
/// has none.
plot::Curve published_in(const plot::Panel& panel) {
  return panel.curves.back().mark == plot::Curve::Mark::kDiamonds ? panel.curves.back()
                                                                  : plot::Curve{};
}

std::size_t published_in(const PaperFigure& figure) {
  std::size_t count = 0;
  for (const auto& panel : figure.figure.panels) {
    count += published_in(panel).x.size();
  }
  return count;
}

/// Returns the smallest relative difference in y between the point (x, y) and a line of the panel.
double nearest_share(const plot::Panel& panel, double x, double y) {
  double nearest = 1e9;
  for (const auto& curve : panel.curves) {
    for (std::size_t i = 0; curve.mark == plot::Curve::Mark::kLine && i + 1 < curve.x.size(); ++i) {
      if (curve.x[i] <= x && x <= curve.x[i + 1]) {
        nearest = std::min(nearest, std::abs(curve.y[i] - y) / std::abs(y));
      }
    }
  }
  return nearest;
}

TEST(PaperFigures, AreFigures3To7WithTheGroupsOfThePaper) {
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
  EXPECT_EQ(published_in(figures()[0]), 9U);   // three peaks at each of three e*
  EXPECT_EQ(published_in(figures()[1]), 60U);  // 30 peaks of F_n and 30 of F_t
  EXPECT_EQ(published_in(figures()[2]), 24U);  // 12 ends of phases: 6 drawn once, 6 in three panels
  EXPECT_EQ(published_in(figures()[3]), 3U);   // ends of stick
  EXPECT_EQ(published_in(figures()[4]), 0U);   // nothing is published
}

TEST(PaperFigures, PublishedForcesAreOnOurCurves) {
  for (const auto& panel : figures()[1].figure.panels) {
    const auto published = published_in(panel);
    for (std::size_t i = 0; i < published.x.size(); ++i) {
      EXPECT_LT(nearest_share(panel, published.x[i], published.y[i]), 0.03)
          << panel.y.label << " at " << published.x[i];
    }
  }
}

}  // namespace
}  // namespace oblique::client
