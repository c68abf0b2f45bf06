// Outlines of areas, and lines between them.
#include <algorithm>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/draw/areas.h"
#include "client/plot/draw/outline.h"

namespace oblique::client::plot {
namespace {

KindGrid grid_of(const std::vector<std::string>& rows) {
  KindGrid grid{rows.front().size(), rows.size(), {}};
  for (const auto& row : rows) {
    for (const char cell : row) {
      grid.kinds.push_back(cell == ' ' ? -1 : cell - 'a');
    }
  }
  return grid;
}

/// Area inside the outlines, holes taken off: twice the sum of signed trapezoids.
long area_of(const std::vector<Outline>& outlines) {
  long twice = 0;
  for (const Outline& outline : outlines) {
    for (std::size_t i = 0; i < outline.corners.size(); ++i) {
      const Corner& a = outline.corners[i];
      const Corner& b = outline.corners[(i + 1) % outline.corners.size()];
      twice += static_cast<long>(a.x) * static_cast<long>(b.y) -
               static_cast<long>(b.x) * static_cast<long>(a.y);
    }
  }
  return std::abs(twice) / 2;
}

TEST(Outlines, EncloseAsManyCellsAsThereAreOfTheKind) {
  const auto grid = grid_of({"aabba", "abaab", "bbaaa", "aabab", "abbba"});
  for (const int kind : {0, 1}) {
    EXPECT_EQ(area_of(outlines_of(grid, kind)),
              std::count(grid.kinds.begin(), grid.kinds.end(), kind))
        << kind;
  }
  EXPECT_TRUE(outlines_of(grid, 7).empty());
}

TEST(Outlines, HaveCornersOnlyWhereTheyTurn) {
  const auto outlines = outlines_of(grid_of({"bbbb", "baab", "baab", "bbbb"}), 0);
  ASSERT_EQ(outlines.size(), 1U);
  EXPECT_THAT(outlines[0].corners, testing::UnorderedElementsAre(Corner{1, 1}, Corner{3, 1},
                                                                 Corner{3, 3}, Corner{1, 3}));
}

TEST(Outlines, OfARingHaveTheHoleToo) {
  EXPECT_EQ(outlines_of(grid_of({"bbbb", "baab", "baab", "bbbb"}), 1).size(), 2U);
}

TEST(Outlines, OfCellsThatMeetAtACornerStayTheirOwn) {
  EXPECT_EQ(area_of(outlines_of(grid_of({"ab", "ba"}), 0)), 2);
}

TEST(Boundaries, LieBetweenKindsOnceAndNotAlongWhatIsUnknown) {
  const auto lines = boundaries_of(grid_of({"aab", "aab", "aa "}));
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_THAT(lines[0].corners, testing::ElementsAre(Corner{2, 0}, Corner{2, 2}));
  EXPECT_TRUE(boundaries_of(grid_of({"aaa", "aaa"})).empty());
}

TEST(Areas, AreOfOneKindAndShareEdges) {
  const auto found = areas_of(grid_of({"aab", "bba", " ba"}));
  ASSERT_EQ(found.areas.size(), 4U);
  EXPECT_EQ(found.areas[0].cells, 2U);
  EXPECT_EQ(found.areas[1].cells, 1U) << "the b that meets others at a corner";
  EXPECT_EQ(found.areas[2].cells, 3U);
  EXPECT_EQ(found.of_cells[6], Areas::kNone);
  EXPECT_EQ(found.of_cells[7], 2U);
}

TEST(Areas, HaveTheirLargestSquareAndItsMiddle) {
  const auto found = areas_of(grid_of({"abbbb", "abbba", "abbba", "aaaaa"}));
  ASSERT_EQ(found.areas.size(), 2U);
  EXPECT_EQ(found.areas[1].side, 3U);
  EXPECT_EQ(found.areas[1].x, 2.5);
  EXPECT_EQ(found.areas[1].y, 1.5);
}

TEST(Areas, GoOnOverSpecksInsideThemAndEndAtThoseBetween) {
  const auto left = without_specks(grid_of({"aacaabb", "aaaacbb", "caaabbb"}), 2);
  EXPECT_EQ(left.kinds, grid_of({"aaaaabb", "aaaa bb", "aaaabbb"}).kinds);
}

TEST(Areas, AreAllOutlinedWhereTheyAreFewAndNoneInNoise) {
  EXPECT_EQ(least_outlined(grid_of({"aab", "abb", "bbb"})), 1U);
  EXPECT_EQ(least_outlined({}), 1U);
  KindGrid noise{200, 200, {}};
  std::mt19937 random(7);
  for (int i = 0; i < 40'000; ++i) {
    noise.kinds.push_back(static_cast<int>(random() % 5));
  }
  EXPECT_EQ(least_outlined(noise), 0U);
  for (int i = 0; i < 40'000; ++i) {
    noise.kinds[static_cast<std::size_t>(i)] = i % 200 < 100 ? 1 : random() % 20 == 0 ? 2 : 3;
  }
  EXPECT_GT(least_outlined(noise), 1U) << "specks in one of two areas";
}

}  // namespace
}  // namespace oblique::client::plot
