// What SVG is written of: numbers, texts, paths, widths.
#include <clocale>
#include <cmath>
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/draw/svg.h"
#include "client/plot/draw/text_width.h"

namespace oblique::client::plot {
namespace {

using testing::ElementsAre;

TEST(SvgNumbers, HaveTwoDecimalsAtMostAndNoZerosAtTheEnd) {
  EXPECT_EQ(svg_number(0.0), "0");
  EXPECT_EQ(svg_number(-0.001), "0");
  EXPECT_EQ(svg_number(12.0), "12");
  EXPECT_EQ(svg_number(0.5), ".5");
  EXPECT_EQ(svg_number(-0.05), "-.05");
  EXPECT_EQ(svg_number(123.456), "123.46");
  EXPECT_EQ(svg_number(std::nan("")), "0");
  EXPECT_EQ(svg_number(1e300), "10000000");
}

TEST(SvgNumbers, AreTheSameInEveryLanguage) {
  const std::string before = setlocale(LC_ALL, nullptr);
  for (const char* language : {"de_DE.UTF-8", "fr_FR.UTF-8", "C"}) {
    setlocale(LC_ALL, language);  // one that is not installed changes nothing
    EXPECT_EQ(svg_number(1234.5), "1234.5") << language;
  }
  setlocale(LC_ALL, before.c_str());
}

TEST(SvgTexts, AreNoMarkupAndSteerNothing) {
  EXPECT_EQ(svg_text("<script>a & \"b\"</script>"),
            "&lt;script&gt;a &amp; &quot;b&quot;&lt;/script&gt;");
  EXPECT_EQ(svg_text("a\x1b[31m\nb"), "a\\x1b[31m\\nb");
}

/// A picture with one rectangle, which has an id, a link and a rule of its own.
std::string picture_of(double width, std::uint64_t bytes = 0) {
  SvgWriter svg(10.0, 10.0, "t", "d");
  svg.style("a,.b{c:d}@media screen{.b{e:f}}");
  svg.tell_apart(bytes);
  svg.element("rect", {{"id", OwnId{"it"}}, {"fill", OwnLink{"it"}}, {"width", width}});
  return std::move(svg).finished();
}

std::string own_of(const std::string& svg) {
  const auto from = svg.find("id=\"") + 4;
  return svg.substr(from, svg.find('-', from) - from);
}

TEST(Ids, AreAPicturesOwnSoThatSeveralMayStandInOnePage) {
  const auto svg = picture_of(1.0);
  const auto own = own_of(svg);
  EXPECT_THAT(own, testing::MatchesRegex("p[0-9a-f]{8}"));
  EXPECT_THAT(svg, testing::HasSubstr("<rect id=\"" + own + "-it\" fill=\"url(#" + own + "-it)\""));
  EXPECT_EQ(own, own_of(picture_of(1.0)));
  EXPECT_NE(own, own_of(picture_of(2.0)));
  EXPECT_NE(own, own_of(picture_of(1.0, 7))) << "of other bytes";
}

TEST(Ids, FollowFromTextsThatLookLikePicturesToo) {
  const auto picture_with = [](const std::string& text) {
    SvgWriter svg(10.0, 10.0, "t", "d");
    svg.text(1.0, 1.0, "a", "start", "data:image/png;base64," + text);
    return std::move(svg).finished();
  };
  EXPECT_NE(own_of(picture_with("one")), own_of(picture_with("two")));
}

TEST(Styles, HoldInTheirPictureAlone) {
  const auto svg = picture_of(1.0);
  const auto root = '#' + own_of(svg) + "-picture ";
  EXPECT_THAT(svg, testing::HasSubstr("<style>" + root + "a," + root + ".b{c:d}@media screen{" +
                                      root + ".b{e:f}}</style>"));
}

TEST(Paths, SayOneNumberWhereALineIsLevelOrUpright) {
  PathData path;
  path.move_to(1.0, 2.0);
  path.line_to(5.0, 2.0);
  path.line_to(5.0, -3.5);
  path.line_to(6.0, 4.0);
  path.close();
  EXPECT_EQ(path.text(), "M1 2H5V-3.5L6 4Z");
}

TEST(TextWidths, GrowWithTheTextAndCountCharactersNotBytes) {
  EXPECT_EQ(text_width("", 12.0), 0.0);
  EXPECT_LT(text_width("il", 12.0), text_width("WM", 12.0));
  EXPECT_NEAR(text_width("\u03bc", 10.0), 6.36, 1e-9);
  EXPECT_DOUBLE_EQ(text_width("abc", 24.0), 2.0 * text_width("abc", 12.0));
}

TEST(Lines, AreBrokenAtSpacesAndLoseNothing) {
  const auto lines = lines_of("one two three", 10.0, text_width("one two", 10.0) + 0.1);
  EXPECT_THAT(lines, ElementsAre("one two", "three"));
  EXPECT_THAT(lines_of("unbreakable", 10.0, 1.0), ElementsAre("unbreakable"));
  EXPECT_THAT(lines_of("", 10.0, 100.0), ElementsAre());
}

TEST(Cutting, SaysThatSomethingIsMissing) {
  EXPECT_EQ(cut_to("short", 10.0, 100.0), "short");
  const auto cut = cut_to("a long text \u03bc\u03bc\u03bc", 10.0, 40.0);
  EXPECT_TRUE(cut.ends_with("...")) << cut;
  EXPECT_LE(text_width(cut, 10.0), 40.0);
}

}  // namespace
}  // namespace oblique::client::plot
