#include "server/scheduler/study_points.h"

#include <algorithm>
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::PointTable;
using protocol::range;

/// Two models of 10 points each, then 30 points of the base model, then 40 models of one point.
PointTable mixed_table() {
  return PointTable(protocol::recipe_of(
      {{listed("E", {6e10, 7e10}), listed("H", {1.0}), range("mu", 0.1, 1.0, 10), listed("e", {1})},
       {listed("H", {1.0}), range("mu", 0.1, 1.0, 30), listed("e", {1.0})},
       {range("k", 1e7, 2e7, 40), listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})}}));
}

std::uint64_t cut(const Interval& free, const BatchSize& wanted) {
  return end_of_batch(mixed_table(), PointOrder{}, free, wanted);
}

TEST(BatchCut, ABatchEndsWithTheModelThatEndsNearest) {
  EXPECT_EQ(cut({0, 90}, {.points = 12}), 10U);
  EXPECT_EQ(cut({0, 90}, {.points = 18, .most_points = 25}), 10U);
  EXPECT_EQ(cut({8, 90}, {.points = 8, .most_points = 12}), 20U) << "two points would be few";
}

TEST(BatchCut, AModelOfMorePointsThanABatchMayHaveIsShared) {
  EXPECT_EQ(cut({20, 90}, {.points = 12, .most_points = 29}), 32U);
  EXPECT_EQ(cut({20, 90}, {.points = 12, .most_points = 30}), 50U);
}

TEST(BatchCut, ABatchHasSoManyModelsAsItHasRoomFor) {
  EXPECT_EQ(cut({50, 90}, {.points = 3, .groups = 8, .most_points = 100}), 58U);
  EXPECT_EQ(cut({50, 90}, {.points = 3, .groups = 8, .most_points = 5}), 55U);
  EXPECT_EQ(cut({0, 90}, {.points = 3, .groups = 2, .most_points = 20}), 20U);
  EXPECT_EQ(cut({0, 90}, {.points = 3, .groups = 2, .most_points = 19}), 10U);
}

TEST(BatchCut, NoBatchLeavesTheFreePoints) {
  for (std::uint64_t begin = 0; begin < 90; begin += 7) {
    for (std::uint64_t end = begin + 1; end <= 90; end += 5) {
      for (const std::uint64_t points : {0U, 1U, 8U, 17U, 1000U}) {
        for (const std::uint64_t most : {0U, 9U, 40U, 1000U}) {
          const auto at = cut({begin, end}, {points, 8, most, {}});
          ASSERT_GT(at, begin);
          ASSERT_LE(at, end);
          ASSERT_LE(at - begin, std::max({points, most, std::uint64_t{1}}));
        }
      }
    }
  }
}

}  // namespace
}  // namespace oblique::server
