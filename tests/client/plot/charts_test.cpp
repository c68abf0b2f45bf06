// Lines, points and histograms.
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/figures/legend.h"
#include "client/plot/figures/svg_figure.h"
#include "tests/client/plot/figures_of_tests.h"

namespace oblique::client::plot {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(Lines, FewHaveALegendAndManyAreColouredByTheirValue) {
  const Figure few = test::lines_of_count(5);
  EXPECT_EQ(legend_of(few).size(), 5U);
  EXPECT_EQ(legend_of(few)[1].name, "e = 0.2");
  EXPECT_FALSE(few.colours);
  const Figure many = test::lines_of_count(9);
  EXPECT_TRUE(legend_of(many).empty());
  ASSERT_TRUE(many.colours);
  EXPECT_EQ(many.colours->axis.name, "e");
}

TEST(Lines, TooManyToTellApartAreThinnedAndThatIsSaid) {
  const Figure figure = test::lines_of_count(1000, 3);
  EXPECT_EQ(figure.panels[0].curves.size(), 120U);
  EXPECT_EQ(figure.panels[0].curves.front().by, 0.1);
  EXPECT_EQ(figure.panels[0].curves.back().by, 100.0);
  EXPECT_THAT(figure.notes, testing::Contains(HasSubstr("120 of 1,000 lines are drawn")));
}

TEST(Lines, OfNothingSayThatTheyAreEmpty) {
  const Figure figure =
      line_chart(quantity_of("mu", ""), quantity_of("fn_peak_N", "N"), {}, {}, {});
  EXPECT_THAT(figure.notes, ElementsAre(HasSubstr("Nothing to draw")));
  EXPECT_THAT(svg_of(figure), HasSubstr("</svg>"));
}

TEST(Lines, StopAtGapsAndGoOnBehind) {
  Series line{.by = 0.0, .x = {1, 2, 3, 4, 5}, .y = {1, 2, std::nan(""), 1, 3}};
  const auto svg =
      svg_of(line_chart(quantity_of("mu", ""), quantity_of("fn_peak_N", "N"), {}, {line}, {}));
  const auto begin = svg.find("<path class=\"line s0\"");
  ASSERT_NE(begin, std::string::npos);
  const auto path = svg.substr(begin, svg.find("/>", begin) - begin);
  EXPECT_EQ(std::count(path.begin(), path.end(), 'M'), 2);
}

TEST(Lines, OfAMillionPointsAreNoLongerThanWhatCanBeSeen) {
  Series line{.by = 0.0, .x = {}, .y = {}};
  for (int i = 0; i < 1'000'000; ++i) {
    line.x.push_back(i);
    line.y.push_back(std::sin(i * 1e-5));
  }
  const Figure figure =
      line_chart(quantity_of("mu", ""), quantity_of("fn_peak_N", "N"), {}, {line}, {});
  EXPECT_LT(svg_of(figure).size(), 300'000U);
}

TEST(Scatter, DrawsFewPointsEach) {
  const Figure figure = test::dots_of_count(100);
  ASSERT_TRUE(figure.panels[0].dots);
  EXPECT_EQ(figure.panels[0].dots->x.size(), 100U);
  EXPECT_TRUE(figure.notes.empty());
}

TEST(Scatter, GathersManyPointsAndSaysSo) {
  const Figure figure = test::dots_of_count(100'000);
  EXPECT_FALSE(figure.panels[0].dots);
  ASSERT_TRUE(figure.panels[0].cells);
  EXPECT_THAT(figure.notes, ElementsAre(HasSubstr("100,000 points, gathered in 160 x 110 cells")));
  EXPECT_THAT(figure.colours->axis.label, testing::StartsWith("mean of"));
}

TEST(Scatter, CountsEveryPointWhenItGathers) {
  Dots dots;
  for (int i = 0; i < 10'000; ++i) {
    dots.x.push_back(i % 7);
    dots.y.push_back(i % 5);
  }
  const Figure figure = scatter(quantity_of("mu", ""), quantity_of("fn_peak_N", "N"), {}, dots, {});
  double points = 0.0;
  for (const double value : figure.panels[0].cells->values) {
    points += std::isnan(value) ? 0.0 : value;
  }
  EXPECT_EQ(points, 10'000.0);
  EXPECT_EQ(figure.gaps.no_result, 0U) << "where no point is nothing is missing";
}

TEST(Scatter, SaysHowManyPointsLackAValue) {
  const Dots dots{{1, 2, std::nan("")}, {1, std::nan(""), 3}, {}};
  const Figure figure = scatter(quantity_of("mu", ""), quantity_of("fn_peak_N", "N"), {}, dots, {});
  EXPECT_THAT(figure.notes, testing::Contains(HasSubstr("of 3 points lack a value")));
}

TEST(Histogram, HoldsEachValueOnceInBinsOfRoundWidth) {
  for (const std::size_t count : {1U, 2U, 10U, 1000U, 100'000U}) {
    const Figure figure = test::histogram_of_count(count);
    const Bars& bars = *figure.panels[0].bars;
    EXPECT_EQ(std::accumulate(bars.heights.begin(), bars.heights.end(), 0.0),
              static_cast<double>(count));
    EXPECT_LE(bars.heights.size(), 110U);
    EXPECT_EQ(bars.edges.size(), bars.heights.size() + 1);
  }
}

TEST(Histogram, PutsAValueOnAnEdgeIntoTheBinThatBeginsThere) {
  std::vector<double> values(30, 0.5);
  values.insert(values.end(), 30, 0.8);
  values.insert(values.end(), 30, 1.0);
  const Figure figure = histogram(quantity_of("e", ""), values, {});
  const Bars& bars = *figure.panels[0].bars;
  for (std::size_t i = 0; i < bars.heights.size(); ++i) {
    if (bars.heights[i] > 0.0) {
      EXPECT_TRUE(bars.edges[i] == 0.5 || bars.edges[i] == 0.8 || bars.edges[i] == 1.0)
          << bars.edges[i];
    }
  }
}

TEST(Histogram, OfOneValueAndOfNothingIsDrawn) {
  EXPECT_THAT(svg_of(histogram(quantity_of("e", ""), std::vector<double>(50, 0.9), {})),
              HasSubstr("class=\"bar\""));
  EXPECT_THAT(svg_of(histogram(quantity_of("e", ""), {}, {})), HasSubstr("Nothing to draw"));
  ChartChoice logarithmic;
  logarithmic.is_x_logarithmic = true;
  EXPECT_THAT(histogram(quantity_of("e", ""), {0.0, 0.1, 1.0, 10.0}, logarithmic).notes,
              ElementsAre(HasSubstr("1 of 4 points have no value, or one outside the axis.")));
}

TEST(NameCounts, AreLargestFirstAndGatherTheRare) {
  std::vector<std::string> names;
  std::vector<std::uint64_t> counts;
  for (std::uint64_t i = 0; i < 40; ++i) {
    names.push_back("mode " + std::to_string(i));
    counts.push_back(i + 1);
  }
  const Figure figure = name_counts(quantity_of("major_mode", ""), names, counts);
  const Bars& bars = *figure.panels[0].bars;
  EXPECT_EQ(bars.names.front(), "mode 39");
  EXPECT_EQ(bars.names.back(), "other: 25");
  EXPECT_EQ(std::accumulate(bars.heights.begin(), bars.heights.end(), 0.0), 820.0);
}

TEST(Quantities, AreLabelledForPeopleWithTheirUnits) {
  EXPECT_EQ(quantity_of("duration_s", "s").label, "duration of contact [\u00b5s]");
  EXPECT_EQ(quantity_of("duration_s", "s").per_unit, 1e6);
  EXPECT_EQ(quantity_of("mu", "").label, "coefficient of friction \u03bc");
  EXPECT_EQ(quantity_of("ft_peak_N/fn_peak_N", "").label, "ft_peak_N/fn_peak_N");
  EXPECT_EQ(quantity_of("dt_fall", "s").label, "dt_fall [s]");
  EXPECT_EQ(shown_value(quantity_of("H", "m"), 0.96), "H = 0.96 m");
}

}  // namespace
}  // namespace oblique::client::plot
