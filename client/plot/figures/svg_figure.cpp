#include "client/plot/figures/svg_figure.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <spdlog/fmt/fmt.h>

#include "client/plot/draw/svg.h"
#include "client/plot/draw/text_width.h"
#include "client/plot/draw/theme.h"
#include "client/plot/figures/svg_marks.h"

namespace oblique::client::plot {
namespace {

std::string id_of_frame(std::size_t number) {
  return fmt::format("frame{}", number);
}

void draw_x_axis(SvgWriter& svg, const FigureAxis& axis, const PanelLayout& place) {
  const Box& frame = place.frame;
  for (const Tick& tick : place.x_ticks.ticks) {
    const double x = frame.x + tick.share * frame.width;
    const double length = tick.label.empty() ? kTickLength * 0.6 : kTickLength;
    svg.line(x, frame.bottom(), x, frame.bottom() + length, "tick");
    if (place.has_x_labels) {
      svg.text(x, frame.bottom() + kTickLabelHeight, "small", "middle", tick.label);
    }
  }
  if (place.has_x_labels) {
    svg.text(frame.x + frame.width / 2.0, frame.bottom() + kTickLabelHeight + kLabelHeight, "text",
             "middle", axis.label + place.x_ticks.factor());
  }
}

void draw_y_axis(SvgWriter& svg, const FigureAxis& axis, const PanelLayout& place, double left) {
  const Box& frame = place.frame;
  for (const Tick& tick : place.y_ticks.ticks) {
    const double y = frame.bottom() - tick.share * frame.height;
    const double length = tick.label.empty() ? kTickLength * 0.6 : kTickLength;
    svg.line(frame.x - length, y, frame.x, y, "tick");
    svg.text(frame.x - kTickLength - 3.0, y + 4.0, "small", "end", tick.label);
  }
  const std::string label = axis.label + place.y_ticks.factor();
  if (place.has_label_above) {
    svg.text(frame.x, frame.y - 5.0, "small", "start", label);
  } else {
    svg.text_upwards(left, frame.y + frame.height / 2.0, "text", label);
  }
}

/// Lines across at the marks, where no cells would hide them.
void draw_grid(SvgWriter& svg, const Panel& panel, const PanelLayout& place, bool has_plate) {
  if (panel.cells || panel.kinds) {
    return;
  }
  const Box& frame = place.frame;
  PathData path;
  for (const Tick& tick : place.y_ticks.ticks) {
    const double y = frame.bottom() - tick.share * frame.height;
    if (!tick.label.empty() && tick.share > 0.001 && tick.share < 0.999 &&
        !(panel.bars && !panel.bars->names.empty())) {
      path.move_to(frame.x, y);
      path.line_to(frame.right(), y);
    }
  }
  for (const Tick& tick : place.x_ticks.ticks) {
    const double x = frame.x + tick.share * frame.width;
    if (!tick.label.empty() && tick.share > 0.001 && tick.share < 0.999) {
      path.move_to(x, frame.y);
      path.line_to(x, frame.bottom());
    }
  }
  svg.path(path.text(), has_plate ? "grid pale" : "grid");
}

void draw_contents(SvgWriter& svg, const Figure& figure, const Panel& panel,
                   const PanelLayout& place) {
  const Places places(panel, place.frame);
  // Colours from dark to light want the same ground on light and dark screens.
  const bool has_plate = figure.colours && figure.colours->has_plate;
  if (has_plate) {
    const Box& frame = place.frame;
    svg.rectangle(frame.x, frame.y, frame.width, frame.height, "plate");
  }
  draw_spans(svg, panel, places);
  draw_grid(svg, panel, place, has_plate);
  const auto has_cells = [](const Cells& cells) { return cells.columns() > 0 && cells.rows() > 0; };
  if (panel.cells && figure.colours && has_cells(*panel.cells)) {
    draw_cells(svg, *panel.cells, *figure.colours, places);
  }
  if (panel.kinds && has_cells(panel.kinds->cells)) {
    draw_kinds(svg, *panel.kinds, places);
  }
  if (panel.bars) {
    draw_bars(svg, *panel.bars, places);
  }
  if (panel.dots) {
    draw_dots(svg, *panel.dots, figure, places);
  }
  draw_curves(svg, panel, figure, places);
  draw_known(svg, panel, places);
}

/// Where the label of the vertical axis stands: at the picture's edge, for all panels alike, but
/// beside a frame that is narrower than its room.
double label_place(const Panel& panel, const PanelLayout& place) {
  if (!panel.has_equal_aspect) {
    return kMargin + 11.0;
  }
  double widest = 0.0;
  for (const Tick& tick : place.y_ticks.ticks) {
    widest = std::max(widest, text_width(tick.label, kSmallSize));
  }
  return place.frame.x - kTickLength - widest - 9.0;
}

void draw_panel(SvgWriter& svg, const Figure& figure, std::size_t number, const Layout& layout,
                std::size_t first_frame) {
  const Panel& panel = figure.panels[number];
  const PanelLayout& place = layout.panels[number];
  const Box& frame = place.frame;
  const std::string frame_id = id_of_frame(first_frame + number);
  svg.open("g", {{"clip-path", OwnLink{frame_id}}});
  draw_contents(svg, figure, panel, place);
  svg.close("g");
  svg.rectangle(frame.x, frame.y, frame.width, frame.height, "frame");
  draw_x_axis(svg, panel.x, place);
  draw_y_axis(svg, panel.y, place, label_place(panel, place));
  if (!panel.title.empty()) {
    const double above = place.has_label_above ? kSubtitleHeight : 0.0;
    svg.text(frame.x, frame.y - 6.0 - above, "text", "start", panel.title);
  }
}

/// A triangle beyond an end of the colour bar, where values lie beyond it.
void draw_beyond(SvgWriter& svg, const Box& bar, double y, double tip, const Colour& colour) {
  PathData path;
  path.move_to(bar.x, y);
  path.line_to(bar.x + bar.width / 2.0, tip);
  path.line_to(bar.right(), y);
  path.close();
  svg.element("path", {{"fill", hexadecimal(colour)}, {"d", path.text()}});
}

void draw_colour_bar(SvgWriter& svg, const Colours& colours, const Layout& layout) {
  const Box& bar = layout.colour_bar;
  constexpr std::size_t kStops = 32;
  svg.open("linearGradient",
           {{"id", OwnId{"ramp"}}, {"x1", 0.0}, {"y1", 1.0}, {"x2", 0.0}, {"y2", 0.0}});
  for (std::size_t i = 0; i <= kStops; ++i) {
    const double share = static_cast<double>(i) / kStops;
    svg.element("stop", {{"offset", svg_number(100.0 * share) + "%"},
                         {"stop-color", hexadecimal(shade_of(colours, share))}});
  }
  svg.close("linearGradient");
  svg.element("rect", {{"x", bar.x},
                       {"y", bar.y},
                       {"width", bar.width},
                       {"height", bar.height},
                       {"fill", OwnLink{"ramp"}}});
  svg.rectangle(bar.x, bar.y, bar.width, bar.height, "frame");
  if (colours.has_above) {
    draw_beyond(svg, bar, bar.y - 1.0, bar.y - 10.0, shade_of(colours, 1.0));
  }
  if (colours.has_below) {
    draw_beyond(svg, bar, bar.bottom() + 1.0, bar.bottom() + 10.0, shade_of(colours, 0.0));
  }
  for (const Tick& tick : layout.colour_ticks.ticks) {
    const double y = bar.bottom() - tick.share * bar.height;
    const double length = tick.label.empty() ? kTickLength * 0.6 : kTickLength;
    svg.line(bar.right(), y, bar.right() + length, y, "tick");
    svg.text(bar.right() + kTickLength + 3.0, y + 4.0, "small", "start", tick.label);
  }
  double widest = 0.0;
  for (const Tick& tick : layout.colour_ticks.ticks) {
    widest = std::max(widest, text_width(tick.label, kSmallSize));
  }
  svg.text_upwards(bar.right() + kTickLength + 7.0 + widest + 12.0, bar.y + bar.height / 2.0,
                   "text", colours.axis.label + layout.colour_ticks.factor());
}

std::vector<Hatch> hatches_of(const Figure& figure) {
  std::set<Hatch> used;
  for (const Panel& panel : figure.panels) {
    for (std::size_t i = 0; panel.kinds && i < panel.kinds->kinds.size(); ++i) {
      used.insert(panel.kinds->kinds[i].is_rest ? kFillOfOthers.hatch : fill(i).hatch);
    }
  }
  return {used.begin(), used.end()};
}

}  // namespace

void define_frames(SvgWriter& svg, const Layout& layout, std::size_t first_frame) {
  for (std::size_t i = 0; i < layout.panels.size(); ++i) {
    const Box& frame = layout.panels[i].frame;
    const std::string frame_id = id_of_frame(first_frame + i);
    svg.open("clipPath", {{"id", OwnId{frame_id}}});
    svg.rectangle(frame.x, frame.y, frame.width, frame.height, "clip");
    svg.close("clipPath");
  }
}

std::string description_of(const Figure& figure) {
  std::string text = figure.subtitle;
  for (const Panel& panel : figure.panels) {
    text += fmt::format(" {} over {}.", panel.y.label, panel.x.label);
  }
  for (const auto& note : figure.notes) {
    text += ' ' + note;
  }
  return text;
}

void draw_figure(SvgWriter& svg, const Figure& figure, const Layout& layout,
                 std::size_t first_frame) {
  double y = kMargin;
  for (const auto& line : layout.title) {
    svg.text(kMargin, y + 13.0, "title", "start", line);
    y += kTitleHeight;
  }
  for (const auto& line : layout.subtitle) {
    svg.text(kMargin, y + 11.0, "muted", "start", line);
    y += kSubtitleHeight;
  }
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    draw_panel(svg, figure, i, layout, first_frame);
  }
  if (has_colour_scale(figure)) {
    draw_colour_bar(svg, *figure.colours, layout);
  }
  draw_legend(svg, layout.entries, layout.legend, layout.legend_x, layout.legend_y);
  y = layout.size.height - kMargin - kNoteHeight * (static_cast<double>(layout.notes.size()) - 1.0);
  for (const auto& line : layout.notes) {
    svg.text(kMargin, y, "muted small", "start", line);
    y += kNoteHeight;
  }
}

std::string svg_of(const Figure& figure, const Size& size) {
  const Layout layout = layout_of(figure, size);
  SvgWriter svg(layout.size.width, layout.size.height, figure.title, description_of(figure));
  svg.style(style_sheet());
  svg.verbatim(pattern_definitions(hatches_of(figure), figure.gaps.filtered > 0));
  define_frames(svg, layout, 0);
  svg.rectangle(0.0, 0.0, layout.size.width, layout.size.height, "paper");
  draw_figure(svg, figure, layout, 0);
  return std::move(svg).finished();
}

}  // namespace oblique::client::plot
