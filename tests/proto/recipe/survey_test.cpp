// Filters, and what only the points of a block tell.
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/point_table.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const auto kGoesOn = [] { return true; };

std::string survey_objection(const Recipe& recipe) {
  try {
    PointTable table(recipe);
    table.survey(kGoesOn);
  } catch (const solver::InputError& fault) {
    return fault.what();
  }
  return {};
}

std::vector<std::uint64_t> left_in(const PointTable& table) {
  std::vector<std::uint64_t> points;
  for (std::uint64_t i = 0; i < table.size(); ++i) {
    if (table.is_left_in(i)) {
      points.push_back(i);
    }
  }
  return points;
}

/// mu = 0, 0.1, ..., 1 for each of two e.
Block grid(const std::string& where) {
  return filtered({listed("H", {0.5}), range("mu", 0.0, 1.0, 11), listed("e", {0.5, 1.0})}, where);
}

TEST(SurveyTest, PointsThatAreLeftOutKeepTheirNumbersAndAreNotCounted) {
  PointTable table(recipe_of_blocks({grid("mu > 1.6 * e")}));
  EXPECT_EQ(table.size(), 22U);
  EXPECT_TRUE(table.has_filter());
  EXPECT_TRUE(table.needs_survey());
  EXPECT_TRUE(table.survey(kGoesOn));
  EXPECT_EQ(table.points(), 2U);
  EXPECT_THAT(left_in(table), ElementsAre(18, 20));
  EXPECT_EQ(table.point(18).mu, 0.9);
  EXPECT_EQ(table.recipe().blocks(0).points_left_in(), 2U);
}

TEST(SurveyTest, AFilterIsOfItsBlockAlone) {
  PointTable table(recipe_of_blocks({grid("mu > 0.95"), grid(""), grid("mu < 0.05")}));
  table.survey(kGoesOn);
  EXPECT_EQ(table.points(), 2U + 22U + 2U);
  EXPECT_EQ(table.first_left_in(0, 66), 20U);
  EXPECT_EQ(table.first_left_in(22, 66), 22U);
  EXPECT_EQ(table.first_left_in(46, 66), 66U);
  EXPECT_EQ(table.first_left_in(0, 10), 10U);
  EXPECT_THROW(static_cast<void>(table.is_left_in(66)), std::out_of_range);
}

TEST(SurveyTest, FiltersMayAskForWhatFollowsFromOthersAndForTheModel) {
  PointTable table(recipe_of_blocks({filtered({following("k", "1e7 * (1 + mu)"), listed("H", {0.5}),
                                               range("mu", 0.0, 1.0, 11), listed("e", {1.0})},
                                              "k > 1.85e7 && g > 9")}));
  table.survey(kGoesOn);
  EXPECT_THAT(left_in(table), ElementsAre(9, 10));
}

TEST(SurveyTest, ZipsAndSamplesAreFilteredToo) {
  Block zip =
      zipped({listed("H", {0.3, 0.2, 0.5}), listed("mu", {0.1, 0.2, 0.3}), listed("e", {1.0})});
  zip.set_where("H > 0.25");
  Block sample = sampled({uniform("H", 0.3, 1.1), uniform("mu", 0.0, 1.0), uniform("e", 0.5, 1.0)},
                         SAMPLE_SOBOL, 1000);
  sample.set_where("mu > 0.5");
  PointTable table(recipe_of_blocks({zip, sample}));
  table.survey(kGoesOn);
  EXPECT_EQ(table.recipe().blocks(0).points_left_in(), 2U);
  EXPECT_NEAR(static_cast<double>(table.recipe().blocks(1).points_left_in()), 500.0, 5.0);
}

TEST(SurveyTest, AValueThatIsNotAllowedIsAnErrorWithBlockPointAndValues) {
  const Block wrong = filtered({following("k", "1e7 * (0.55 - mu)"), listed("H", {0.5}),
                                range("mu", 0.0, 1.0, 11), listed("e", {1.0})},
                               "");
  const std::string objection = survey_objection(recipe_of_blocks({grid(""), wrong}));
  EXPECT_THAT(objection, HasSubstr("block 2: point 28: k = "));
  EXPECT_THAT(objection, HasSubstr("must be > 0"));
  EXPECT_THAT(objection, HasSubstr("mu = 0.6"));
}

TEST(SurveyTest, ValuesOfPointsThatAreLeftOutDoNotMatter) {
  const Block block = filtered({following("k", "1e7 * (0.55 - mu)"), listed("H", {0.5, 5.0}),
                                range("mu", 0.0, 1.0, 11), listed("e", {1.0})},
                               "mu < 0.5 && H < 1");
  EXPECT_EQ(survey_objection(recipe_of_blocks({block})), "");
}

TEST(SurveyTest, AFilterWithoutAValueIsAnError) {
  EXPECT_THAT(survey_objection(recipe_of_blocks({grid("sqrt(mu - 0.5) > 0.1")})),
              HasSubstr("point 0: where has no value"));
}

TEST(SurveyTest, AFilterThatLeavesNothingInIsAnError) {
  EXPECT_THAT(survey_objection(recipe_of_blocks({grid("mu > 2")})),
              HasSubstr("leaves no point in"));
}

TEST(SurveyTest, AFilterOverMorePointsThanCanBeCountedIsRefused) {
  const Block block = filtered(
      {listed("H", {0.5}), range("mu", 0.0, 1.0, 100'000'001), listed("e", {1.0})}, "mu > 0.5");
  EXPECT_THAT(survey_objection(recipe_of_blocks({block})), HasSubstr("at most 100000000"));
}

TEST(SurveyTest, ASurveyCanBeEnded) {
  PointTable table(recipe_of_blocks({filtered(
      {listed("H", {0.5}), range("mu", 0.0, 1.0, 100'000'000), listed("e", {1.0})}, "mu > 0.5")}));
  int asked = 0;
  EXPECT_FALSE(table.survey([&] { return ++asked < 3; }));
  EXPECT_EQ(asked, 3);
  EXPECT_FALSE(table.recipe().blocks(0).has_points_left_in());
}

TEST(SurveyTest, ASurveyThatWasEndedGoesOnWhereItWas) {
  const auto many = [](const char* where) {
    return filtered({listed("H", {0.5}), range("mu", 0.0, 1.0, 5001), listed("e", {1.0})}, where);
  };
  PointTable table(recipe_of_blocks({grid(""), many("mu > 0.25"), many("mu > 0.75")}));
  int ended = 0;
  for (bool ends = false; !table.survey([&] { return ends = !ends; }); ends = false) {
    ASSERT_LT(++ended, 100) << "every call looks at further points";
  }
  EXPECT_GT(ended, 2);
  EXPECT_EQ(table.recipe().blocks(1).points_left_in(), 3750U);
  EXPECT_EQ(table.recipe().blocks(2).points_left_in(), 1250U);
}

TEST(SurveyTest, ATableOfACountedRecipeNeedsNoCounting) {
  PointTable counted(recipe_of_blocks({grid("mu > 1.6 * e")}));
  counted.survey(kGoesOn);
  const PointTable again(counted.recipe());
  EXPECT_EQ(again.points(), 2U);
}

TEST(SurveyTest, PlainStudiesNeedNone) {
  PointTable table(recipe_of_blocks({grid("")}));
  EXPECT_FALSE(table.needs_survey());
  EXPECT_FALSE(table.has_filter());
  EXPECT_EQ(table.points(), table.size());
}

}  // namespace
}  // namespace oblique::protocol
