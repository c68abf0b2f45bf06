#include "client/explore/map.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

/// The region at a point of the unit square.
using Regions = std::function<int(double x, double y)>;

constexpr double kBracket = 1e-6;

struct Solved {
  MapGrid grid;
  BorderSearch search{grid};
  std::size_t rounds = 0;
  std::size_t points = 0;
  std::size_t solved_twice = 0;
};

std::vector<int> regions_of(const Regions& regions, const MapGrid& grid,
                            const std::vector<LatticePoint>& points) {
  std::vector<int> found;
  for (const auto& point : points) {
    found.push_back(regions(static_cast<double>(point.x) / grid.last(),
                            static_cast<double>(point.y) / grid.last()));
  }
  return found;
}

Solved solved(const Regions& regions, std::uint32_t cells = 32) {
  Solved all{.grid = MapGrid::of(cells, kBracket)};
  std::set<std::pair<std::uint32_t, std::uint32_t>> known;
  for (auto points = all.search.next(); !points.empty(); points = all.search.next()) {
    ++all.rounds;
    all.points += points.size();
    for (const auto& point : points) {
      all.solved_twice += known.emplace(point.x, point.y).second ? 0U : 1U;
    }
    all.search.set_regions(regions_of(regions, all.grid, points));
  }
  return all;
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

Position end_of(const BorderVertex& vertex, std::uint32_t step) {
  return vertex.is_along_x
             ? Position{static_cast<double>(vertex.low.x + step), static_cast<double>(vertex.low.y)}
             : Position{static_cast<double>(vertex.low.x),
                        static_cast<double>(vertex.low.y + step)};
}

TEST(BorderSearch, BracketsHaveTheNamedRegionsAtTheirEndsAndAreAsShortAsAskedFor) {
  for (const auto& regions : std::vector<Regions>{disc, sectors, sliver, waves}) {
    const auto found = solved(regions);
    const double last = found.grid.last();
    EXPECT_LE(1.0 / last, kBracket);
    const auto borders = found.search.borders();
    ASSERT_GT(borders.vertices.size(), 30U);
    for (const auto& vertex : borders.vertices) {
      const auto from = end_of(vertex, 0);
      const auto to = end_of(vertex, 1);
      ASSERT_NE(vertex.from, vertex.to);
      ASSERT_EQ(regions(from.x / last, from.y / last), vertex.from);
      ASSERT_EQ(regions(to.x / last, to.y / last), vertex.to);
    }
  }
}

TEST(BorderSearch, ADiscHasOneClosedCurveOfItsLengthAndArea) {
  const auto found = solved(disc);
  const auto borders = found.search.borders();
  ASSERT_EQ(borders.curves.size(), 1U);
  EXPECT_TRUE(borders.corners.empty());
  const auto& curve = borders.curves.front();
  EXPECT_TRUE(curve.is_closed());
  EXPECT_EQ(curve.vertices.size(), borders.vertices.size() + 1);
  double length = 0.0;
  for (std::size_t i = 1; i < curve.vertices.size(); ++i) {
    const auto a = borders.vertices[curve.vertices[i - 1]].middle();
    const auto b = borders.vertices[curve.vertices[i]].middle();
    length += std::hypot(a.x - b.x, a.y - b.y) / found.grid.last();
  }
  // Chords of length h are shorter than their arcs by a part (h/r)^2/24.
  const double h = std::sqrt(2.0) / found.grid.cells;
  EXPECT_NEAR(length, 2.0 * std::numbers::pi * 0.3,
              2.0 * std::numbers::pi * 0.3 * std::pow(h / 0.3, 2) / 24.0);
  const double cells = static_cast<double>(found.grid.cells) * found.grid.cells;
  EXPECT_NEAR(found.search.areas().at(1) / cells, std::numbers::pi * 0.09,
              std::numbers::pi * 0.09 * std::pow(h / 0.3, 2) / 6.0);
  EXPECT_NEAR(found.search.areas().at(0) / cells, 1.0 - std::numbers::pi * 0.09, 1e-3);
}

TEST(BorderSearch, ThreeRegionsMeetInACornerAtTheEndOfThreeCurves) {
  const auto found = solved(sectors);
  const auto borders = found.search.borders();
  ASSERT_EQ(borders.corners.size(), 1U);
  const auto& corner = borders.corners.front();
  const double last = found.grid.last();
  EXPECT_LT(corner.size, found.grid.cell() / 32);
  EXPECT_NEAR(corner.middle.x / last, 0.41, corner.size / last);
  EXPECT_NEAR(corner.middle.y / last, 0.56, corner.size / last);
  EXPECT_EQ(std::set<int>(corner.regions.begin(), corner.regions.end()), (std::set<int>{0, 1, 2}));
  ASSERT_EQ(borders.curves.size(), 3U);
  for (const auto& curve : borders.curves) {
    EXPECT_EQ(curve.begins_at.has_value() + curve.ends_at.has_value(), 1);
  }
}

TEST(BorderSearch, EveryVertexIsInOneCurveBetweenTwoRegions) {
  for (const auto& regions : std::vector<Regions>{disc, sectors, sliver, waves}) {
    const auto borders = solved(regions).search.borders();
    std::vector<int> uses(borders.vertices.size());
    for (const auto& curve : borders.curves) {
      const auto& first = borders.vertices[curve.vertices.front()];
      const std::set<int> sides{first.from, first.to};
      for (std::size_t i = curve.is_closed() ? 1 : 0; i < curve.vertices.size(); ++i) {
        const auto& vertex = borders.vertices[curve.vertices[i]];
        ++uses[curve.vertices[i]];
        ASSERT_EQ((std::set<int>{vertex.from, vertex.to}), sides);
      }
    }
    EXPECT_EQ(uses, std::vector<int>(uses.size(), 1));
  }
}

TEST(BorderSearch, ASliverThatTheGridMeetsIsFollowedIntoCellsThatItCrosses) {
  const auto found = solved(sliver);
  const double cells = static_cast<double>(found.grid.cells) * found.grid.cells;
  EXPECT_NEAR(found.search.areas().at(1) / cells, 0.004, 0.0004);
}

TEST(BorderSearch, RandomPointsAreInTheRegionsThatTheCurvesSay) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform;
  for (const auto& regions : std::vector<Regions>{disc, sectors, waves}) {
    const auto found = solved(regions);
    int wrong = 0;
    constexpr int kPoints = 20'000;
    for (int i = 0; i < kPoints; ++i) {
      const double x = uniform(random);
      const double y = uniform(random);
      wrong +=
          found.search.region_at({x * found.grid.last(), y * found.grid.last()}) != regions(x, y);
    }
    // Chords of length h are at most h^2/8 times the curvature, here 8, from their arcs, on
    // borders with a length of at most 10.
    const double h = std::sqrt(2.0) / found.grid.cells;
    EXPECT_LT(wrong, kPoints * 10.0 * 8.0 * h * h / 12.0);
  }
}

TEST(BorderSearch, SolvesTheGridThenAPointForEachHalvingOfABracketAndTwoForEachChord) {
  const auto found = solved(disc, 256);
  const std::size_t vertices = found.search.borders().vertices.size();
  ASSERT_GT(vertices, 500U);  // so many that brackets are halved, not divided into more parts
  EXPECT_LT(found.points, 257U * 257U + (found.grid.halvings + 4U) * vertices);
  EXPECT_LT(found.rounds, 3U * found.grid.halvings);
  EXPECT_EQ(found.solved_twice, 0U);
  EXPECT_EQ(solved([](double, double) { return 7; }).rounds, 1U);
}

TEST(BorderSearch, OneRegionHasNoBorders) {
  const auto found = solved([](double, double) { return 7; });
  EXPECT_TRUE(found.search.borders().curves.empty());
  EXPECT_EQ(found.search.areas().at(7), 32.0 * 32.0);
  EXPECT_EQ(found.search.region_at({0.0, 5.0}), 7);
}

TEST(ShiftSearch, FindsTheShiftOfEachSampleToAnotherBorder) {
  const auto found = solved(disc);
  const auto borders = found.search.borders();
  constexpr double kShift = 0.0021;
  ShiftSearch shifts(found.grid, borders, 16);
  std::size_t rounds = 0;
  for (auto points = shifts.next(); !points.empty(); points = shifts.next()) {
    shifts.set_regions(
        regions_of([](double x, double y) { return disc(x - kShift, y); }, found.grid, points));
    ++rounds;
  }
  EXPECT_LT(rounds, 30U);
  EXPECT_NEAR(static_cast<double>(shifts.shifts().size()),
              static_cast<double>(borders.vertices.size()) / 16.0, 1.0);
  for (const auto& shift : shifts.shifts()) {
    const auto& vertex = borders.vertices[shift.vertex];
    ASSERT_TRUE(shift.shift);
    const double last = found.grid.last();
    const double across =
        (vertex.is_along_x ? vertex.low.y / last - 0.52 : vertex.low.x / last - 0.47 - kShift);
    const double before =
        (vertex.is_along_x ? vertex.low.x / last - 0.47 : vertex.low.y / last - 0.52);
    const double root = std::sqrt(0.09 - across * across);
    const double after = std::copysign(root, before) + (vertex.is_along_x ? kShift : 0.0);
    EXPECT_NEAR(*shift.shift, std::abs(after - before),
                0.1 * std::abs(after - before) + 2.0 / last);
  }
}

TEST(ShiftSearch, ReportsThatNoSuchBorderIsNear) {
  const auto found = solved(disc);
  ShiftSearch shifts(found.grid, found.search.borders(), 16);
  for (auto points = shifts.next(); !points.empty(); points = shifts.next()) {
    shifts.set_regions(regions_of([](double, double) { return 0; }, found.grid, points));
  }
  for (const auto& shift : shifts.shifts()) {
    EXPECT_FALSE(shift.shift);
  }
}

}  // namespace
}  // namespace oblique::client
