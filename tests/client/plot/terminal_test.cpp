// Pictures in a terminal.
#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/terminal/terminal_figure.h"
#include "tests/client/plot/figures_of_tests.h"

namespace oblique::client::plot {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr TerminalLook kPlain{60, 24, true, Shading::kNone};
constexpr TerminalLook kColoured{60, 24, false, Shading::kTrue};

std::vector<Figure> figures_for_terminals() {
  return {test::gappy_map(),           test::striped_kinds(40),       test::lines_of_count(3),
          test::lines_of_count(30),    test::dots_of_count(50),       test::dots_of_count(20'000),
          test::histogram_of_count(0), test::histogram_of_count(900), test::panels()};
}

TEST(PlainTerminal, GetsAsciiWithoutEscapesInItsWidth) {
  for (const Figure& figure : figures_for_terminals()) {
    for (const std::size_t columns : {24U, 40U, 80U}) {
      const auto text = text_of(figure, {columns, 24, true, Shading::kTrue});
      EXPECT_TRUE(std::all_of(text.begin(), text.end(), [](char letter) {
        return letter == '\n' || (letter >= ' ' && letter <= '~');
      })) << text;
      std::istringstream lines(text);
      std::string line;
      std::size_t drawn = 0;
      while (std::getline(lines, line)) {
        drawn += line.size() <= columns ? 1U : 0U;
      }
      EXPECT_GE(drawn, 12U);
    }
  }
}

TEST(PlainTerminal, DrawsKindsAsTheirLettersAndNamesThem) {
  const auto text = text_of(test::striped_kinds(4), kPlain);
  EXPECT_THAT(text, HasSubstr("|AAAA"));
  EXPECT_THAT(text, HasSubstr("\nA  SC sR 0 (3"));
}

TEST(PlainTerminal, MarksWhatIsMissingAndWhatFailed) {
  const auto text = text_of(test::gappy_map(), kPlain);
  EXPECT_THAT(text, HasSubstr("????"));
  EXPECT_THAT(text, HasSubstr("!!!!"));
  EXPECT_THAT(text, HasSubstr("no result (2)"));
  EXPECT_THAT(text, HasSubstr("failed (1)"));
}

TEST(ColouredTerminal, DrawsMapsInHalfBlocksAndLinesInDots) {
  const auto map = text_of(test::gappy_map(), kColoured);
  EXPECT_THAT(map, HasSubstr("\u2580"));
  EXPECT_THAT(map, HasSubstr("\x1b[0;38;2;"));
  const auto lines = text_of(test::lines_of_count(3), kColoured);
  EXPECT_THAT(lines, HasSubstr("\xe2\xa0"));
  EXPECT_THAT(lines, HasSubstr("\u2501\u2501"));
  EXPECT_THAT(text_of(test::histogram_of_count(900), kColoured), HasSubstr("\u2588"));
}

TEST(ColouredTerminal, GetsTheColoursThatItKnows) {
  const auto text = text_of(test::gappy_map(), {60, 24, false, Shading::k256});
  EXPECT_THAT(text, HasSubstr("\x1b[0;38;5;"));
  EXPECT_THAT(text, Not(HasSubstr(";2;")));
}

TEST(ColouredTerminal, IsLeftAsItWas) {
  for (const Figure& figure : figures_for_terminals()) {
    const auto text = text_of(figure, kColoured);
    const auto last = text.rfind("\x1b[");
    EXPECT_TRUE(last == std::string::npos || text.substr(last, 4) == "\x1b[0m");
  }
}

TEST(Terminal, IsNotSteeredByNamesOfOthers) {
  const auto text = text_of(test::modes_of(test::counted_cells(1, 1), {"a\x1b[2J"}), kColoured);
  EXPECT_THAT(text, Not(HasSubstr("\x1b[2J")));
  EXPECT_THAT(text, HasSubstr("\\x1b[2J"));
}

TEST(Terminal, DrawsTheRangeOfColours) {
  const auto text = text_of(test::gappy_map(), kPlain);
  EXPECT_THAT(text, HasSubstr("0 .:-=+*oO#@ 2.3e+07  duration of contact [us]"));
}

TEST(Terminal, SaysBelowEachPanelWhatItsLinesMean) {
  const auto text = text_of(test::panels(), kPlain);
  EXPECT_LT(text.find(" F_n "), text.find("energy [J]"));
  EXPECT_LT(text.find(" F_t"), text.find('\n', text.find(" F_n "))) << "they share a line";
  EXPECT_LT(text.find(" closure\n"), text.find("y [m]"));
  EXPECT_LT(text.find("x [m]"), text.find(" finger\n"));
}

TEST(Terminal, HasNumbersBesideZeroAtTheAxesOfFlatPanels) {
  const auto text = text_of(test::panels(), kPlain);
  const auto force =
      text.substr(text.find("force [N]"), text.find(" F_n ") - text.find("force [N]"));
  EXPECT_THAT(force, testing::ContainsRegex("[1-5]000\\+"));
}

TEST(Terminal, ShowsWhereALongNameIsCut) {
  Figure figure;
  Panel panel;
  panel.bars = Bars{.heights = {2.0, 1.0}, .names = {"SC SR sR sC sR SR sR sC SC SR sR", "sC sR"}};
  panel.x.range = {0.0, 2.0};
  figure.panels = {panel};
  EXPECT_THAT(text_of(figure, {60, 24, true, Shading::kNone}),
              HasSubstr("SC SR sR sC sR SR sR sC SC S..|"));
  EXPECT_THAT(text_of(figure, {60, 24, false, Shading::kTrue}),
              HasSubstr("SC SR sR sC sR SR sR sC SC SR\u2026"));
  EXPECT_THAT(text_of(figure, {80, 24, true, Shading::kNone}), HasSubstr("SC SR sR|"));
}

TEST(Terminal, BreaksLongSentencesAndLeavesALineForWhatFollows) {
  Figure figure = test::striped_kinds(40);
  figure.notes.emplace_back(
      "A sentence that is longer than forty letters, said in three lines, then.");
  const TerminalLook look{44, 45, true};
  const auto text = text_of(figure, look);
  std::istringstream lines(text);
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    EXPECT_LE(line.size(), look.columns) << line;
  }
  EXPECT_LT(count, look.lines);
  EXPECT_THAT(text, HasSubstr("letters, said in"));
}

}  // namespace
}  // namespace oblique::client::plot
