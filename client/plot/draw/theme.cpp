#include "client/plot/draw/theme.h"

#include <array>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "client/plot/draw/svg.h"
#include "client/plot/draw/text_width.h"

namespace oblique::client::plot {
namespace {

/// What depends on light and dark.
std::string colours_for(const Inks& inks, bool is_dark) {
  std::string css = fmt::format(
      ".paper{{fill:{0}}}text{{fill:{1}}}.muted,text.muted{{fill:{2}}}.frame,.tick{{stroke:{2}}}"
      ".plate{{fill:{6}}}.grid{{stroke:{3}}}.miss{{stroke:{2}}}.fail{{stroke:{4}}}.bar{{fill:{5};"
      "stroke:{0}}}",
      hexadecimal(inks.paper), hexadecimal(inks.ink), hexadecimal(inks.muted),
      hexadecimal(inks.faint), hexadecimal(inks.alarm),
      hexadecimal(is_dark ? stroke(0).on_dark : stroke(0).on_light),
      is_dark ? "#eceff3" : hexadecimal(inks.paper));
  for (std::size_t i = 0; i < kStrokes; ++i) {
    const auto colour = hexadecimal(is_dark ? stroke(i).on_dark : stroke(i).on_light);
    css += fmt::format(".s{0},.m{0}{{stroke:{1}}}.f{0}{{fill:{1};stroke:{1}}}", i, colour);
  }
  css += fmt::format(".known{{stroke:{};fill:{}}}", hexadecimal(inks.ink), hexadecimal(inks.paper));
  // Spans are washes of one ink each: what is drawn over them keeps its contrast.
  constexpr std::array<std::string_view, kSpanKinds> kLight{"#d6e6f5", "#f7e3cf", "#c9ced6",
                                                            "#e3ecd0"};
  constexpr std::array<std::string_view, kSpanKinds> kDark{"#1d3146", "#42301f", "#4a515b",
                                                           "#2f3a22"};
  for (std::size_t i = 0; i < kSpanKinds; ++i) {
    css += fmt::format(".p{}{{fill:{}}}", i, (is_dark ? kDark : kLight)[i]);
  }
  return css;
}

std::string pattern(std::string_view id, double side, std::string_view style,
                    std::string_view path) {
  const auto length = svg_number(side);
  return fmt::format(
      "<pattern id=\"{}\" width=\"{}\" height=\"{}\" patternUnits=\"userSpaceOnUse\"><path "
      "class=\"{}\" d=\"{}\"/></pattern>\n",
      text_of(OwnId{id}), length, length, style, path);
}

}  // namespace

std::string style_sheet() {
  std::string css = fmt::format(
      "text{{font-family:{};font-size:{}px}}text.title{{font-size:{}px;font-weight:600}}"
      "text.small{{font-size:{}px}}text.letter{{font-weight:700;fill:#111;stroke:#fff;"
      "stroke-width:3px;stroke-linejoin:round;paint-order:stroke}}"
      ".frame,.tick,.grid{{fill:none;stroke-width:1}}.boundary{{fill:none;stroke:#111;"
      "stroke-width:.8}}.hatch{{stroke:#111;stroke-opacity:.42;stroke-width:1;fill:none}}"
      ".dot{{fill:#111;fill-opacity:.5;stroke:none}}.miss,.fail{{fill:none;stroke-width:1}}"
      ".miss{{stroke-opacity:.45}}.bar{{stroke-width:.5}}.line{{fill:none;stroke-width:1.7;"
      "stroke-linejoin:round;stroke-linecap:butt}}.mark{{fill:none;stroke-width:1.4}}"
      ".thin{{fill:none;stroke-width:1.1;stroke-linejoin:round}}.known{{stroke-width:1.5}}"
      ".cells{{image-rendering:pixelated}}.grid.pale{{stroke:#cdd3da}}",
      kFontFamilies, svg_number(kTextSize), svg_number(kTitleSize), svg_number(kSmallSize));
  for (std::size_t i = 0; i < kStrokes; ++i) {
    if (!stroke(i).dashes.empty()) {
      css += fmt::format(".s{}{{stroke-dasharray:{}}}", i, stroke(i).dashes);
    }
  }
  return fmt::format("{}{}@media screen and (prefers-color-scheme:dark){{{}}}", css,
                     colours_for(kLightInks, false), colours_for(kDarkInks, true));
}

std::string pattern_definitions(std::span<const Hatch> hatches, bool is_filtered) {
  // Side of the tile, and lines in it; lines that cross its corners are drawn beyond both.
  struct Lines {
    double side;
    std::string_view path;
  };
  constexpr std::array<Lines, kHatches> kLines{{
      {8, ""},
      {7, "M-2 2L2-2M-1 8L8-1M5 9L9 5"},
      {7, "M-2 5L2 9M-1-1L8 8M5-2L9 2"},
      {9, "M-1-1L10 10M-1 10L10-1"},
      {7, "M2.5 2.5h2v2h-2Z"},
      {6, "M0 3H6"},
      {6, "M3 0V6"},
      {8, "M0 4H8M4 0V8"},
  }};
  std::string all = "<defs>\n";
  for (const Hatch hatch : hatches) {
    const auto number = static_cast<std::size_t>(hatch);
    if (hatch != Hatch::kNone) {
      all += pattern(hatch_id(hatch), kLines[number].side, hatch == Hatch::kDots ? "dot" : "hatch",
                     kLines[number].path);
    }
  }
  all += pattern("missing", 8, "miss", "M-2 2L2-2M-1 9L9-1M6 10L10 6");
  all += pattern("failed", 6, "fail", "M-1-1L7 7M-1 7L7-1");
  if (is_filtered) {
    all += pattern("filtered", 8, "miss", "M1 2H4M5 6H8");
  }
  return all + "</defs>\n";
}

std::string hatch_id(Hatch hatch) {
  return fmt::format("h{}", static_cast<int>(hatch));
}

}  // namespace oblique::client::plot
