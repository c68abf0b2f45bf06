// Where things are in a picture: inside, and none over another.
#include <cmath>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/draw/text_width.h"
#include "client/plot/draw/theme.h"
#include "client/plot/figures/layout.h"
#include "client/plot/figures/svg_figure.h"
#include "tests/client/plot/figures_of_tests.h"

namespace oblique::client::plot {
namespace {

struct TextBox {
  std::string text;
  Box box;
};

std::string unescaped(std::string text) {
  for (const auto& [from, to] : std::map<std::string, std::string>{
           {"&amp;", "&"}, {"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}}) {
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from)) {
      text.replace(at, from.size(), to);
    }
  }
  return text;
}

/// Every text of a picture but the letters in areas, with the room that it takes.
std::vector<TextBox> texts_of(const std::string& svg) {
  const std::regex element(
      "<text class=\"([^\"]*)\" (?:x=\"([^\"]*)\" y=\"([^\"]*)\"|transform=\"translate\\(([^ ]*) "
      "([^)]*)\\) rotate\\(-90\\)\") text-anchor=\"([a-z]*)\">([^<]*)</text>");
  std::vector<TextBox> texts;
  std::istringstream lines(svg);
  std::string line;
  while (std::getline(lines, line)) {
    std::smatch found;
    if (!line.starts_with("<text") || !std::regex_match(line, found, element)) {
      continue;
    }
    const std::string style = found[1];
    if (style.find("letter") != std::string::npos) {
      continue;
    }
    const double size = style.find("title") != std::string::npos   ? kTitleSize
                        : style.find("small") != std::string::npos ? kSmallSize
                                                                   : kTextSize;
    const std::string text = unescaped(found[7]);
    const double width = text_width(text, size);
    const bool is_upright = found[4].matched;
    const double x = std::stod(found[is_upright ? 4 : 2]);
    const double y = std::stod(found[is_upright ? 5 : 3]);
    const double before = found[6] == "start" ? 0.0 : found[6] == "middle" ? width / 2.0 : width;
    texts.push_back({text, is_upright ? Box{x - 0.75 * size, y - width / 2.0, 0.95 * size, width}
                                      : Box{x - before, y - 0.75 * size, width, 0.95 * size}});
  }
  return texts;
}

bool overlap(const Box& a, const Box& b) {
  constexpr double kTouching = 0.5;
  return a.x + kTouching < b.right() && b.x + kTouching < a.right() &&
         a.y + kTouching < b.bottom() && b.y + kTouching < a.bottom();
}

std::vector<Figure> figures() {
  Figure empty = test::titled(heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), {}));
  Figure names = test::titled(name_counts(quantity_of("major_mode", ""),
                                          {"SC SR sR sC sR", "sC sR", "SC", std::string(60, 'W')},
                                          {40'000, 10'000, 300, 1}));
  return {test::gappy_map(),
          test::striped_kinds(3),
          test::striped_kinds(40),
          test::lines_of_count(1),
          test::lines_of_count(8),
          test::lines_of_count(30),
          test::dots_of_count(50),
          test::dots_of_count(20'000),
          test::histogram_of_count(0),
          test::histogram_of_count(1),
          test::histogram_of_count(5000),
          test::panels(),
          empty,
          names};
}

TEST(Layout, PutsNoTextOverAnotherNorOutsideNorIntoAFrame) {
  std::size_t number = 0;
  for (const Figure& figure : figures()) {
    for (const Size& size : {Size{320, 300}, Size{480, 360}, Size{760, 520}, Size{1600, 400},
                             Size{400, 1200}, Size{1200, 900}}) {
      const auto name = "figure " + std::to_string(number) + ", " + std::to_string(size.width);
      const Layout layout = layout_of(figure, size);
      const auto texts = texts_of(svg_of(figure, size));
      ASSERT_GT(texts.size(), 3U) << name;
      for (std::size_t i = 0; i < texts.size(); ++i) {
        const Box& box = texts[i].box;
        EXPECT_TRUE(box.x >= -0.5 && box.y >= 0.0 && box.right() <= layout.size.width + 0.5 &&
                    box.bottom() <= layout.size.height)
            << name << ": " << texts[i].text;
        for (std::size_t k = 0; k < i; ++k) {
          EXPECT_FALSE(overlap(box, texts[k].box))
              << name << ": " << texts[i].text << " | " << texts[k].text;
        }
        for (const PanelLayout& panel : layout.panels) {
          EXPECT_FALSE(overlap(box, panel.frame)) << name << ": " << texts[i].text;
        }
      }
    }
    ++number;
  }
}

TEST(Layout, GivesPanelsRoomWhateverTheLegendTakes) {
  for (const Figure& figure : figures()) {
    for (const Size& size : {Size{240, 240}, Size{480, 360}, Size{760, 520}}) {
      for (const PanelLayout& panel : layout_of(figure, size).panels) {
        EXPECT_GE(panel.frame.height, 30.0) << figure.title;
        EXPECT_GE(panel.frame.width, 30.0) << figure.title;
      }
    }
  }
}

TEST(Layout, KeepsTheSizeThatWasAskedForWhereThereIsRoom) {
  EXPECT_EQ(layout_of(test::gappy_map(), {760, 520}).size.height, 520.0);
  EXPECT_EQ(layout_of(test::striped_kinds(40), {760, 520}).size.height, 520.0);
  EXPECT_GT(layout_of(test::striped_kinds(40), {320, 240}).size.height, 240.0);
}

TEST(Layout, DrawsAMetreAsLongUpwardsAsSideways) {
  const Figure figure = test::panels();
  const Layout layout = layout_of(figure, {760, 900});
  const Panel& shape = figure.panels.back();
  const Box& frame = layout.panels.back().frame;
  EXPECT_NEAR(frame.width / (shape.x.range.to - shape.x.range.from),
              frame.height / (shape.y.range.to - shape.y.range.from), 1e-9);
}

}  // namespace
}  // namespace oblique::client::plot
