// Which axes a picture of a study has, and what holds for the others.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/plot_request.h"
#include "client/plot/study_shape.h"
#include "client/study/study_file.h"
#include "worker/solver/model/errors.h"

namespace oblique::client::plot {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
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

TEST(Blocks, AreChosenByTheAxesAndValuesThatAreAskedFor) {
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
  EXPECT_EQ(number_for({.map = "slide_m", .x = "H", .y = "e"}), 0U) << "none has both";
}

TEST(Blocks, AreAllDrawnWhereNoneIsMeant) {
  EXPECT_FALSE(shape_of_study(kThreeBlocks, {.histogram = "mu"}).is_one_block);
  EXPECT_FALSE(shape_of_study(kThreeBlocks, {.scatter = "mu,H"}).is_one_block);
  EXPECT_TRUE(shape_of_study(kThreeBlocks, {.scatter = "mu,H", .block = "3"}).is_one_block);
  const auto all = shape_of_study(kThreeBlocks, {.block = "all"});
  EXPECT_FALSE(all.is_one_block);
  EXPECT_THAT(all.find("H")->values, ElementsAre(0.9, 0.96, 1.0, 1.04, 1.1));
  const auto points =
      shape_of_study("[[block]]\nH = 1\nmu = 1\ne = 1\n[[block]]\nH = 1\nmu = 2\ne = 1\n");
  EXPECT_FALSE(points.is_one_block) << "single points are no picture each";
}

TEST(Blocks, ThatThereAreNotAreRefused) {
  for (const std::string block : {"0", "4", "-1", "1.5", "first", ""}) {
    try {
      (void)shape_of_study(kThreeBlocks, {.block = block + (block.empty() ? " " : "")});
      FAIL() << block;
    } catch (const solver::InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("a number from 1 to 3 or `all`"));
    }
  }
}

TEST(Blocks, OfAHundredThousandAreUnitedAtOnce) {
  protocol::Recipe recipe;
  const auto study = parse_study("name = \"s\"\n[[block]]\nH = 1\nmu = [1, 2]\ne = 1\n", "s.toml",
                                 [](const auto&...) {});
  for (int i = 0; i < 100'000; ++i) {
    auto& block = *recipe.add_blocks() = study.recipe.blocks(0);
    block.mutable_axes(1)->set_values(1, 2.0 + i);
  }
  EXPECT_EQ(shape_for(recipe, {.block = "all"}).find("mu")->values.size(), 100'001U);
}

TEST(StudyShape, KnowsModelKeysByTheirColumns) {
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
  EXPECT_THAT(error_of({.at = {"H=0.5"}}, shape), HasSubstr("lie scattered"));
}

TEST(Condition, TakesTheFirstValueOfAnAxisThatIsLeftOpenAndSaysSo) {
  const auto condition = condition_of({}, grid(), {chosen_axis("--x", "mu", grid())}, true);
  EXPECT_EQ(condition.sql, "H = 0.5 AND e = 0.5");
  EXPECT_THAT(condition.said,
              ElementsAre(HasSubstr("H has the values 0.5, 1; H = 0.5 is drawn"),
                          HasSubstr("e has the values 0.5, 0.8, 1; e = 0.5 is drawn")));
}

TEST(Condition, LeavesOpenWhatWhereSpeaksOf) {
  const auto condition = condition_of({.where = "e > 0.6 OR slide_m > 1"}, grid(),
                                      {chosen_axis("--x", "mu", grid())}, true);
  EXPECT_EQ(condition.sql, "(e > 0.6 OR slide_m > 1) AND H = 0.5");
}

TEST(At, TakesAValueAsTablesShowIt) {
  const auto condition =
      condition_of({.at = {"e=0.8", "H=1"}}, grid(), {chosen_axis("--x", "mu", grid())}, true);
  EXPECT_EQ(condition.sql, "e = 0.8 AND H = 1");
  EXPECT_THAT(condition.said, IsEmpty());
  const auto thirds =
      shape_of_study("[[block]]\nH = { from = 0.1, to = 1.1, count = 4 }\nmu = 1\ne = 1\n");
  EXPECT_THAT(condition_of({.at = {"H=0.433333"}}, thirds, {}, true).sql,
              testing::StartsWith("H = 0.43333333"));
}

TEST(At, NamesTheNearestOfAValueThatThereIsNot) {
  EXPECT_THAT(error_of({.at = {"e=0.79"}}, grid()),
              HasSubstr("the nearest is e=0.8. It has the values 0.5, 0.8, 1"));
  EXPECT_THAT(error_of({.at = {"mu=1"}}, grid()), HasSubstr("is an axis of the picture"));
  EXPECT_THAT(error_of({.at = {"h=1"}}, grid()), HasSubstr("did you mean `H`"));
  EXPECT_THAT(error_of({.at = {"e"}}, grid()), HasSubstr("must be a key and a number"));
  EXPECT_THAT(error_of({.at = {"e=one"}}, grid()), HasSubstr("must be a key and a number"));
  EXPECT_THAT(error_of({.at = {"e=nan"}}, grid()), HasSubstr("must be a key and a number"));
  EXPECT_THAT(error_of({.at = {"e=1", "e=0.5"}}, grid()), HasSubstr("has a value already"));
}

TEST(Axes, ThatThereAreNotAreNamedWithTheNearest) {
  try {
    (void)chosen_axis("--x", "muu", grid());
    FAIL();
  } catch (const solver::InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean `mu`"));
  }
  EXPECT_EQ(chosen_axis("--x", "slide_m", grid()).axis, nullptr);
  EXPECT_EQ(chosen_axis("--x", "slide_m / 2", grid()).column, "slide_m / 2");
}

TEST(UsualPicture, SuitsTheStudy) {
  const auto usual = [](const std::string& blocks) {
    return completed({}, shape_of_study(blocks));
  };
  EXPECT_EQ(completed({}, grid()).map, "fn_peak_N");
  EXPECT_EQ(completed({.at = {"e=1"}}, grid()).lines, "fn_peak_N");
  EXPECT_EQ(completed({.y = "H"}, grid()).map, "fn_peak_N");
  EXPECT_EQ(completed({.histogram = "e"}, grid()).map, "");
  const auto few =
      usual("[[block]]\nH = { from = 0.2, to = 1, count = 9 }\nmu = [0.4, 0.8]\ne = 1\n");
  EXPECT_EQ(few.lines, "fn_peak_N") << "a line a value where an axis has few";
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
