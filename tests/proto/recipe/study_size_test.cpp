#include "proto/recipe/point_table.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

using testing::AllOf;
using testing::Each;
using testing::Ge;
using testing::Le;

const Axis kSomeH = listed("H", {0.9});
const Axis kSomeMu = listed("mu", {0.4});
const Axis kSomeE = listed("e", {1.0});

StudySize size_of_blocks(const std::vector<Block>& blocks) {
  return size_of(PointTable(recipe_of_blocks(blocks)));
}

TEST(StudySize, CountsDifferentFallsExactlyUpToAHundredThousandPoints) {
  const auto drawn = size_of_blocks(
      {sampled({uniform("E", 6e10, 8e10), uniform("k", 1e7, 1e8), kSomeH, kSomeMu, kSomeE},
               SAMPLE_SOBOL, 100'000)});
  EXPECT_EQ(drawn.falls, 100'000U) << "every E falls in its own way";
  EXPECT_FALSE(drawn.falls_estimated);
  const auto several = size_of_blocks({sampled(
      {range("E", 6e10, 8e10, 21), uniform("k", 1e7, 1e8), kSomeH, uniform("mu", 0.1, 1), kSomeE},
      SAMPLE_LATIN_HYPERCUBE, 20'000)});
  EXPECT_EQ(several.models, 20'000U);
  EXPECT_EQ(several.falls, 21U) << "k acts in contact alone";
}

TEST(StudySize, CountsAFallThatBlocksShareOnce) {
  const Block one = filtered({listed("E", {7e10, 8e10}), kSomeH, kSomeMu, kSomeE}, "");
  const Block other = filtered({listed("k", {1e7, 2e7}), kSomeH, kSomeMu, kSomeE}, "");
  EXPECT_EQ(size_of_blocks({one, other}).falls, 2U) << "7e10 is the default";
}

TEST(StudySize, CountsNoFallOfPointsThatAFilterLeavesOut) {
  const auto size = size_of_blocks(
      {filtered({range("E", 6e10, 8e10, 21), kSomeH, kSomeMu, kSomeE}, "E > 7.45e10")});
  EXPECT_EQ(size.points, 6U);
  EXPECT_EQ(size.falls, 6U);
  EXPECT_THAT(size.examples, Each(AllOf(Ge(15U), Le(20U))));
}

// 0.02 is four standard deviations of a share of a third in 10^4 points.
TEST(StudySize, EstimatesWhatAFilterLeavesInOfMorePoints) {
  const Block plain = filtered({kSomeH, range("mu", 0.0, 1.0, 1'000), kSomeE}, "");
  const Block large = filtered({kSomeH, range("mu", 0.0, 3.0, 3'000'000), kSomeE}, "mu < 1");
  const auto size = size_of_blocks({plain, large});
  EXPECT_TRUE(size.points_estimated);
  EXPECT_NEAR(static_cast<double>(size.points), 1'001'000.0, 0.02 * 3e6);
  const auto counted =
      size_of_blocks({plain, filtered({kSomeH, kSomeMu, listed("e", {0.5, 1})}, "e > 0.6")});
  EXPECT_FALSE(counted.points_estimated);
  EXPECT_EQ(counted.points, 1'001U);
}

TEST(StudySize, OfMorePointsFindsTheFallsThatManyPointsShareWithoutAnEstimate) {
  const auto size = size_of_blocks({filtered({listed("E", {6e10, 7e10, 8e10}), kSomeH,
                                              range("mu", 0.1, 1, 1'000), range("e", 0.5, 1, 100)},
                                             "")});
  EXPECT_EQ(size.points, 300'000U);
  EXPECT_EQ(size.falls, 3U);
  EXPECT_FALSE(size.falls_estimated);
  EXPECT_EQ(size.examples.size(), 64U);
}

// 400 is more than four standard deviations of the estimate.
TEST(StudySize, EstimatesTheFallsOfMorePointsFromTenThousand) {
  const auto shared = size_of_blocks(
      {filtered({range("E", 6e10, 8e10, 5'000), kSomeH, range("mu", 0.1, 1, 40), kSomeE}, "")});
  EXPECT_TRUE(shared.falls_estimated);
  EXPECT_NEAR(static_cast<double>(shared.falls), 5'000.0, 400.0);
  const auto drawn = size_of_blocks(
      {sampled({uniform("E", 6e10, 8e10), kSomeH, kSomeMu, kSomeE}, SAMPLE_RANDOM, 1'000'000'000)});
  EXPECT_TRUE(drawn.falls_estimated);
  EXPECT_EQ(drawn.falls, 1'000'000'000U);
}

TEST(StudySize, GivesExamplesFromAllOverTheStudy) {
  const auto examples =
      size_of_blocks({filtered({kSomeH, range("mu", 0.1, 1, 6'400), kSomeE}, "")}).examples;
  ASSERT_EQ(examples.size(), 64U);
  EXPECT_LT(*std::min_element(examples.begin(), examples.end()), 640U);
  EXPECT_GT(*std::max_element(examples.begin(), examples.end()), 5'760U);
}

TEST(StudySize, IsOfAResultForEachPointAndOfEachModel) {
  EXPECT_EQ(size_of_blocks({filtered({kSomeH, range("mu", 0.1, 1, 100), kSomeE}, "")}).bytes,
            100U * 970 + 600);
  EXPECT_EQ(
      size_of_blocks({filtered({range("k", 1e7, 2e7, 100), kSomeH, kSomeMu, kSomeE}, "")}).bytes,
      100U * (970 + 600));
}

}  // namespace
}  // namespace oblique::protocol
