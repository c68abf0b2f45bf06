#include "proto/recipe/point_table.h"

#include <stdexcept>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

/// A study with every feature: several blocks, listed and ranged axes, model axes in two of them.
Recipe varied_recipe() {
  return recipe_of({
      {listed("H", {0.96, 1.0, 1.04}), listed("mu", {0.4, 0.8}), range("e", 0.5, 1.0, 6)},
      {listed("k", {1e7, 2e7, 3e7}), listed("elements_per_link", {4, 8}), range("H", 0.9, 1.1, 5),
       listed("mu", {0.1}), listed("e", {1.0, 0.6})},
      {listed("H", {1.0}), range("mu", 0.0, 2.0, 9), listed("e", {0.7})},
      {range("eta2", 1.2, 1.4, 3), listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})},
  });
}

struct ExpectedPoint {
  solver::ModelParameters model = solver::preset("paper");
  double H_m;
  double mu;
  double e_star;
};

/// Enumerates one block by walking its axes as nested loops, the first outermost.
void enumerate(const Block& block, int depth, ExpectedPoint current,
               std::vector<ExpectedPoint>& points) {
  if (depth == block.axes_size()) {
    points.push_back(current);
    return;
  }
  const Axis& axis = block.axes(depth);
  for (std::uint64_t i = 0; i < axis_size(axis); ++i) {
    const double value = axis_value(axis, i);
    if (axis.key() == "H") {
      current.H_m = value;
    } else if (axis.key() == "mu") {
      current.mu = value;
    } else if (axis.key() == "e") {
      current.e_star = value;
    } else {
      solver::find_model_key(axis.key())->set(current.model, value);
    }
    enumerate(block, depth + 1, current, points);
  }
}

TEST(PointTableTest, EveryPointIsThatOfNestedLoopsOverTheAxes) {
  const PointTable table(varied_recipe());
  std::vector<ExpectedPoint> expected;
  for (const Block& block : table.recipe().blocks()) {
    enumerate(block, 0, {}, expected);
  }
  ASSERT_EQ(table.size(), expected.size());
  for (std::uint64_t i = 0; i < table.size(); ++i) {
    const Point point = table.point(i);
    EXPECT_EQ(point.H_m, expected[i].H_m) << "point " << i;
    EXPECT_EQ(point.mu, expected[i].mu) << "point " << i;
    EXPECT_EQ(point.e_star, expected[i].e_star) << "point " << i;
    EXPECT_EQ(table.model(point.model), expected[i].model) << "point " << i;
  }
}

TEST(PointTableTest, ASegmentIsTheLongestRunOfPointsWithOneModel) {
  const PointTable table(varied_recipe());
  std::uint64_t next = 0;
  int segments = 0;
  while (next < table.size()) {
    const Segment segment = table.segment_at(next);
    ASSERT_EQ(segment.first_point, next);
    ASSERT_GT(segment.count, 0U);
    for (std::uint64_t i = next; i < next + segment.count; ++i) {
      EXPECT_EQ(table.point(i).model, segment.model);
      EXPECT_EQ(table.segment_at(i).first_point, segment.first_point);
      EXPECT_EQ(table.segment_at(i).count, segment.count);
    }
    next += segment.count;
    ++segments;
  }
  EXPECT_EQ(next, table.size());
  EXPECT_EQ(segments, 1 + 6 + 1 + 3);
}

TEST(PointTableTest, BlocksThatShareAModelAndFollowEachOtherAreOneSegment) {
  const std::vector<Axis> point{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})};
  const std::vector<Axis> two{listed("H", {0.9, 1.0}), listed("mu", {0.4}), listed("e", {1.0})};
  std::vector<Axis> other_model = two;
  other_model.insert(other_model.begin(), listed("k", {1e7}));
  const PointTable table(recipe_of({point, two, point, other_model, other_model, two, two, point}));
  struct Run {
    std::uint64_t model;
    std::uint64_t first_point;
    std::uint64_t count;
  };
  for (const auto& [model, first_point, count] :
       {Run{0, 0, 4}, Run{1, 4, 2}, Run{2, 6, 2}, Run{0, 8, 5}}) {
    for (std::uint64_t i = first_point; i < first_point + count; ++i) {
      SCOPED_TRACE(i);
      const Segment segment = table.segment_at(i);
      EXPECT_EQ(segment.model, model);
      EXPECT_EQ(segment.first_point, first_point);
      EXPECT_EQ(segment.count, count);
    }
  }
  EXPECT_THROW(table.segment_at(13), std::out_of_range);
}

TEST(PointTableTest, BlocksWithoutModelAxesShareOneModel) {
  const PointTable table(varied_recipe());
  EXPECT_EQ(table.models(), 1U + 6U + 3U);
  EXPECT_EQ(table.point(0).model, table.segment_at(36 + 60).model);
  EXPECT_EQ(table.model(0), solver::preset("paper"));
}

TEST(PointTableTest, TheModelOfTheRecipeIsTheBaseOfEveryModelAxis) {
  Recipe recipe = recipe_of(
      {{listed("k", {1e7, 2e7}), listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})}});
  *recipe.mutable_model() = to_message(solver::preset("printed"));
  const PointTable table(recipe);
  solver::ModelParameters expected = solver::preset("printed");
  expected.k_N_m = 2e7;
  EXPECT_EQ(table.model(table.point(1).model), expected);
}

TEST(PointTableTest, ARecipeWithoutAModelIsRefused) {
  Recipe recipe = varied_recipe();
  recipe.clear_model();
  EXPECT_THAT([&] { PointTable{recipe}; }, testing::ThrowsMessage<solver::InputError>(
                                               testing::HasSubstr("the recipe has no model")));
}

TEST(PointTableTest, AStudyOfATrillionPointsIsReadAtAnyPoint) {
  const PointTable table(recipe_of({{range("H", 0.5, 1.1, 10'000), range("mu", 0.0, 1.0, 10'000),
                                     range("e", 0.5, 1.0, 10'000)}}));
  ASSERT_EQ(table.size(), kMaxPoints);
  const Point last = table.point(table.size() - 1);
  EXPECT_EQ(std::tuple(last.H_m, last.mu, last.e_star), std::tuple(1.1, 1.0, 1.0));
  // 123'456'789'012 = 1234 · 10^8 + 5678 · 10^4 + 9012
  const Point inner = table.point(123'456'789'012);
  EXPECT_EQ(inner.H_m, axis_value(table.recipe().blocks(0).axes(0), 1234));
  EXPECT_EQ(inner.mu, axis_value(table.recipe().blocks(0).axes(1), 5678));
  EXPECT_EQ(inner.e_star, axis_value(table.recipe().blocks(0).axes(2), 9012));
}

TEST(PointTableTest, ABillionModelsAreReadAtAnyModel) {
  const PointTable table(recipe_of({{range("k", 1e7, 3e7, 1'000'000'001), listed("H", {1.0}),
                                     listed("mu", {0.4}), listed("e", {1.0})}}));
  EXPECT_EQ(table.models(), 1'000'000'001U);
  EXPECT_EQ(table.model(500'000'000).k_N_m, 2e7);
  EXPECT_EQ(table.point(500'000'000).model, 500'000'000U);
}

TEST(PointTableTest, PointsAndModelsBeyondTheStudyAreOutOfRange) {
  const PointTable table(
      recipe_of({{listed("H", {1.0}), listed("mu", {0.4}), listed("e", {1.0})}}));
  EXPECT_THROW(table.point(1), std::out_of_range);
  EXPECT_THROW(table.segment_at(1), std::out_of_range);
  EXPECT_THROW(table.model(1), std::out_of_range);
}

}  // namespace
}  // namespace oblique::protocol
