#include "server/asking/conditions.h"

#include <gtest/gtest.h>

#include "server/asking/point_spans.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::range;
using protocol::Recipe;
using Spans = std::vector<PointSpan>;

/// A hundred values each of H, mu and e.
Recipe cube() {
  return protocol::recipe_of(
      {{range("H", 0.01, 1.0, 100), range("mu", 0.02, 2.0, 100), range("e", 0.505, 1.0, 100)}});
}

Spans spans(const Recipe& recipe, const std::string& condition) {
  return spans_of(recipe, boxes_of(condition));
}

std::uint64_t count(const std::string& condition) {
  return points_in(spans(cube(), condition));
}

TEST(Conditions, ASliceIsTheRowsOfItsLine) {
  const auto line = spans(cube(), "H = 0.3 AND e = 1");
  ASSERT_EQ(line.size(), 100U);
  EXPECT_EQ(line.front(), (PointSpan{29 * 10'000 + 99, 29 * 10'000 + 99}));
  EXPECT_EQ(line.back(), (PointSpan{29 * 10'000 + 9'999, 29 * 10'000 + 9'999}));
  EXPECT_EQ(spans(cube(), "H = 0.3"), (Spans{{290'000, 299'999}}));
  EXPECT_EQ(spans(cube(), "H = 0.3 AND mu BETWEEN 0.02 AND 0.04"), (Spans{{290'000, 290'199}}));
}

TEST(Conditions, SetsOfNumbersAreJoinedAndCut) {
  ValueSet set({1.0, 2.0, false, true});
  set.unite(ValueSet({2.0, 3.0}));
  set.unite(ValueSet({5.0, 5.0}));
  set.unite(ValueSet({7.0, 6.0}));
  ASSERT_EQ(set.ranges().size(), 2U);
  EXPECT_TRUE(set.contains(1.0) && set.contains(2.0) && set.contains(3.0) && set.contains(5.0));
  EXPECT_FALSE(set.contains(0.9) || set.contains(4.0) || set.contains(6.5));
  ValueSet open({0.0, 2.0, true, true});
  open.unite(ValueSet({2.0, 4.0, true, false}));
  EXPECT_EQ(open.ranges().size(), 2U);
  EXPECT_FALSE(open.contains(2.0) || open.contains(0.0));
  set.intersect(open);
  EXPECT_TRUE(set.contains(1.0) && set.contains(1.5) && set.contains(3.0));
  EXPECT_FALSE(set.contains(2.0) || set.contains(5.0));
}

TEST(Conditions, EndsAreInOrOut) {
  EXPECT_EQ(count("H < 0.3"), 29U * 10'000);
  EXPECT_EQ(count("H <= 0.3"), 30U * 10'000);
  EXPECT_EQ(count("H > 0.3"), 70U * 10'000);
  EXPECT_EQ(count("H >= 0.3"), 71U * 10'000);
  EXPECT_EQ(count("0.3 > H"), 29U * 10'000);
  EXPECT_EQ(count("H = 0.305"), 0U);
  EXPECT_EQ(count("H IN (0.3, 0.5, 0.305)"), 2U * 10'000);
  EXPECT_EQ(count("H = -0.3"), 0U);
  EXPECT_EQ(count("H = 1 OR H = 0.01"), 2U * 10'000);
}

TEST(Conditions, WhatIsNotUnderstoodRestrictsNothing) {
  for (const char* condition :
       {"NOT H = 0.3", "H <> 0.3", "H = 0.3 = 1", "H + 0 = 0.3", "fn_peak_N > 3", "H = mu",
        "CASE WHEN mu > 1 AND H = 0.3 AND e = 1 THEN 1 END", "H = '0.3'", "H = 0x1",
        "H = 0.3 OR fn_peak_N > 1", "H NOT IN (0.3)", "H NOT BETWEEN 0.1 AND 0.2",
        "H = 12345678901234567890", "integrator = 0", "E = 7e10", "H = 0.3 COLLATE NOCASE"}) {
    EXPECT_EQ(count(condition), 1'000'000U) << condition;
  }
}

TEST(Conditions, WhatIsUnderstoodRestrictsBesideWhatIsNot) {
  EXPECT_EQ(count("H = 0.3 AND fn_peak_N > 3000"), 10'000U);
  EXPECT_EQ(count("(H = 0.3 OR H = 0.4) AND NOT (mu > 1) AND e = 1"), 200U);
  EXPECT_EQ(count("H BETWEEN 0.1 AND 0.2 AND e = 1 AND mu = 0.02"), 11U);
}

TEST(Conditions, NumbersOfPointsCountToo) {
  EXPECT_EQ(spans(cube(), "point = 7"), (Spans{{7, 7}}));
  EXPECT_EQ(spans(cube(), "point >= 5 AND point <= 9 AND H = 0.01"), (Spans{{5, 9}}));
  EXPECT_EQ(spans(cube(), "point BETWEEN 9 AND 5"), Spans());
  EXPECT_EQ(spans(cube(), "point < -1"), Spans());
}

TEST(Conditions, AxesOfModelsAndSeveralBlocksAreKnown) {
  const auto recipe = protocol::recipe_of(
      {{listed("k", {3e7, 1e7}), listed("H", {0.5}), listed("mu", {0.1, 0.2}), listed("e", {1.0})},
       {listed("H", {0.5, 0.6}), listed("mu", {0.3}), listed("e", {1.0})}});
  EXPECT_EQ(spans(recipe, "k = 1e7 AND mu = 0.2"), (Spans{{3, 3}}));
  EXPECT_EQ(spans(recipe, "mu = 0.3 AND H > 0.5"), (Spans{{5, 5}}));
  EXPECT_EQ(spans(recipe, "mu = 0.1 AND H = 0.5"), (Spans{{0, 2}}));
}

TEST(Conditions, SamplesAndExpressionsRestrictNothing) {
  auto recipe = cube();
  recipe.mutable_blocks(0)->mutable_axes(1)->Clear();
  recipe.mutable_blocks(0)->mutable_axes(1)->set_key("mu");
  recipe.mutable_blocks(0)->mutable_axes(1)->set_expression("H / 2");
  EXPECT_EQ(points_of(recipe), 10'000U);
  EXPECT_EQ(points_in(spans(recipe, "mu = 0.1 AND H = 0.5")), 100U);
  recipe.mutable_blocks(0)->mutable_sample()->set_count(500);
  EXPECT_EQ(spans(recipe, "H = 0.5"), (Spans{{0, 499}}));
}

TEST(Conditions, AxesSideBySideAreLookedThrough) {
  auto recipe = protocol::recipe_of(
      {{range("H", 0.1, 1.0, 10), range("mu", 0.0, 0.9, 10), listed("e", {1.0})}});
  recipe.mutable_blocks(0)->set_zip(true);
  EXPECT_EQ(spans(recipe, "H = 0.3 AND e = 1"), (Spans{{2, 2}}));
  EXPECT_EQ(spans(recipe, "H = 0.3 AND mu = 0.3"), Spans());
  EXPECT_EQ(spans(recipe, "mu >= 0.8"), (Spans{{8, 9}}));
}

TEST(Conditions, SpansAreReadInTheOrderOfAxesWhereTheyAreNotTooMany) {
  const auto sorted = [](const std::string& condition, const std::vector<SortKey>& keys) {
    return sorted_spans_of(cube(), boxes_of(condition), keys);
  };
  const auto by_mu = sorted("H > 0.5", {{"mu", true}});
  ASSERT_TRUE(by_mu.has_value());
  ASSERT_EQ(by_mu->size(), 5'000U);
  EXPECT_EQ(by_mu->front(), (PointSpan{509'900, 509'999}));
  EXPECT_EQ(by_mu->at(50), (PointSpan{509'800, 509'899}));
  EXPECT_EQ(by_mu->back(), (PointSpan{990'000, 990'099}));
  EXPECT_EQ(sorted("", {{"H"}, {"mu"}}).value_or(Spans()).size(), 10'000U);
  EXPECT_FALSE(sorted("", {{"e"}}).has_value());
  EXPECT_FALSE(sorted("", {{"fn_peak_N"}}).has_value());
  EXPECT_FALSE(sorted("", {{"k"}}).has_value());
}

TEST(Conditions, HugeStudiesCostNoMoreAndSpansStayBounded) {
  const auto recipe = protocol::recipe_of(
      {{range("H", 0.1, 1.0, 10'000), range("mu", 0.0, 1.0, 10'001), range("e", 0.1, 1.0, 9'999)}});
  EXPECT_EQ(points_in(spans(recipe, "H = 0.1 AND mu = 0.5 AND e = 1")), 1U);
  const auto many = spans(recipe, "e = 1");
  EXPECT_LE(many.size(), kMostSpans);
  EXPECT_EQ(many.back().last, 10'000ULL * 10'001 * 9'999 - 1);
}

TEST(Conditions, AsManyGapsAreReadOverAsMustBe) {
  const auto plane = [](std::uint64_t count) {
    return std::vector<protocol::Axis>{listed("H", {0.5}), range("mu", 0.0, 1.0, 15'000),
                                       range("e", 0.1, 1.0, count)};
  };
  // Twice 15 000 points with nine others between every two.
  const auto alike = spans(protocol::recipe_of({plane(10), plane(10)}), "e = 1");
  EXPECT_EQ(alike.size(), kMostSpans);
  EXPECT_EQ(points_in(alike), 30'000U + 10'000 * 9);
  // With four between the latter ones.
  const auto differing = spans(protocol::recipe_of({plane(10), plane(5)}), "e = 1");
  ASSERT_EQ(differing.size(), kMostSpans);
  EXPECT_EQ(points_in(differing), 30'000U + 10'000 * 4);
  EXPECT_EQ(differing[14'998], (PointSpan{149'989, 149'989}));
}

}  // namespace
}  // namespace oblique::server
