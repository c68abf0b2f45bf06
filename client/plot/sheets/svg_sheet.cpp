#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/plot/draw/svg.h"
#include "client/plot/draw/text_width.h"
#include "client/plot/draw/theme.h"
#include "client/plot/figures/svg_figure.h"
#include "client/plot/sheets/sheet.h"

namespace oblique::client::plot {
namespace {

/// Compression is darker than restitution, in grey too; stick is hatched over both.
void add_span_styles(SvgWriter& svg) {
  const auto link = text_of(OwnLink{"stick"});
  svg.style(fmt::format(
      ".p0{{fill:#cfe1f3}}.p1{{fill:#fcf3e6}}.p2{{fill:{0}}}.stick{{stroke:#57606a;stroke-width:1;"
      "stroke-opacity:.55}}@media screen and (prefers-color-scheme:dark){{.p0{{fill:#1f364e}}"
      ".p1{{fill:#2a2219}}.p2{{fill:{0}}}.stick{{stroke:#a9b2bc}}}}",
      link));
  svg.verbatim(fmt::format(
      "<defs><pattern id=\"{}\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\"><path "
      "class=\"stick\" d=\"M-1 7L7-1M-1 1L1-1M5 7L7 5\"/></pattern></defs>\n",
      text_of(OwnId{"stick"})));
}

/// A figure with the place of its upper left corner.
struct PlacedPart {
  const Figure* figure;
  Layout layout;
  double x;
  double y;
};

/// The parts row by row; those of a row are equally high.
std::vector<PlacedPart> placed_parts(const Sheet& sheet, double width, double height, double& y) {
  constexpr double kNarrowestPart = 380.0;
  const std::size_t parts = std::max<std::size_t>(1, sheet.parts.size());
  const std::size_t columns = std::clamp<std::size_t>(
      static_cast<std::size_t>(width / kNarrowestPart), 1, std::min(sheet.columns, parts));
  const std::size_t rows = (parts + columns - 1) / columns;
  const Size room{width / static_cast<double>(columns), height / static_cast<double>(rows)};
  std::vector<PlacedPart> placed;
  for (std::size_t first = 0; first < sheet.parts.size(); first += columns) {
    const std::size_t end = std::min(first + columns, sheet.parts.size());
    std::vector<Layout> layouts;
    Size size = room;
    for (std::size_t i = first; i < end; ++i) {
      layouts.push_back(layout_of(sheet.parts[i], room));
      size.height = std::max(size.height, layouts.back().size.height);
    }
    double highest = size.height;
    for (std::size_t i = first; i < end; ++i) {
      Layout& layout = layouts[i - first];
      // A part that has the height by itself would grow again, as it grows with what it is asked
      // for.
      if (layout.size.height < size.height) {
        layout = layout_of(sheet.parts[i], size);
      }
      highest = std::max(highest, layout.size.height);
      placed.push_back(
          {&sheet.parts[i], std::move(layout), room.width * static_cast<double>(i - first), y});
    }
    y += highest;
  }
  return placed;
}

class Texts {
 public:
  Texts(const Sheet& sheet, double width)
      : title_(lines_of(sheet.title, kTitleSize * 1.13, width - 2.0 * kMargin)),
        subtitle_(lines_of(sheet.subtitle, kTextSize, width - 2.0 * kMargin)) {
    for (const auto& note : sheet.notes) {
      for (auto& line : lines_of(note, kSmallSize, width - 2.0 * kMargin)) {
        notes_.push_back(std::move(line));
      }
    }
  }

  double above() const {
    return kMargin + kTitleHeight * static_cast<double>(title_.size()) +
           kSubtitleHeight * static_cast<double>(subtitle_.size());
  }
  double below() const {
    return notes_.empty() ? 0.0 : kNoteHeight * static_cast<double>(notes_.size()) + kMargin;
  }
  void draw(SvgWriter& svg, double bottom) const {
    double y = kMargin;
    for (const auto& line : title_) {
      svg.text(kMargin, y + 13.0, "title", "start", line);
      y += kTitleHeight;
    }
    for (const auto& line : subtitle_) {
      svg.text(kMargin, y + 11.0, "muted", "start", line);
      y += kSubtitleHeight;
    }
    y = bottom - below() + kNoteHeight - 4.0;
    for (const auto& line : notes_) {
      svg.text(kMargin, y, "muted small", "start", line);
      y += kNoteHeight;
    }
  }

 private:
  std::vector<std::string> title_;
  std::vector<std::string> subtitle_;
  std::vector<std::string> notes_;
};

std::string described(const Sheet& sheet) {
  std::string text = sheet.subtitle;
  for (const Figure& part : sheet.parts) {
    text += ' ' + description_of(part);
  }
  for (const auto& note : sheet.notes) {
    text += ' ' + note;
  }
  return text;
}

}  // namespace

std::string svg_of(const Sheet& sheet, const Size& size) {
  const double width = std::clamp(size.width, kSmallestSide, kLargestSide);
  const Texts texts(sheet, width);
  double y = texts.above();
  const auto parts =
      placed_parts(sheet, width, std::max(size.height - y - texts.below(), kSmallestSide), y);
  const double bottom = y + texts.below();
  SvgWriter svg(width, bottom, sheet.title, described(sheet));
  svg.style(style_sheet());
  add_span_styles(svg);
  std::size_t frame = 0;
  for (const auto& part : parts) {
    define_frames(svg, part.layout, frame);
    frame += part.layout.panels.size();
  }
  svg.rectangle(0.0, 0.0, width, bottom, "paper");
  texts.draw(svg, bottom);
  frame = 0;
  for (const auto& part : parts) {
    svg.open("g", {{"transform",
                    fmt::format("translate({} {})", svg_number(part.x), svg_number(part.y))}});
    draw_figure(svg, *part.figure, part.layout, frame);
    svg.close("g");
    frame += part.layout.panels.size();
  }
  return std::move(svg).finished();
}

}  // namespace oblique::client::plot
