#include "server/query/plan.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::range;
using Ranges = std::vector<PointRange>;

/// Ten values of H from 0.1, mu from 0.2 and e from 0.1, the fastest.
protocol::Recipe cube() {
  return protocol::recipe_of(
      {{range("H", 0.1, 1.0, 10), range("mu", 0.2, 2.0, 10), range("e", 0.1, 1.0, 10)}});
}

Ranges ranges(const std::string& condition) {
  return point_ranges(cube(), condition);
}

TEST(PointRanges, AnAxisIsRestrictedToOneValueMoreAtEachEnd) {
  EXPECT_EQ(ranges("H = 0.3"), (Ranges{{100, 399}}));
  EXPECT_EQ(ranges("H < 0.3"), (Ranges{{0, 399}}));
  EXPECT_EQ(ranges("H >= 0.8"), (Ranges{{600, 999}}));
  EXPECT_EQ(ranges("H BETWEEN 0.3 AND 0.5 AND mu > 0"), (Ranges{{100, 599}}));
  EXPECT_EQ(ranges("H = 0.3 AND (mu = 2 AND fn_peak_N > 1)"),
            (Ranges{{180, 199}, {280, 299}, {380, 399}}));
}

TEST(PointRanges, ListedValuesAreExact) {
  const auto recipe = protocol::recipe_of(
      {{listed("k", {3e7, 1e7}), listed("H", {0.5}), listed("mu", {0.1, 0.2}), listed("e", {1.0})},
       {listed("H", {0.5, 0.6}), listed("mu", {0.3}), listed("e", {1.0})}});
  EXPECT_EQ(point_ranges(recipe, "k = 1e7 AND mu = 0.2"), (Ranges{{3, 3}}));
  EXPECT_EQ(point_ranges(recipe, "mu = 0.3 AND H >= 0.6"), (Ranges{{5, 5}}));
  EXPECT_EQ(point_ranges(recipe, "H = 0.7"), Ranges());
}

TEST(PointRanges, OtherConditionsRestrictNothing) {
  for (const char* condition :
       {"", "NOT H = 0.3", "H <> 0.3", "H = 0.3 = 1", "H + 0 = 0.3", "fn_peak_N > 3", "H = mu",
        "CASE WHEN mu > 1 AND H = 0.3 AND e = 1 THEN 1 END", "H = '0.3'", "H = 0x1",
        "H = 0.3 OR fn_peak_N > 1", "H IN (0.3)", "H NOT BETWEEN 0.1 AND 0.2", "integrator = 0",
        "E = 7e10", "H = 0.3 COLLATE NOCASE", "(H = 0.3) = 0",
        "mu BETWEEN 1 BETWEEN 0 AND H = 0.3 AND 2"}) {
    EXPECT_EQ(ranges(condition), (Ranges{{0, 999}})) << condition;
  }
}

TEST(PointRanges, OfHugeStudiesAreFew) {
  const auto recipe = protocol::recipe_of(
      {{range("H", 0.1, 1.0, 10'000), range("mu", 0.0, 1.0, 10'001), range("e", 0.1, 1.0, 9'999)}});
  EXPECT_EQ(points_in(point_ranges(recipe, "H = 0.1 AND mu = 0 AND e = 1")), 2U * 2 * 2);
  EXPECT_EQ(point_ranges(recipe, "e = 1").size(), 1U);
  const std::vector<protocol::Axis> block{range("H", 0.1, 1.0, 100), range("mu", 0.0, 1.0, 90),
                                          range("e", 0.1, 1.0, 100)};
  EXPECT_EQ(point_ranges(protocol::recipe_of({block, block}), "e = 1").size(), 18'000U);
  EXPECT_EQ(point_ranges(protocol::recipe_of({block, block, block}), "e = 1").size(), 1U);
}

}  // namespace
}  // namespace oblique::server
