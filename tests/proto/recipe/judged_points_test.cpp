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

std::string fault_of_points(const Recipe& recipe) {
  try {
    PointTable(recipe).judge_points();
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

TEST(JudgedPointsTest, PointsThatAreLeftOutKeepTheirNumbers) {
  const PointTable table(recipe_of_blocks({grid("mu > 1.6 * e")}));
  EXPECT_EQ(table.size(), 22U);
  EXPECT_TRUE(table.has_filter());
  EXPECT_TRUE(table.needs_judging());
  EXPECT_THAT(left_in(table), ElementsAre(18, 20));
  EXPECT_EQ(table.point(18).mu, 0.9);
}

TEST(JudgedPointsTest, AFilterIsOfItsBlockAlone) {
  const PointTable table(recipe_of_blocks({grid("mu > 0.95"), grid(""), grid("mu < 0.05")}));
  EXPECT_EQ(left_in(table).size(), 2U + 22U + 2U);
  EXPECT_EQ(table.first_left_in(0, 66), 20U);
  EXPECT_EQ(table.first_left_in(22, 66), 22U);
  EXPECT_EQ(table.first_left_in(46, 66), 66U);
  EXPECT_EQ(table.first_left_in(0, 10), 10U);
  EXPECT_THROW(static_cast<void>(table.is_left_in(66)), std::out_of_range);
}

TEST(JudgedPointsTest, FiltersMayAskForWhatFollowsFromOthersAndForTheModel) {
  PointTable table(recipe_of_blocks({filtered({following("k", "1e7 * (1 + mu)"), listed("H", {0.5}),
                                               range("mu", 0.0, 1.0, 11), listed("e", {1.0})},
                                              "k > 1.85e7 && g > 9")}));
  EXPECT_THAT(left_in(table), ElementsAre(9, 10));
}

TEST(JudgedPointsTest, ZipsAndSamplesAreFilteredToo) {
  Block zip =
      zipped({listed("H", {0.3, 0.2, 0.5}), listed("mu", {0.1, 0.2, 0.3}), listed("e", {1.0})});
  zip.set_where("H > 0.25");
  Block sample = sampled({uniform("H", 0.3, 1.1), uniform("mu", 0.0, 1.0), uniform("e", 0.5, 1.0)},
                         SAMPLE_SOBOL, 1000);
  sample.set_where("mu > 0.5");
  const PointTable table(recipe_of_blocks({zip, sample}));
  EXPECT_TRUE(table.is_left_in(0) && !table.is_left_in(1) && table.is_left_in(2));
  EXPECT_NEAR(static_cast<double>(left_in(table).size()), 502.0, 5.0);
}

TEST(JudgedPointsTest, AValueThatIsNotAllowedIsAnErrorWithBlockPointAndValues) {
  const Block wrong = filtered({following("k", "1e7 * (0.55 - mu)"), listed("H", {0.5}),
                                range("mu", 0.0, 1.0, 11), listed("e", {1.0})},
                               "");
  const std::string objection = fault_of_points(recipe_of_blocks({grid(""), wrong}));
  EXPECT_THAT(objection, HasSubstr("block 2: point 28: k = "));
  EXPECT_THAT(objection, HasSubstr("must be > 0"));
  EXPECT_THAT(objection, HasSubstr("mu = 0.6"));
}

TEST(JudgedPointsTest, ValuesOfPointsThatAreLeftOutDoNotMatter) {
  const Block block = filtered({following("k", "1e7 * (0.55 - mu)"), listed("H", {0.5, 5.0}),
                                range("mu", 0.0, 1.0, 11), listed("e", {1.0})},
                               "mu < 0.5 && H < 1");
  EXPECT_EQ(fault_of_points(recipe_of_blocks({block})), "");
}

TEST(JudgedPointsTest, AFilterWithoutAValueIsAnError) {
  EXPECT_THAT(fault_of_points(recipe_of_blocks({grid("sqrt(mu - 0.5) > 0.1")})),
              HasSubstr("point 0: where has no value"));
}

TEST(JudgedPointsTest, AFilterThatLeavesNothingInIsAnError) {
  EXPECT_THAT(fault_of_points(recipe_of_blocks({grid("mu > 2")})), HasSubstr("leaves no point in"));
}

TEST(JudgedPointsTest, OfMorePointsThanAreJudgedSomeAtRandomAre) {
  const auto large = [](const char* k, const char* where) {
    return recipe_of_blocks({filtered({following("k", k), listed("H", {0.5}),
                                       range("mu", 0.0, 1.0, 100'000'000), listed("e", {1.0})},
                                      where)});
  };
  EXPECT_THAT(fault_of_points(large("1e7 * (0.99 - mu)", "")), HasSubstr("k = "))
      << "one in a hundred";
  EXPECT_EQ(fault_of_points(large("1e7", "mu > 0.5")), "");
  EXPECT_EQ(fault_of_points(large("1e7", "mu > 2")), "") << "nobody has looked at all";
}

TEST(JudgedPointsTest, PlainStudiesNeedNoLook) {
  const PointTable table(recipe_of_blocks({grid("")}));
  EXPECT_FALSE(table.needs_judging());
  EXPECT_FALSE(table.has_filter());
}

}  // namespace
}  // namespace oblique::protocol
