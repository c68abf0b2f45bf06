// Maps: what colours and kinds say, and what is missing.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/figures/legend.h"
#include "client/plot/figures/svg_figure.h"
#include "tests/client/plot/draw/png_reader.h"
#include "tests/client/plot/figures_of_tests.h"

namespace oblique::client::plot {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

std::uint32_t opaque(const Colour& colour) {
  return static_cast<std::uint32_t>(colour.red) << 24U |
         static_cast<std::uint32_t>(colour.green) << 16U |
         static_cast<std::uint32_t>(colour.blue) << 8U | 0xffU;
}

TEST(HeatMap, HasTheLowestValueBelowOnTheLeftInTheDarkestColour) {
  const Figure figure =
      heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), test::counted_cells(8, 5));
  const auto pixels = test::pixels_in(svg_of(figure));
  EXPECT_EQ(pixels.width % 8, 0U) << "cells are whole pixels";
  EXPECT_EQ(pixels.height % 5, 0U);
  EXPECT_EQ(pixels.colours[(pixels.height - 1) * pixels.width], opaque(shade(0)));
  EXPECT_EQ(pixels.colours[pixels.width - 1], opaque(shade(255)));
}

TEST(HeatMap, OfCellsOfUnequalWidthHasEachWhereItIs) {
  Cells cells{{0.0, 0.9, 1.0}, {0.0, 1.0}, {1.0, 2.0}, {CellState::kSolved, CellState::kSolved}};
  const auto pixels = test::pixels_in(
      svg_of(heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), std::move(cells))));
  EXPECT_EQ(pixels.colours[pixels.width * 88 / 100], opaque(shade(0)));
  EXPECT_EQ(pixels.colours[pixels.width * 92 / 100], opaque(shade(255)));
}

TEST(HeatMap, ShowsWhatIsMissingAndWhatFailedAsSuchAndNotAsAValue) {
  const Figure figure = test::gappy_map();
  EXPECT_EQ(figure.gaps.no_result, 2U);
  EXPECT_EQ(figure.gaps.failed, 1U);
  const auto svg = svg_of(figure);
  EXPECT_THAT(svg, HasSubstr("no result (2)"));
  EXPECT_THAT(svg, HasSubstr("failed (1)"));
  EXPECT_THAT(svg, ContainsRegex("fill=\"url\\(#p[0-9a-f]+-missing\\)\""));
  EXPECT_THAT(svg, ContainsRegex("fill=\"url\\(#p[0-9a-f]+-failed\\)\""));
  EXPECT_THAT(svg, HasSubstr("1 cell is blank: solved, but without a value that can be drawn."));
  const auto pixels = test::pixels_in(svg);
  const std::size_t cell = pixels.width / 6;
  const std::size_t last_row = (pixels.height - 1) * pixels.width;
  EXPECT_EQ(pixels.colours[last_row + 3 * cell + cell / 2] & 0xffU, 0U) << "clear";
  EXPECT_EQ(pixels.colours[last_row + 2 * cell + cell / 2] & 0xffU, 0xffU);
}

TEST(HeatMap, HasASignOfItsOwnForWhatTheConditionLeavesOut) {
  Cells cells = test::counted_cells(6, 4);
  cells.states[3] = CellState::kNoResult;
  cells.states[4] = CellState::kFiltered;
  const auto svg = svg_of(heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), cells));
  EXPECT_THAT(svg, HasSubstr("no result (1)"));
  EXPECT_THAT(svg, HasSubstr("left out by --where (1)"));
  EXPECT_THAT(svg, ContainsRegex("fill=\"url\\(#p[0-9a-f]+-filtered\\)\""));
}

TEST(HeatMap, OfNoValueHasNoScaleOfColours) {
  Cells cells = test::counted_cells(6, 4);
  const auto map = [&] {
    return svg_of(heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), cells));
  };
  EXPECT_THAT(map(), HasSubstr("linearGradient"));
  cells.states.assign(cells.states.size(), CellState::kFiltered);
  EXPECT_THAT(map(), Not(HasSubstr("linearGradient")));
}

TEST(HeatMap, OfNothingAndOfOneValueSaysSo) {
  EXPECT_THAT(svg_of(heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), {})),
              HasSubstr("Nothing to draw"));
  Cells cells = test::counted_cells(3, 3);
  cells.values.assign(9, 4.0);
  EXPECT_THAT(svg_of(heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), cells)),
              HasSubstr("All cells have one value: fn_peak_N = 4 N."));
}

TEST(HeatMap, ByLogarithmsLeavesOutWhatHasNone) {
  const Figure figure = heat_map(test::usual_axes(), quantity_of("stick_total_s", "s"),
                                 test::counted_cells(3, 3), {.is_logarithmic = true});
  EXPECT_EQ(figure.gaps.no_value, 1U) << "the 0";
  EXPECT_EQ(figure.colours->axis.range, (Range{1.0, 8.0}));
}

TEST(HeatMap, WithARangeSaysThatThereIsMoreBeyond) {
  const Figure figure = heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"),
                                 test::counted_cells(3, 3), {.range = Range{2.0, 20.0}});
  EXPECT_TRUE(figure.colours->has_below);
  EXPECT_FALSE(figure.colours->has_above);
}

TEST(HeatMap, Of256By256CellsTakesLessThan200Kilobytes) {
  Cells cells = test::counted_cells(256, 256);
  for (std::size_t i = 0; i < cells.values.size(); ++i) {
    const double x = static_cast<double>(i % 256) / 255.0;
    const double y = static_cast<double>(i / 256) / 255.0;
    cells.values[i] = std::sin(9.0 * x * y) * std::exp(x) + std::cos(17.0 * y);
  }
  EXPECT_LT(svg_of(heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), cells)).size(),
            200'000U);
}

TEST(KindMap, NamesThoseWithTheMostPointsAndGathersTheOthers) {
  const Figure figure = test::striped_kinds(40);
  const auto& kinds = figure.panels[0].kinds->kinds;
  ASSERT_EQ(kinds.size(), kMostKinds + 1);
  EXPECT_TRUE(kinds.back().is_rest);
  EXPECT_THAT(kinds.back().name, HasSubstr("modes"));
  std::uint64_t points = 0;
  for (const Kind& kind : kinds) {
    points += kind.points;
  }
  EXPECT_EQ(points, 2400U);
  EXPECT_EQ(kinds.size() - 1 + kinds.back().gathered.size(), 41U);
  for (std::size_t i = 1; i + 1 < kinds.size(); ++i) {
    EXPECT_GE(kinds[i - 1].points, kinds[i].points);
  }
}

TEST(KindMap, SharesAreThoseOfPointsAndNotOfCells) {
  const auto figure = kind_map(test::usual_axes(), "major_mode", test::counted_cells(2, 1),
                               {"SC", "sC"}, {{"SC", 1}, {"sC", 9}, {"in no cell", 10}}, "modes");
  const auto& kinds = figure.panels[0].kinds->kinds;
  ASSERT_EQ(kinds.size(), 3U);
  EXPECT_EQ(kinds[0].name, "in no cell");
  EXPECT_EQ(kinds[1].name, "sC");
  EXPECT_THAT(svg_of(figure), AllOf(HasSubstr("SC (5.0 %)"), HasSubstr("sC (45 %)")));
}

TEST(KindMap, OfFewKindsNamesAll) {
  const Figure figure = test::striped_kinds(4);
  EXPECT_FALSE(figure.panels[0].kinds->kinds.back().is_rest);
  EXPECT_THAT(figure.notes, testing::ElementsAre(HasSubstr("S stick, s slip")));
}

TEST(KindMap, HatchesAndLettersItsAreas) {
  const auto svg = svg_of(test::striped_kinds(4));
  EXPECT_THAT(svg, HasSubstr(">A</text>"));
  EXPECT_THAT(svg, ContainsRegex("<pattern id=\"p[0-9a-f]+-h1\""));
  EXPECT_THAT(svg, HasSubstr("class=\"boundary\""));
}

TEST(KindMap, LikeNoiseIsColoursAlone) {
  Cells cells = test::counted_cells(300, 300);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < 90'000; ++i) {
    names.push_back(std::to_string((i % 300 * 7 + i / 300 * 11) % 5));
  }
  EXPECT_LT(svg_of(test::modes_of(cells, names)).size(), 200'000U);
}

TEST(KindMap, ShowsNamesOfOthersAsTextAlone) {
  Cells cells = test::counted_cells(1, 1);
  const auto svg = svg_of(test::modes_of(cells, {"<b>\x1b[2J"}));
  EXPECT_THAT(svg, Not(HasSubstr("<b>")));
  EXPECT_THAT(svg, Not(HasSubstr("\x1b")));
  EXPECT_THAT(svg, HasSubstr("&lt;b&gt;\\x1b[2J"));
}

TEST(Letters, GoOnBehindZ) {
  EXPECT_EQ(letter_of(0), "A");
  EXPECT_EQ(letter_of(25), "Z");
  EXPECT_EQ(letter_of(26), "AA");
}

TEST(Edges, LieHalfwayBetweenValues) {
  EXPECT_THAT(edges_between({1.0, 2.0, 4.0}, false), testing::ElementsAre(0.5, 1.5, 3.0, 5.0));
  EXPECT_THAT(
      edges_between({1.0, 4.0}, true),
      testing::ElementsAre(testing::DoubleEq(0.5), testing::DoubleEq(2.0), testing::DoubleEq(8.0)));
  EXPECT_THAT(edges_between({0.0}, false), testing::ElementsAre(-0.5, 0.5));
  EXPECT_THAT(edges_between({}, false), testing::IsEmpty());
}

}  // namespace
}  // namespace oblique::client::plot
