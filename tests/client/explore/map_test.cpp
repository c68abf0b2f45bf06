#include "client/explore/map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

/// Returns the number of the region that contains the point (x, y) of the unit square.
using Regions = std::function<int(double x, double y)>;

constexpr double kBracket = 1e-6;

/// Returns the regions of lattice points, and counts rounds and points.
struct Solver {
  Regions regions;
  MapGrid grid;
  std::size_t rounds = 0;
  std::set<std::pair<std::uint32_t, std::uint32_t>> points = {};
  std::size_t solved_twice = 0;

  std::vector<int> operator()(const std::vector<LatticePoint>& asked) {
    ++rounds;
    std::vector<int> found;
    for (const auto& [x, y] : asked) {
      solved_twice += points.emplace(x, y).second ? 0U : 1U;
      found.push_back(
          regions(static_cast<double>(x) / grid.last(), static_cast<double>(y) / grid.last()));
    }
    return found;
  }
};

struct Found {
  Solver solver;
  Borders borders = find_borders(solver.grid, std::ref(solver));
};

Found found_borders(const Regions& regions, std::uint32_t cells = 32) {
  return Found{.solver = {regions, MapGrid::of(cells, kBracket)}};
}

double area_of(const Borders& borders, int region) {
  return static_cast<double>(std::count(borders.raster.begin(), borders.raster.end(), region)) /
         static_cast<double>(borders.raster.size());
}

int disc(double x, double y) {
  return std::hypot(x - 0.47, y - 0.52) < 0.3 ? 1 : 0;
}

/// Three sectors that meet at (0.41, 0.56).
int sectors(double x, double y) {
  const double angle = std::atan2(y - 0.56, x - 0.41);
  return angle < -1.0 ? 0 : angle < 1.2 ? 1 : 2;
}

/// Two regions around a narrow third one.
int sliver(double x, double y) {
  const double height = 0.3 + 0.31 * x;
  return y < height ? 0 : y < height + 0.004 ? 1 : 2;
}

int waves(double x, double y) {
  return static_cast<int>(std::floor(3.0 * x + 2.0 * std::sin(4.0 * y))) + 3;
}

/// Returns a point of the vertex's bracket in the unit square: the lower end for `step` 0, the
/// upper end for `step` 1.
std::pair<double, double> place_of(const BorderVertex& vertex, double step, const MapGrid& grid) {
  return {(vertex.low.x + (vertex.is_along_x ? step : 0.0)) / grid.last(),
          (vertex.low.y + (vertex.is_along_x ? 0.0 : step)) / grid.last()};
}

TEST(FindBorders, BracketsHaveTheNamedRegionsAtTheirEndsAndAreAsShortAsAskedFor) {
  for (const auto& regions : std::vector<Regions>{disc, sectors, sliver, waves}) {
    const auto [solver, borders] = found_borders(regions);
    EXPECT_LE(1.0 / solver.grid.last(), kBracket);
    ASSERT_GT(borders.vertices.size(), 30U);
    for (const auto& vertex : borders.vertices) {
      const auto from = place_of(vertex, 0.0, solver.grid);
      const auto to = place_of(vertex, 1.0, solver.grid);
      ASSERT_NE(vertex.from, vertex.to);
      ASSERT_EQ(regions(from.first, from.second), vertex.from);
      ASSERT_EQ(regions(to.first, to.second), vertex.to);
    }
  }
}

TEST(FindBorders, ADiscHasOneClosedCurveOfItsLengthAndArea) {
  const auto [solver, borders] = found_borders(disc);
  ASSERT_EQ(borders.curves.size(), 1U);
  const auto& curve = borders.curves.front();
  EXPECT_EQ(curve.front(), curve.back());
  EXPECT_EQ(curve.size(), borders.vertices.size() + 1);
  double length = 0.0;
  for (std::size_t i = 1; i < curve.size(); ++i) {
    const auto a = place_of(borders.vertices[curve[i - 1]], 0.5, solver.grid);
    const auto b = place_of(borders.vertices[curve[i]], 0.5, solver.grid);
    length += std::hypot(a.first - b.first, a.second - b.second);
  }
  // A chord of length h is shorter than its arc; the relative difference is (h/r)^2/24.
  const double h = std::sqrt(2.0) / solver.grid.cells;
  EXPECT_NEAR(length, 2.0 * std::numbers::pi * 0.3,
              2.0 * std::numbers::pi * 0.3 * std::pow(h / 0.3, 2) / 24.0);
  EXPECT_NEAR(area_of(borders, 1), std::numbers::pi * 0.09, 1e-3);
  EXPECT_NEAR(area_of(borders, 0), 1.0 - std::numbers::pi * 0.09, 1e-3);
}

TEST(FindBorders, ThreeCurvesEndWithTheSameVertexWhereTheirRegionsMeet) {
  const auto [solver, borders] = found_borders(sectors);
  ASSERT_EQ(borders.curves.size(), 3U);
  std::map<std::size_t, int> ends;
  for (const auto& curve : borders.curves) {
    ++ends[curve.front()];
    ++ends[curve.back()];
  }
  const auto corner =
      std::find_if(ends.begin(), ends.end(), [](const auto& end) { return end.second == 3; });
  ASSERT_NE(corner, ends.end());
  const auto at = place_of(borders.vertices[corner->first], 0.5, solver.grid);
  EXPECT_NEAR(at.first, 0.41, 1.0 / (8.0 * solver.grid.cells));
  EXPECT_NEAR(at.second, 0.56, 1.0 / (8.0 * solver.grid.cells));
}

TEST(FindBorders, EveryVertexWithinACurveIsInNoOtherAndBetweenItsTwoRegions) {
  for (const auto& regions : std::vector<Regions>{disc, sectors, sliver, waves}) {
    const auto borders = found_borders(regions).borders;
    std::vector<int> uses(borders.vertices.size());
    for (const auto& curve : borders.curves) {
      std::set<std::pair<int, int>> sides;
      for (std::size_t i = 1; i + 1 < curve.size(); ++i) {
        const auto& vertex = borders.vertices[curve[i]];
        sides.insert(std::minmax(vertex.from, vertex.to));
        EXPECT_EQ(++uses[curve[i]], 1);
      }
      EXPECT_LE(sides.size(), 1U);
      ++uses[curve.front()];
      ++uses[curve.back()];
    }
    EXPECT_EQ(std::count(uses.begin(), uses.end(), 0), 0);
  }
}

TEST(FindBorders, ASliverThatTheGridMeetsIsFollowedIntoCellsThatItCrosses) {
  EXPECT_NEAR(area_of(found_borders(sliver).borders, 1), 0.004, 0.0004);
}

TEST(FindBorders, RasterCellsAreInTheRegionsThatTheCurvesSay) {
  for (const auto& regions : std::vector<Regions>{disc, sectors, waves}) {
    const auto [solver, borders] = found_borders(regions);
    int wrong = 0;
    for (std::size_t i = 0; i < borders.raster.size(); ++i) {
      const double x = (static_cast<double>(i % Borders::kRaster) + 0.5) / Borders::kRaster;
      const double y = (static_cast<double>(i / Borders::kRaster) + 0.5) / Borders::kRaster;
      wrong += borders.raster[i] != regions(x, y) ? 1 : 0;
    }
    // The distance between a chord of length h and its arc is at most h^2/8 times the curvature.
    // The curvature is at most 8, and the total length of the borders is at most 10.
    const double h = std::sqrt(2.0) / solver.grid.cells;
    EXPECT_LT(wrong, static_cast<double>(borders.raster.size()) * 10.0 * 8.0 * h * h / 12.0);
  }
}

TEST(FindBorders, SolvesTheGridThenAPointForEachHalvingOfABracket) {
  const auto [solver, borders] = found_borders(disc, 64);
  EXPECT_LT(solver.points.size(),
            65U * 65U + (solver.grid.halvings + 4U) * borders.vertices.size());
  EXPECT_LT(solver.rounds, 4U * solver.grid.halvings);
  EXPECT_EQ(solver.solved_twice, 0U);
}

TEST(FindBorders, OneRegionHasNoBorders) {
  const auto [solver, borders] = found_borders([](double, double) { return 7; });
  EXPECT_EQ(solver.rounds, 1U);
  EXPECT_TRUE(borders.curves.empty());
  EXPECT_EQ(area_of(borders, 7), 1.0);
}

TEST(FindShifts, AreThoseOfEverySixteenthVertexToAnotherBorder) {
  const auto borders = found_borders(disc).borders;
  constexpr double kShift = 0.0021;
  Solver shifted{[](double x, double y) { return disc(x - kShift, y); }, MapGrid::of(32, kBracket)};
  const auto shifts = find_shifts(shifted.grid, borders, 16, std::ref(shifted));
  EXPECT_LT(shifted.rounds, 30U);
  std::vector<double> expected;
  const auto& curve = borders.curves.front();
  for (std::size_t i = 8; i < curve.size(); i += 16) {
    const auto& vertex = borders.vertices[curve[i]];
    const auto [x, y] = place_of(vertex, 0.5, shifted.grid);
    const double across = vertex.is_along_x ? y - 0.52 : x - 0.47 - kShift;
    const double before = vertex.is_along_x ? x - 0.47 : y - 0.52;
    const double after = std::copysign(std::sqrt(0.09 - across * across), before) +
                         (vertex.is_along_x ? kShift : 0.0);
    expected.push_back(std::abs(after - before));
  }
  std::sort(expected.begin(), expected.end());
  ASSERT_EQ(shifts.size(), 1U);
  EXPECT_EQ(shifts[0].checked, expected.size());
  EXPECT_EQ(shifts[0].lost, 0U);
  EXPECT_NEAR(shifts[0].median, expected[expected.size() / 2], 2.0 / shifted.grid.last());
  EXPECT_NEAR(shifts[0].largest, expected.back(), 2.0 / shifted.grid.last());
}

TEST(FindShifts, HaveNoValueWhereNoSuchBorderIsNear) {
  const auto borders = found_borders(disc).borders;
  Solver none{[](double, double) { return 0; }, MapGrid::of(32, kBracket)};
  const auto shifts = find_shifts(none.grid, borders, 16, std::ref(none));
  ASSERT_EQ(shifts.size(), 1U);
  EXPECT_GT(shifts[0].checked, 0U);
  EXPECT_EQ(shifts[0].lost, shifts[0].checked);
  EXPECT_TRUE(std::isnan(shifts[0].median));
}

}  // namespace
}  // namespace oblique::client
