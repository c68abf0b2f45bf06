#include "client/plot/figures/svg_marks.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <spdlog/fmt/fmt.h>

#include "client/plot/draw/theme.h"

namespace oblique::client::plot {
namespace {

/// A line through places, without those that it passes within a tenth of a pixel anyway.
class Polyline {
 public:
  void add(double x, double y) {
    if (std::isnan(x) || std::isnan(y)) {
      end_piece();
      return;
    }
    if (is_new_) {
      path_.move_to(x, y);
      anchor_ = {x, y};
      is_new_ = false;
      return;
    }
    if (!passes_those_between({x, y})) {
      keep_last();
    }
    between_.push_back({x, y});
  }

  std::string text() {
    end_piece();
    return path_.text();
  }

 private:
  struct Place {
    double x;
    double y;
  };

  /// Whether the line from the anchor to `end` is as good as that through all places between.
  bool passes_those_between(const Place& end) const {
    constexpr double kTolerance = 0.1;
    constexpr std::size_t kMostBetween = 64;  // bounds the work
    const double dx = end.x - anchor_.x;
    const double dy = end.y - anchor_.y;
    const double squared = dx * dx + dy * dy;
    return between_.size() < kMostBetween &&
           std::all_of(between_.begin(), between_.end(), [&](const Place& place) {
             const double px = place.x - anchor_.x;
             const double py = place.y - anchor_.y;
             const double cross = px * dy - py * dx;
             const double along = px * dx + py * dy;
             return along >= 0.0 && along <= squared &&
                    cross * cross <= kTolerance * kTolerance * squared;
           });
  }
  void keep_last() {
    if (!between_.empty()) {
      anchor_ = between_.back();
      path_.line_to(anchor_.x, anchor_.y);
      between_.clear();
    }
  }
  void end_piece() {
    keep_last();
    is_new_ = true;
  }

  PathData path_;
  bool is_new_ = true;
  Place anchor_{};
  std::vector<Place> between_;  // those after the anchor that are not drawn yet
};

std::string line_of(const Curve& curve, const Places& places) {
  Polyline line;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    line.add(places.x(curve.x[i]), places.y(curve.y[i]));
  }
  return line.text();
}

std::string marks_of(const Curve& curve, const Places& places, Mark mark) {
  std::string path;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    const double x = places.x(curve.x[i]);
    const double y = places.y(curve.y[i]);
    if (!std::isnan(x) && !std::isnan(y)) {
      path += mark_path(mark, x, y, 2.8);
    }
  }
  return path;
}

}  // namespace

Places::Places(const Panel& panel, const Box& frame)
    : x_(panel.x.range.from, panel.x.range.to, panel.x.is_logarithmic),
      y_(panel.y.range.from, panel.y.range.to, panel.y.is_logarithmic),
      frame_(frame) {}

void draw_spans(SvgWriter& svg, const Panel& panel, const Places& places) {
  for (const Span& span : panel.spans) {
    const double from = std::max(places.x(span.from), places.frame().x);
    const double to = std::min(places.x(span.to), places.frame().right());
    if (to > from) {
      svg.rectangle(from, places.frame().y, to - from, places.frame().height,
                    fmt::format("p{}", span.kind % kSpanKinds));
    }
  }
}

void draw_bars(SvgWriter& svg, const Bars& bars, const Places& places) {
  PathData path;
  const auto add = [&path](double x0, double y0, double x1, double y1) {
    path.move_to(x0, y0);
    path.line_to(x1, y0);
    path.line_to(x1, y1);
    path.line_to(x0, y1);
    path.close();
  };
  const Box& frame = places.frame();
  const auto count = static_cast<double>(bars.names.size());
  for (std::size_t i = 0; i < bars.heights.size(); ++i) {
    if (!bars.names.empty()) {
      const double middle = frame.y + (static_cast<double>(i) + 0.5) / count * frame.height;
      const double half = 0.36 * frame.height / count;
      const double end = places.x(bars.heights[i]);
      add(frame.x, middle - half, std::isnan(end) ? frame.x : std::max(end, frame.x),
          middle + half);
    } else if (bars.heights[i] > 0.0) {
      add(places.x(bars.edges[i]), places.y(bars.heights[i]), places.x(bars.edges[i + 1]),
          frame.bottom());
    }
  }
  svg.path(path.text(), "bar");
}

void draw_dots(SvgWriter& svg, const Dots& dots, const Figure& figure, const Places& places) {
  // Dots of one colour are one path; 64 colours are as many as eyes tell apart.
  constexpr std::size_t kShadesOfDots = 4;
  std::map<std::size_t, std::string> paths;
  for (std::size_t i = 0; i < dots.x.size(); ++i) {
    const double x = places.x(dots.x[i]);
    const double y = places.y(dots.y[i]);
    if (std::isnan(x) || std::isnan(y)) {
      continue;
    }
    std::size_t number = 0;
    if (figure.colours && !dots.shades.empty()) {
      const auto& axis = figure.colours->axis;
      const double share =
          Scale(axis.range.from, axis.range.to, axis.is_logarithmic).share_of(dots.shades[i]);
      if (std::isnan(share)) {
        continue;
      }
      number = shade_number(share) / kShadesOfDots;
    }
    paths[number] += fmt::format("M{} {}h0", svg_number(x), svg_number(y));
  }
  const double width = dots.x.size() <= 300 ? 6.0 : dots.x.size() <= 1500 ? 4.5 : 3.0;
  for (const auto& [number, data] : paths) {
    const bool has_shades = figure.colours && !dots.shades.empty();
    svg.element(
        "path",
        {{"class", has_shades ? "dots" : "dots m0"},
         {"fill", "none"},
         {"stroke-linecap", "round"},
         {"stroke-width", width},
         {"stroke", has_shades ? hexadecimal(shade_of(
                                     *figure.colours,
                                     static_cast<double>(number * kShadesOfDots) / (kShades - 1)))
                               : std::string("currentColor")},
         {"d", data}});
  }
}

void draw_curves(SvgWriter& svg, const Panel& panel, const Figure& figure, const Places& places) {
  for (const Curve& curve : panel.curves) {
    if (curve.shade && figure.colours) {
      svg.element("path", {{"class", "thin"},
                           {"stroke", hexadecimal(colour_at(*figure.colours, *curve.shade))},
                           {"d", line_of(curve, places)}});
      continue;
    }
    if (curve.has_line) {
      svg.path(line_of(curve, places), fmt::format("line s{}", curve.stroke % kStrokes));
    }
    if (curve.has_marks) {
      svg.path(marks_of(curve, places, stroke(curve.stroke).mark),
               fmt::format("mark m{}", curve.stroke % kStrokes));
    }
  }
}

void draw_known(SvgWriter& svg, const Panel& panel, const Places& places) {
  for (const KnownPoint& known : panel.known) {
    const double x = places.x(known.x);
    const double y = places.y(known.y);
    if (!std::isnan(x) && !std::isnan(y)) {
      svg.path(mark_path(Mark::kDiamond, x, y, 4.5), "known");
    }
  }
}

}  // namespace oblique::client::plot
