#include "client/plot/terminal/terminal_marks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "client/plot/figures/legend.h"

namespace oblique::client::plot {
namespace {

Scale scale_for(const FigureAxis& axis) {
  return {axis.range.from, axis.range.to, axis.is_logarithmic};
}

std::size_t cell_at(const std::vector<double>& edges, const Scale& scale, double share) {
  std::size_t low = 0;
  std::size_t high = edges.size() - 1;
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (scale.share_of(edges[middle]) <= share ? low : high) = middle;
  }
  return low;
}

/// What a map has at a share of both axes.
class MapLook {
 public:
  MapLook(const Figure& figure, const Panel& panel)
      : figure_(figure),
        panel_(panel),
        cells_(panel.kinds ? panel.kinds->cells : *panel.cells),
        x_(scale_for(panel.x)),
        y_(scale_for(panel.y)) {}

  std::size_t cell(double x_share, double y_share) const {
    return cell_at(cells_.y_edges, y_, y_share) * cells_.columns() +
           cell_at(cells_.x_edges, x_, x_share);
  }

  std::optional<Colour> colour(std::size_t cell) const {
    switch (cells_.states[cell]) {
      case CellState::kNoResult:
        return colour_of(0x6e6e6e);
      case CellState::kFiltered:
        return kFilteredInk;
      case CellState::kFailed:
        return colour_of(0xff0000);
      case CellState::kNoValue:
      case CellState::kNoPoint:
        return std::nullopt;
      case CellState::kSolved:
        break;
    }
    if (panel_.kinds) {
      const auto kind = static_cast<std::size_t>(cells_.values[cell]);
      return panel_.kinds->kinds[kind].is_rest ? kFillOfOthers.colour : plain_fill(kind);
    }
    return shade_of(*figure_.colours, share(cell));
  }

  std::string sign(std::size_t cell) const {
    switch (cells_.states[cell]) {
      case CellState::kNoResult:
        return "?";
      case CellState::kFiltered:
        return "-";
      case CellState::kFailed:
        return "!";
      case CellState::kNoValue:
      case CellState::kNoPoint:
        return " ";
      case CellState::kSolved:
        break;
    }
    if (panel_.kinds) {
      const auto kind = static_cast<std::size_t>(cells_.values[cell]);
      return panel_.kinds->kinds[kind].is_rest ? "." : letter_of(kind);
    }
    return {shade_sign(share(cell))};
  }

 private:
  double share(std::size_t cell) const {
    return scale_for(figure_.colours->axis).share_of(cells_.values[cell]);
  }

  const Figure& figure_;
  const Panel& panel_;
  const Cells& cells_;
  Scale x_;
  Scale y_;
};

void draw_map(TextCanvas& canvas, const MapLook& map, const TextFrame& frame, bool is_plain) {
  const auto share = [](std::size_t i, std::size_t n) {
    return (static_cast<double>(i) + 0.5) / static_cast<double>(n);
  };
  for (std::size_t line = 0; line < frame.lines; ++line) {
    for (std::size_t column = 0; column < frame.columns; ++column) {
      const double x = share(column, frame.columns);
      if (is_plain) {
        canvas.put(frame.left + column, frame.top + line,
                   map.sign(map.cell(x, 1.0 - share(line, frame.lines))));
        continue;
      }
      const auto upper = map.colour(map.cell(x, 1.0 - share(2 * line, 2 * frame.lines)));
      const auto lower = map.colour(map.cell(x, 1.0 - share(2 * line + 1, 2 * frame.lines)));
      if (upper) {
        canvas.put(frame.left + column, frame.top + line, "\u2580", upper, lower);
      } else if (lower) {
        canvas.put(frame.left + column, frame.top + line, "\u2584", lower);
      }
    }
  }
}

/// Dots two across and four down in a character, or one in ASCII.
class DotCanvas {
 public:
  DotCanvas(const TextFrame& frame, bool is_plain)
      : across_(is_plain ? 1 : 2),
        down_(is_plain ? 1 : 4),
        frame_(frame),
        bits_(frame.columns * frame.lines, 0),
        inks_(bits_.size()),
        signs_(bits_.size(), ' ') {}

  double width() const { return static_cast<double>(frame_.columns * across_); }
  double height() const { return static_cast<double>(frame_.lines * down_); }

  void dot(double x_share, double y_share, const Colour& ink, char sign) {
    if (!(x_share >= 0.0 && x_share <= 1.0 && y_share >= 0.0 && y_share <= 1.0)) {
      return;
    }
    const auto x =
        std::min(static_cast<std::size_t>(x_share * width()), frame_.columns * across_ - 1);
    const auto y =
        std::min(static_cast<std::size_t>((1.0 - y_share) * height()), frame_.lines * down_ - 1);
    const std::size_t cell = y / down_ * frame_.columns + x / across_;
    // The bits of Braille's dots in Unicode.
    constexpr std::array<std::array<unsigned, 4>, 2> kBits{{{1, 2, 4, 64}, {8, 16, 32, 128}}};
    bits_[cell] |= kBits[x % across_][y % down_];
    inks_[cell] = ink;
    signs_[cell] = sign;
  }

  void line(double x0, double y0, double x1, double y1, const Colour& ink, char sign) {
    const double steps =
        std::ceil(std::max(std::abs(x1 - x0) * width(), std::abs(y1 - y0) * height()));
    const double n = std::clamp(steps, 1.0, 4000.0);
    for (double i = 0.0; i <= n; i += 1.0) {
      dot(x0 + (x1 - x0) * i / n, y0 + (y1 - y0) * i / n, ink, sign);
    }
  }

  void draw(TextCanvas& canvas) const {
    for (std::size_t i = 0; i < bits_.size(); ++i) {
      if (bits_[i] == 0) {
        continue;
      }
      // U+2800 and the bits, in UTF-8.
      const std::string braille{static_cast<char>(0xe2), static_cast<char>(0xa0 | bits_[i] >> 6U),
                                static_cast<char>(0x80 | (bits_[i] & 0x3fU))};
      canvas.put(frame_.left + i % frame_.columns, frame_.top + i / frame_.columns,
                 across_ == 1 ? std::string(1, signs_[i]) : braille, inks_[i]);
    }
  }

 private:
  std::size_t across_;
  std::size_t down_;
  TextFrame frame_;
  std::vector<unsigned> bits_;
  std::vector<Colour> inks_;
  std::string signs_;
};

void draw_lines(DotCanvas& dots, const Figure& figure, const Panel& panel) {
  const Scale x = scale_for(panel.x);
  const Scale y = scale_for(panel.y);
  const auto colour_of_shade = [&figure](double value) {
    const auto& colours = *figure.colours;
    return shade_of(colours, scale_for(colours.axis).share_of(value));
  };
  for (std::size_t i = 0; panel.dots && i < panel.dots->x.size(); ++i) {
    const bool is_shaded = figure.colours && !panel.dots->shades.empty();
    const double value = is_shaded ? panel.dots->shades[i] : 0.0;
    dots.dot(x.share_of(panel.dots->x[i]), y.share_of(panel.dots->y[i]),
             is_shaded ? colour_of_shade(value) : stroke_on_terminal(0),
             is_shaded ? shade_sign(scale_for(figure.colours->axis).share_of(value)) : '*');
  }
  for (const Curve& curve : panel.curves) {
    const bool is_shaded = curve.shade && figure.colours;
    const Colour ink = is_shaded ? colour_of_shade(*curve.shade) : stroke_on_terminal(curve.stroke);
    const char sign = is_shaded ? shade_sign(scale_for(figure.colours->axis).share_of(*curve.shade))
                                : stroke_sign(curve.stroke);
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      const double x1 = x.share_of(curve.x[i]);
      const double y1 = y.share_of(curve.y[i]);
      dots.dot(x1, y1, ink, sign);
      if (i > 0 && curve.has_line) {
        const double x0 = x.share_of(curve.x[i - 1]);
        const double y0 = y.share_of(curve.y[i - 1]);
        if (!std::isnan(x0 + y0 + x1 + y1)) {
          dots.line(x0, y0, x1, y1, ink, sign);
        }
      }
    }
  }
  for (const KnownPoint& known : panel.known) {
    dots.dot(x.share_of(known.x), y.share_of(known.y), stroke_on_terminal(7), 'P');
  }
}

constexpr std::array<std::string_view, 9> kUpright{" ",      "\u2581", "\u2582", "\u2583", "\u2584",
                                                   "\u2585", "\u2586", "\u2587", "\u2588"};

/// Bars that stand, from the highest value in each column.
void draw_bars_up(TextCanvas& canvas, const Panel& panel, const TextFrame& frame, bool is_plain) {
  const Bars& bars = *panel.bars;
  const Scale x = scale_for(panel.x);
  const Scale y = scale_for(panel.y);
  for (std::size_t column = 0; column < frame.columns; ++column) {
    const double from = static_cast<double>(column) / static_cast<double>(frame.columns);
    const double to = static_cast<double>(column + 1) / static_cast<double>(frame.columns);
    double height = 0.0;
    for (std::size_t i = 0; i < bars.heights.size(); ++i) {
      if (x.share_of(bars.edges[i]) < to - 1e-9 && x.share_of(bars.edges[i + 1]) > from + 1e-9) {
        height = std::max(height, bars.heights[i]);
      }
    }
    const double share = height > 0.0 ? y.share_of(height) : 0.0;
    auto eighths = static_cast<std::size_t>(
        std::max(0.0, std::ceil(share * static_cast<double>(frame.lines * 8) - 1e-9)));
    for (std::size_t line = frame.lines; line-- > 0 && eighths > 0;) {
      const std::size_t here = std::min<std::size_t>(eighths, 8);
      canvas.put(frame.left + column, frame.top + line,
                 is_plain ? (here >= 4 ? "#" : "_") : kUpright[here], stroke_on_terminal(0));
      eighths -= here;
    }
  }
}

void draw_bars_right(TextCanvas& canvas, const Panel& panel, const TextFrame& frame,
                     bool is_plain) {
  const Bars& bars = *panel.bars;
  const Scale x = scale_for(panel.x);
  for (std::size_t i = 0; i < bars.heights.size() && i < frame.lines; ++i) {
    const auto length = static_cast<std::size_t>(std::ceil(
        std::clamp(x.share_of(bars.heights[i]), 0.0, 1.0) * static_cast<double>(frame.columns)));
    for (std::size_t column = 0; column < length; ++column) {
      canvas.put(frame.left + column, frame.top + i, is_plain ? "#" : "\u2586",
                 stroke_on_terminal(0));
    }
  }
}

}  // namespace

char shade_sign(double share) {
  constexpr std::string_view kSigns = ".:-=+*oO#@";
  const double at = std::isnan(share) ? 0.0 : std::clamp(share, 0.0, 1.0);
  return kSigns[std::min(static_cast<std::size_t>(at * 10.0), kSigns.size() - 1)];
}

char stroke_sign(std::size_t stroke) {
  constexpr std::string_view kSigns = "*o+x#@%&";
  return kSigns[stroke % kSigns.size()];
}

Colour stroke_on_terminal(std::size_t stroke) {
  // Between those for white and for black: they are read on both.
  constexpr std::array<std::uint32_t, kStrokes> kColours{0x2f8fd0, 0xe07020, 0x1fa37d, 0xd060a0,
                                                         0xa08a10, 0x8070e0, 0x909090, 0xb04040};
  return colour_of(kColours[stroke % kColours.size()]);
}

void draw_panel_text(TextCanvas& canvas, const Figure& figure, const Panel& panel,
                     const TextFrame& frame, const TerminalLook& look) {
  const auto has_cells = [](const Cells& cells) { return cells.columns() > 0 && cells.rows() > 0; };
  if ((panel.cells && has_cells(*panel.cells) && figure.colours) ||
      (panel.kinds && has_cells(panel.kinds->cells))) {
    draw_map(canvas, MapLook(figure, panel), frame, look.is_plain);
  }
  if (panel.bars) {
    if (panel.bars->names.empty()) {
      draw_bars_up(canvas, panel, frame, look.is_plain);
    } else {
      draw_bars_right(canvas, panel, frame, look.is_plain);
    }
  }
  DotCanvas dots(frame, look.is_plain);
  draw_lines(dots, figure, panel);
  dots.draw(canvas);
}

}  // namespace oblique::client::plot
