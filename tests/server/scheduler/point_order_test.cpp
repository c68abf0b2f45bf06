#include "server/scheduler/point_order.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/recipes.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::PointTable;
using protocol::range;
using protocol::sample_with_falls;

std::uint64_t fall_of(const PointTable& table, std::uint64_t point) {
  return solver::fall_hash(table.model(table.point(point).model));
}

/// Returns the hashes of the falls of all points in `order`. Equal neighbours are merged into one.
std::vector<std::uint64_t> runs_of_falls(const PointTable& table, const PointOrder& order) {
  std::vector<std::uint64_t> falls;
  for (std::uint64_t place = 0; place < table.size(); ++place) {
    const std::uint64_t fall = fall_of(table, order.point(place));
    if (falls.empty() || falls.back() != fall) {
      falls.push_back(fall);
    }
  }
  return falls;
}

void expect_each_point_once(const PointTable& table, const PointOrder& order) {
  std::set<std::uint64_t> points;
  for (std::uint64_t place = 0; place < table.size(); ++place) {
    const std::uint64_t point = order.point(place);
    EXPECT_EQ(order.place(point), place);
    points.insert(point);
  }
  EXPECT_EQ(points.size(), table.size());
  EXPECT_LT(*points.rbegin(), table.size());
}

TEST(PointOrderTest, PointsWithTheSameFallFollowEachOther) {
  const PointTable table(sample_with_falls(500, 7));
  PointOrder order;
  order.arrange(table, 0, IntervalSet(0, 500), 1);
  expect_each_point_once(table, order);
  const auto falls = runs_of_falls(table, order);
  EXPECT_EQ(falls.size(), 7U);
  EXPECT_EQ(falls.front(), fall_of(table, 0)) << "falls are in the order of their first points";
  const Interval first = order.group_at(table, 0);
  EXPECT_EQ(first.begin, 0U);
  EXPECT_NE(fall_of(table, order.point(first.end - 1)), fall_of(table, order.point(first.end)));
}

TEST(PointOrderTest, AGroupBeginsWithAnOpenPointOfEachOfItsFalls) {
  const PointTable table(sample_with_falls(500, 21));
  IntervalSet open(0, 500);
  open.erase(0, 100);
  PointOrder order;
  order.arrange(table, 0, open, 8);
  expect_each_point_once(table, order);
  std::set<std::uint64_t> all;
  std::uint64_t groups = 0;
  for (std::uint64_t at = 0; at < 500; at = order.group_at(table, at).end) {
    std::set<std::uint64_t> falls;
    const std::uint64_t falls_here = groups < 2 ? 8 : 5;
    for (std::uint64_t place = at; place < at + falls_here; ++place) {
      EXPECT_TRUE(open.contains(order.point(place)));
      falls.insert(fall_of(table, order.point(place)));
    }
    EXPECT_EQ(falls.size(), falls_here);
    all.merge(falls);
    ++groups;
  }
  EXPECT_EQ(groups, 3U);
  EXPECT_EQ(all.size(), 21U);
}

TEST(PointOrderTest, AGridStaysInTheOrderOfItsNumbers) {
  const PointTable table(
      protocol::recipe_of({{listed("E", {6e10, 7e10}), range("k", 1e7, 3e7, 5), listed("H", {1.0}),
                            range("mu", 0.0, 1.0, 4), listed("e", {1.0})}}));
  PointOrder order;
  order.arrange(table, 0, IntervalSet(0, 40), 8);
  EXPECT_FALSE(order.is_arranged()) << "models that differ in k alone share a fall";
  EXPECT_EQ(order.points({3, 30}), (std::vector<Interval>{{3, 30}}));
}

TEST(PointOrderTest, SetsOfPointsBecomeSetsOfPlacesAndBack) {
  const PointTable table(sample_with_falls(300, 5));
  PointOrder order;
  order.arrange(table, 0, IntervalSet(0, 300), 2);
  IntervalSet points;
  points.insert(0, 20);
  points.insert(33);
  points.insert(250, 300);
  const IntervalSet places = order.places(points);
  EXPECT_EQ(places.size(), points.size());
  IntervalSet back;
  places.for_each([&](const Interval& interval) {
    for (const Interval& part : order.points(interval)) {
      back.insert(part.begin, part.end);
    }
  });
  EXPECT_EQ(back, points);
}

TEST(PointOrderTest, PointsAddedByGrowthComeLast) {
  protocol::Recipe recipe = sample_with_falls(100, 3);
  PointOrder order;
  order.arrange(PointTable(recipe), 0, IntervalSet(0, 100), 1);
  *recipe.add_blocks() =
      protocol::filtered({range("k", 1e7, 3e7, 3),
                          protocol::following("E",
                                              "4e10 + 1e9 * floor(k / 1.5e7) - 2e9 * "
                                              "floor(k / 2.5e7)"),
                          listed("H", {1.0}), listed("mu", {0.1}), listed("e", {1.0})},
                         "");
  const PointTable grown(recipe);
  EXPECT_EQ(order.place(101), 101U) << "new points keep their places until they are arranged";
  order.arrange(grown, 100, IntervalSet(100, 103), 1);
  expect_each_point_once(grown, order);
  EXPECT_EQ(order.point(101), 102U);
  EXPECT_EQ(order.group_at(grown, 100), (Interval{100, 102}));
  EXPECT_LT(order.point(99), 100U);
}

TEST(PointOrderTest, AStudyOfTooManyModelsStaysInTheOrderOfItsNumbers) {
  const PointTable table(sample_with_falls(PointOrder::kMaxModels + 1, 3));
  PointOrder order;
  order.arrange(table, 0, IntervalSet(0, 1), 8);
  EXPECT_FALSE(order.is_arranged());
  EXPECT_EQ(order.point(77), 77U);
  EXPECT_EQ(order.group_at(table, 77), (Interval{77, 78}));
}

}  // namespace
}  // namespace oblique::server
