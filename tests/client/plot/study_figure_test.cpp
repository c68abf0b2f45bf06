// Figures made from the rows of a study.
#include "client/plot/plot_request.h"

#include <cmath>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/study/study_file.h"
#include "proto/wire/chunk.h"
#include "worker/solver/model/errors.h"

namespace oblique::client::plot {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

using Rows = std::vector<protocol::Row>;

/// A source that answers each query with prepared rows.
class MadeRows : public Source {
 public:
  MadeRows(std::vector<std::string> columns, Rows rows)
      : answer_(protocol::chunk_of({std::move(columns), std::move(rows)})) {
    answer_.set_ends(true);
  }
  std::unique_ptr<RowStream> rows(protocol::QueryRequest) override {
    class One : public RowStream {
     public:
      explicit One(protocol::QueryReply reply) : reply_(std::move(reply)) {}
      protocol::QueryReply next() override { return reply_; }

     private:
      protocol::QueryReply reply_;
    };
    return std::make_unique<One>(answer_);
  }
  std::vector<protocol::StudyStatus> status(const std::string&, const Tell&) override { return {}; }
  std::string place() const override { return "made"; }

 private:
  protocol::QueryReply answer_;
};

/// Returns the figure of `rows` for a study with H in {0.5, 1} and mu in {1, 2, 3}.
Figure figure_from(PlotRequest request, const std::vector<std::string>& columns, const Rows& rows) {
  const auto study = parse_study("name = \"s\"\n[[block]]\nH = [0.5, 1]\nmu = [1, 2, 3]\ne = 1\n",
                                 "s.toml", [](const auto&...) {});
  request.study = "s";
  MadeRows source(columns, rows);
  return figure_of(source, shape_for(study.recipe, request), request, [](const std::string&) {});
}

Rows rows_of_numbers(std::size_t count) {
  Rows rows;
  for (std::size_t i = 0; i < count; ++i) {
    rows.push_back({static_cast<double>(i % 7), static_cast<double>(i % 5)});
  }
  return rows;
}

const std::vector<std::string> kMapColumns{"mu", "H", "fn_peak_N", "status"};

TEST(Map, OfNumbersHasOneCellPerPointAndAColourScale) {
  const Figure figure = figure_from(
      {.map = "fn_peak_N"}, kMapColumns,
      {{1.0, 0.5, 10.0, "solved"}, {2.0, 0.5, {}, "failed"}, {3.0, 1.0, 30.0, "solved"}});
  const Cells& cells = *figure.panels[0].cells;
  EXPECT_EQ(cells.columns(), 3U);
  EXPECT_EQ(cells.rows(), 2U);
  EXPECT_EQ(cells.count(CellState::kSolved), 2U);
  EXPECT_EQ(cells.count(CellState::kFailed), 1U);
  EXPECT_EQ(cells.count(CellState::kNoResult), 3U);
  EXPECT_EQ(figure.colours->range, (Range{10.0, 30.0}));
  EXPECT_EQ(figure.title, "s: fn_peak_N");
  EXPECT_EQ(figure.subtitle, "e = 1, 3 points");
}

TEST(Map, WithARangeMentionsValuesOutsideOfIt) {
  const Figure figure = figure_from({.map = "fn_peak_N", .range = "2:20"}, kMapColumns,
                                    {{1.0, 0.5, 1.0, "solved"}, {2.0, 0.5, 30.0, "solved"}});
  EXPECT_EQ(figure.colours->range, (Range{2.0, 20.0}));
  EXPECT_THAT(figure.notes,
              Contains(HasSubstr("Values range from 1 to 30; those outside the scale")));
}

TEST(Map, WithoutRowsReportsThatNothingCanBeDrawn) {
  const Figure empty = figure_from({.map = "fn_peak_N"}, kMapColumns, {});
  EXPECT_TRUE(empty.is_empty);
  EXPECT_THAT(empty.notes, Contains("Nothing to draw: no cell has a value."));
}

TEST(Map, SortsModesByTheirNumbersOfPoints) {
  const Figure figure = figure_from(
      {.map = "mode"}, {"mu", "H", "mode", "status"},
      {{1.0, 0.5, "sC", "solved"}, {2.0, 0.5, "SC", "solved"}, {3.0, 1.0, "SC", "solved"}});
  const Cells& cells = *figure.panels[0].cells;
  ASSERT_EQ(cells.categories.size(), 2U);
  EXPECT_EQ(cells.categories[0].name, "SC");
  EXPECT_EQ(cells.categories[0].points, 2U);
  EXPECT_EQ(cells.values[0], 1.0);
  EXPECT_FALSE(figure.colours);
  EXPECT_THAT(figure.notes, ElementsAre(HasSubstr("S stick, s slip")));
}

TEST(Map, OfManyModesCombinesThoseWithVeryFewPoints) {
  Rows rows;
  for (int i = 0; i < 20; ++i) {
    const std::size_t points = i < 15 ? 100 - static_cast<std::size_t>(i) : 1;
    rows.insert(rows.end(), points, {1.0 * i, 0.5, "mode " + std::to_string(10 + i), "solved"});
  }
  const Figure figure = figure_from({.map = "mode"}, {"mu", "H", "mode", "status"}, rows);
  const auto& categories = figure.panels[0].cells->categories;
  ASSERT_EQ(categories.size(), 13U);
  EXPECT_TRUE(categories.back().is_other);
  EXPECT_EQ(categories.back().name, "8 other modes");
  EXPECT_EQ(categories.back().points, 88U + 87U + 86U + 5U);
  EXPECT_THAT(figure.notes, Contains(HasSubstr("--format csv lists all 20")));
}

TEST(Lines, AreLabelledIfFewAndColouredByValueIfMany) {
  Rows rows;
  for (int i = 0; i < 9; ++i) {
    rows.push_back({1.0, 5.0 + i, 0.1 * i});
    rows.push_back({2.0, 6.0 + i, 0.1 * i});
  }
  const std::vector<std::string> columns{"mu", "fn_peak_N", "e"};
  const Figure many = figure_from({.lines = "fn_peak_N", .x = "mu", .by = "e"}, columns, rows);
  EXPECT_THAT(many.panels[0].curves[1].colours, ElementsAre(0.1, 0.1));
  ASSERT_TRUE(many.colours);
  EXPECT_EQ(many.colours->name, "e");
  rows.resize(10);
  const Figure few = figure_from({.lines = "fn_peak_N", .x = "mu", .by = "e"}, columns, rows);
  EXPECT_FALSE(few.colours);
  ASSERT_EQ(few.panels[0].curves.size(), 5U);
  EXPECT_EQ(few.panels[0].curves[2].name, "e = 0.2");
}

TEST(Outputs, AnUnknownOutputIsRefusedAndItsFlagIsNamed) {
  for (const auto& [flag, request] :
       {std::pair<std::string, PlotRequest>{"--lines", {.lines = "fn_peak"}},
        {"--map", {.map = "fn_peak"}},
        {"--colour", {.scatter = "mu,H", .colour = "fn_peak"}}}) {
    try {
      (void)figure_from(request, {}, {});
      FAIL() << flag;
    } catch (const solver::InputError& error) {
      EXPECT_THAT(error.what(), testing::StartsWith(flag + " fn_peak: there is no such"));
    }
  }
}

TEST(Lines, ReportTheNumberOfGaps) {
  const Figure figure = figure_from({.lines = "fn_peak_N", .x = "mu", .by = "H"},
                                    {"mu", "fn_peak_N", "H"}, {{1.0, 4.0, 1.0}, {3.0, 5.0, 1.0}});
  EXPECT_TRUE(std::isnan(figure.panels[0].curves[0].y[1]));
  EXPECT_THAT(figure.notes, Contains("Gaps in the lines: 1 point is without a value."));
}

TEST(Scatter, DrawsFewPointsOneByOneAndCountsThoseWithoutAValue) {
  const Figure figure = figure_from({.scatter = "mu,slide_m"}, {"mu", "slide_m"},
                                    {{1.0, 1.0}, {2.0, {}}, {3.0, 2.0}});
  EXPECT_EQ(figure.panels[0].curves[0].x.size(), 3U);
  EXPECT_THAT(figure.notes, ElementsAre("1 of 3 points have no value that can be drawn."));
}

TEST(Scatter, CountsManyPointsInCells) {
  const Figure figure =
      figure_from({.scatter = "mu,slide_m"}, {"mu", "slide_m"}, rows_of_numbers(10'000));
  ASSERT_TRUE(figure.panels[0].cells);
  double points = 0.0;
  for (const double value : figure.panels[0].cells->values) {
    points += std::isnan(value) ? 0.0 : value;
  }
  EXPECT_EQ(points, 10'000.0);
  EXPECT_EQ(figure.panels[0].cells->count(CellState::kNoResult), 0U);
  EXPECT_THAT(figure.notes, ElementsAre(HasSubstr("10,000 points, grouped in ")));
}

TEST(Histogram, CountsEachValueOnceInTheBinThatBeginsAtIt) {
  Rows rows(30, {0.5});
  rows.insert(rows.end(), 30, {0.8});
  rows.insert(rows.end(), 40, {1.0});
  const Figure figure = figure_from({.histogram = "e"}, {"e"}, rows);
  const Bars& bars = *figure.panels[0].bars;
  EXPECT_EQ(bars.edges.size(), bars.heights.size() + 1);
  EXPECT_EQ(std::accumulate(bars.heights.begin(), bars.heights.end(), 0.0), 100.0);
  for (std::size_t i = 0; i < bars.heights.size(); ++i) {
    if (bars.heights[i] > 0.0) {
      EXPECT_THAT(bars.edges[i], testing::AnyOf(0.5, 0.8, 1.0));
    }
  }
}

TEST(Histogram, ReportsRowsThatItLeavesOut) {
  const Figure figure = figure_from({.histogram = "margin", .is_x_logarithmic = true}, {"margin"},
                                    {{0.0}, {0.1}, {1.0}, {10.0}});
  EXPECT_THAT(figure.notes, ElementsAre("1 of 4 points have no value or lie outside the axis."));
  EXPECT_TRUE(figure_from({.histogram = "margin"}, {"margin"}, {}).is_empty);
}

TEST(Histogram, OfValuesThatDifferByRoundingHasOneBarAndSaysSo) {
  for (const double value : {0.43, -5e3, 1e9, 3e-310, 1e300}) {
    Rows rows;
    for (double at = value; rows.size() < 20; at = std::nextafter(at, HUGE_VAL)) {
      rows.push_back({at});
    }
    const Figure figure = figure_from({.histogram = "fn_peak_N"}, {"fn_peak_N"}, rows);
    const Bars& bars = *figure.panels[0].bars;
    EXPECT_EQ(std::count(bars.heights.begin(), bars.heights.end(), 20.0), 1) << value;
    EXPECT_LE(bars.heights.size(), 20U);
    EXPECT_THAT(figure.notes, Contains(HasSubstr("count as one"))) << value;
  }
  EXPECT_THAT(figure_from({.histogram = "e"}, {"e"}, Rows(5, {0.5})).notes, testing::IsEmpty());
}

TEST(Outputs, TooLargeToDrawAreReported) {
  const Figure figure =
      figure_from({.histogram = "margin"}, {"margin"}, {{1e305}, {1.0}, {2.0}, {HUGE_VAL}});
  EXPECT_THAT(figure.notes, ElementsAre("2 of 4 points have no value or lie outside the axis."));
}

TEST(Lines, HaveNamesThatDistinguishCloseValues) {
  const Figure figure = figure_from(
      {.lines = "fn_peak_N", .x = "mu", .by = "H"}, {"mu", "fn_peak_N", "H"},
      {{1.0, 10.0, 0.5}, {2.0, 20.0, 0.5}, {1.0, 11.0, 0.5 + 1e-9}, {2.0, 21.0, 0.5 + 1e-9}});
  ASSERT_EQ(figure.panels[0].curves.size(), 2U);
  EXPECT_EQ(figure.panels[0].curves[0].name, "H = 0.5");
  EXPECT_EQ(figure.panels[0].curves[1].name, "H = 0.500000001");
}

TEST(Range, MustBeWideEnoughAndAboveZeroOnALogarithmicScale) {
  EXPECT_ANY_THROW(range_given({.range = "0.4:0.40000000000001"}));
  EXPECT_ANY_THROW(range_given({.range = "0:1e305"}));
  EXPECT_EQ(range_given({.range = "0.4:0.4000001"})->to, 0.4000001);
  EXPECT_ANY_THROW(figure_from({.histogram = "e", .is_x_logarithmic = true, .range = "0:1"}, {"e"},
                               {{0.5}, {1.0}}));
}

TEST(Histogram, SortsTextsAndCombinesRareTexts) {
  Rows rows;
  for (int i = 0; i < 40; ++i) {
    rows.insert(rows.end(), static_cast<std::size_t>(i + 1), {"mode " + std::to_string(i)});
  }
  const Figure figure = figure_from({.histogram = "mode"}, {"mode"}, rows);
  const Bars& bars = *figure.panels[0].bars;
  EXPECT_EQ(bars.names.front(), "mode 39");
  EXPECT_EQ(bars.names.back(), "other: 25");
  EXPECT_EQ(std::accumulate(bars.heights.begin(), bars.heights.end(), 0.0), 820.0);
}

TEST(Axes, HaveReadableLabelsWithUnits) {
  EXPECT_EQ(axis_of("duration_s", "s").label, "duration of contact [\u00b5s]");
  EXPECT_EQ(axis_of("duration_s", "s").per_unit, 1e6);
  EXPECT_EQ(axis_of("mu", "").label, "coefficient of friction \u03bc");
  EXPECT_EQ(axis_of("ft_peak_N/fn_peak_N", "").label, "ft_peak_N/fn_peak_N");
  EXPECT_EQ(shown_value(axis_of("H", "m"), 0.96), "H = 0.96 m");
}

TEST(Edges, LieHalfwayBetweenValues) {
  EXPECT_THAT(edges_between({1.0, 2.0, 4.0}, false), ElementsAre(0.5, 1.5, 3.0, 5.0));
  EXPECT_THAT(edges_between({1.0, 4.0}, true),
              ElementsAre(testing::DoubleEq(0.5), testing::DoubleEq(2.0), testing::DoubleEq(8.0)));
  EXPECT_THAT(edges_between({0.0}, false), ElementsAre(-0.5, 0.5));
  EXPECT_THAT(edges_between({}, false), testing::IsEmpty());
}

TEST(Ranges, IgnoreInfiniteValuesAndAreNotExtendedAcrossZero) {
  EXPECT_EQ(range_of({2.0, std::nan(""), -1.0, INFINITY}), (Range{-1.0, 2.0}));
  EXPECT_EQ(range_of({-1.0, 0.0, 3.0, 5.0}, true), (Range{3.0, 5.0}));
  FigureAxis axis;
  axis.span({1.0, 101.0}, 0.05);
  EXPECT_EQ(axis.range, (Range{0.0, 106.0}));
  axis.span({3.0, 3.0});
  EXPECT_EQ(axis.share_of(3.0), 0.5);
}

using testing::IsEmpty;

StudyShape shape_of_study(const std::string& blocks, const PlotRequest& request = {}) {
  const auto study = parse_study("name = \"s\"\n" + blocks, "s.toml", [](const auto&...) {});
  return shape_for(study.recipe, request);
}

const StudyShape& grid() {
  static const StudyShape shape = shape_of_study(
      "[[block]]\nH = [0.5, 1]\nmu = { from = 0.02, to = 2, count = 100 }\ne = [0.5, 0.8, 1]\n");
  return shape;
}

std::string error_of(const PlotRequest& request, const StudyShape& shape) {
  try {
    (void)condition_of(request, shape, {chosen_axis("--x", "mu", shape)}, true);
  } catch (const solver::InputError& error) {
    return error.what();
  }
  return "none";
}

constexpr const char* kThreeBlocks =
    "[[block]]\nH = [0.96, 1, 1.04]\nmu = 0.4\ne = 1\n"
    "[[block]]\nH = 1\nmu = { from = 0.1, to = 2, count = 20 }\ne = [0.5, 1]\n"
    "[[block]]\nH = [0.9, 1, 1.1]\nmu = [0.2, 0.3]\ne = 0.8\n";

TEST(StudyShape, HasTheAxesOfTheBlockWithTheMostPoints) {
  const auto shape = shape_of_study(kThreeBlocks);
  EXPECT_TRUE(shape.is_grid);
  EXPECT_EQ(shape.block_points, 40U);
  EXPECT_EQ(shape.points, 49U);
  EXPECT_THAT(shape.find("H")->values, ElementsAre(1.0));
  const auto axes = shape.by_preference();
  ASSERT_EQ(axes.size(), 2U);
  EXPECT_EQ(axes[0]->key, "mu");
  EXPECT_EQ(axes[1]->key, "e");
}

TEST(Blocks, AreChosenByTheRequestedAxesAndValues) {
  const auto number_for = [](const PlotRequest& request) {
    const auto shape = shape_of_study(kThreeBlocks, request);
    return shape.is_one_block ? shape.block + 1 : 0;
  };
  EXPECT_EQ(number_for({}), 2U);
  EXPECT_EQ(number_for({.map = "slide_m", .x = "mu", .y = "H"}), 3U);
  EXPECT_EQ(number_for({.lines = "slide_m", .x = "H"}), 3U);
  EXPECT_EQ(number_for({.lines = "slide_m", .x = "H", .at = {"mu=0.4"}}), 1U);
  EXPECT_EQ(number_for({.lines = "slide_m", .at = {"e=0.8"}}), 3U);
  EXPECT_EQ(number_for({.block = "1"}), 1U);
  EXPECT_EQ(number_for({.map = "slide_m", .x = "H", .y = "e"}), 0U) << "no block has both axes";
}

TEST(Blocks, AreAllDrawnIfNoneIsChosen) {
  EXPECT_FALSE(shape_of_study(kThreeBlocks, {.histogram = "mu"}).is_one_block);
  EXPECT_FALSE(shape_of_study(kThreeBlocks, {.scatter = "mu,H"}).is_one_block);
  EXPECT_TRUE(shape_of_study(kThreeBlocks, {.scatter = "mu,H", .block = "3"}).is_one_block);
  const auto all = shape_of_study(kThreeBlocks, {.block = "all"});
  EXPECT_FALSE(all.is_one_block);
  EXPECT_THAT(all.find("H")->values, ElementsAre(0.9, 0.96, 1.0, 1.04, 1.1));
  const auto points =
      shape_of_study("[[block]]\nH = 1\nmu = 1\ne = 1\n[[block]]\nH = 1\nmu = 2\ne = 1\n");
  EXPECT_FALSE(points.is_one_block) << "blocks of one point are drawn together";
}

TEST(Blocks, AnUnknownBlockIsRefused) {
  for (const std::string block : {"0", "4", "-1", "1.5", "first", ""}) {
    try {
      (void)shape_of_study(kThreeBlocks, {.block = block + (block.empty() ? " " : "")});
      FAIL() << block;
    } catch (const solver::InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("a number from 1 to 3 or `all`"));
    }
  }
}

TEST(Blocks, AHundredThousandBlocksAreCombinedQuickly) {
  protocol::Recipe recipe;
  const auto study = parse_study("name = \"s\"\n[[block]]\nH = 1\nmu = [1, 2]\ne = 1\n", "s.toml",
                                 [](const auto&...) {});
  for (int i = 0; i < 100'000; ++i) {
    auto& block = *recipe.add_blocks() = study.recipe.blocks(0);
    block.mutable_axes(1)->set_values(1, 2.0 + i);
  }
  EXPECT_EQ(shape_for(recipe, {.block = "all"}).find("mu")->values.size(), 100'001U);
}

TEST(StudyShape, FindsModelKeysByTheirColumns) {
  const auto shape =
      shape_of_study("[[block]]\nE = [6e10, 7e10]\nlength1 = [0.3, 0.4]\nH = 0.5\nmu = 1\ne = 1\n");
  EXPECT_EQ(shape.find("E")->column, "E_Pa");
  EXPECT_EQ(shape.find("E_Pa")->key, "E");
  EXPECT_EQ(shape.find("length1")->column, "json_extract(lengths_m, '$[0]')");
}

TEST(StudyShape, OfASampleIsNoGridAndHasNoListedValues) {
  const auto shape = shape_of_study(
      "[[block]]\nsample = { kind = \"sobol\", count = 100, seed = 1 }\n"
      "H = { from = 0.3, to = 1.1 }\nmu = { from = 0.1, to = 2 }\ne = 1\n");
  EXPECT_FALSE(shape.is_grid);
  EXPECT_FALSE(shape.find("mu")->is_listed);
  EXPECT_THAT(error_of({.at = {"H=0.5"}}, shape), HasSubstr("are scattered"));
}

TEST(Condition, FixesAnOpenAxisAtItsFirstValueAndReportsIt) {
  const auto condition = condition_of({}, grid(), {chosen_axis("--x", "mu", grid())}, true);
  EXPECT_EQ(condition.sql,
            "H BETWEEN 0.4999999999995 AND 0.5000000000005 AND "
            "e BETWEEN 0.4999999999995 AND 0.5000000000005");
  EXPECT_THAT(condition.said,
              ElementsAre(HasSubstr("H has the values 0.5, 1; drawn: H = 0.5"),
                          HasSubstr("e has the values 0.5, 0.8, 1; drawn: e = 0.5")));
}

TEST(Condition, DoesNotFixAxesInTheWhereClause) {
  const auto condition = condition_of({.where = "e > 0.6 OR slide_m > 1"}, grid(),
                                      {chosen_axis("--x", "mu", grid())}, true);
  EXPECT_EQ(condition.sql,
            "(e > 0.6 OR slide_m > 1) AND H BETWEEN 0.4999999999995 AND 0.5000000000005");
}

TEST(FlagAt, AcceptsAValueAsRoundedInATable) {
  const auto condition =
      condition_of({.at = {"e=0.8", "H=1"}}, grid(), {chosen_axis("--x", "mu", grid())}, true);
  EXPECT_THAT(condition.sql, HasSubstr(" AND H BETWEEN 0.999999999999 AND 1.000000000001"));
  EXPECT_THAT(condition.said, IsEmpty());
  const auto thirds =
      shape_of_study("[[block]]\nH = { from = 0.1, to = 1.1, count = 4 }\nmu = 1\ne = 1\n");
  EXPECT_THAT(condition_of({.at = {"H=0.433333"}}, thirds, {}, true).sql,
              testing::StartsWith("H BETWEEN 0.43333333"));
}

TEST(FlagAt, SuggestsTheNearestValueForAnUnknownValue) {
  EXPECT_THAT(error_of({.at = {"e=0.79"}}, grid()),
              HasSubstr("the nearest is e=0.8. It has the values 0.5, 0.8, 1"));
  EXPECT_THAT(error_of({.at = {"mu=1"}}, grid()), HasSubstr("is an axis of the picture"));
  EXPECT_THAT(error_of({.at = {"h=1"}}, grid()), HasSubstr("did you mean `H`"));
  EXPECT_THAT(error_of({.at = {"e"}}, grid()), HasSubstr("must be a key and a number"));
  EXPECT_THAT(error_of({.at = {"e=one"}}, grid()), HasSubstr("must be a key and a number"));
  EXPECT_THAT(error_of({.at = {"e=nan"}}, grid()), HasSubstr("must be a key and a number"));
  EXPECT_THAT(error_of({.at = {"e=1", "e=0.5"}}, grid()), HasSubstr("has a value already"));
}

TEST(Axes, AnUnknownAxisIsRefusedWithTheNearestName) {
  try {
    (void)chosen_axis("--x", "muu", grid());
    FAIL();
  } catch (const solver::InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean `mu`"));
  }
  EXPECT_EQ(chosen_axis("--x", "slide_m", grid()).axis, nullptr);
  EXPECT_EQ(chosen_axis("--x", "slide_m / 2", grid()).column, "slide_m / 2");
}

TEST(DefaultPlot, DependsOnTheAxesOfTheStudy) {
  const auto usual = [](const std::string& blocks) {
    return completed({}, shape_of_study(blocks));
  };
  EXPECT_EQ(completed({}, grid()).map, "fn_peak_N");
  EXPECT_EQ(completed({.at = {"e=1"}}, grid()).lines, "fn_peak_N");
  EXPECT_EQ(completed({.y = "H"}, grid()).map, "fn_peak_N");
  EXPECT_EQ(completed({.histogram = "e"}, grid()).map, "");
  const auto few =
      usual("[[block]]\nH = { from = 0.2, to = 1, count = 9 }\nmu = [0.4, 0.8]\ne = 1\n");
  EXPECT_EQ(few.lines, "fn_peak_N") << "an axis of few values gives one line per value";
  EXPECT_EQ(few.x, "H");
  EXPECT_EQ(usual("[[block]]\nH = 0.5\nmu = 1\ne = 1\n").histogram, "fn_peak_N");
  const auto scattered = usual(
      "[[block]]\nsample = { kind = \"lhs\", count = 10, seed = 1 }\n"
      "H = { from = 0.3, to = 1.1 }\nmu = { from = 0.1, to = 2 }\ne = 1\n");
  EXPECT_EQ(scattered.scatter, "mu,H");
  EXPECT_EQ(scattered.colour, "fn_peak_N");
}

}  // namespace
}  // namespace oblique::client::plot
