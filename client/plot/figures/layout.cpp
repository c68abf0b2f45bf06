#include "client/plot/figures/layout.h"

#include <algorithm>
#include <cmath>

#include "client/plot/draw/text_width.h"
#include "client/plot/draw/theme.h"

namespace oblique::client::plot {
namespace {

constexpr double kBetweenPanels = 12.0;
constexpr double kBesideFrame = 16.0;        // to the colour bar or the legend
constexpr double kFewestSideBySide = 560.0;  // narrower pictures have their legend below

/// In the units that labels have.
Scale scale_of(const FigureAxis& axis) {
  return {axis.range.from * axis.per_unit, axis.range.to * axis.per_unit, axis.is_logarithmic};
}

double widest_label(const Ticks& ticks) {
  double widest = 0.0;
  for (const Tick& tick : ticks.ticks) {
    widest = std::max(widest, text_width(tick.label, kSmallSize));
  }
  return widest;
}

/// Labels stay a little apart.
bool labels_fit(const Ticks& ticks, double width) {
  double last_end = -1e9;
  for (const Tick& tick : ticks.ticks) {
    if (tick.label.empty()) {
      continue;
    }
    const double half = text_width(tick.label, kSmallSize) / 2.0;
    const double middle = tick.share * width;
    if (middle - half < last_end + 8.0) {
      return false;
    }
    last_end = middle + half;
  }
  return true;
}

/// Labels one below the other do not touch.
bool lines_fit(const Ticks& ticks, double height) {
  double last = -1e9;
  for (const Tick& tick : ticks.ticks) {
    if (!tick.label.empty() && tick.share * height < last + kSmallSize + 2.0) {
      return false;
    }
    last = tick.label.empty() ? last : tick.share * height;
  }
  return true;
}

/// So many marks that there are no halves between whole numbers.
int fewer_if_whole(const FigureAxis& axis, int wanted) {
  const double span = axis.range.to - axis.range.from;
  return axis.is_whole && !axis.is_logarithmic
             ? static_cast<int>(std::clamp(span, 1.0, static_cast<double>(wanted)))
             : wanted;
}

Ticks level_ticks(const FigureAxis& axis, double width) {
  int wanted = fewer_if_whole(axis, std::clamp(static_cast<int>(width / 60.0), 1, 10));
  Ticks ticks = ticks_of(scale_of(axis), wanted);
  while (wanted > 1 && !labels_fit(ticks, width)) {
    ticks = ticks_of(scale_of(axis), --wanted);
  }
  return ticks;
}

Ticks upright_ticks(const FigureAxis& axis, double height) {
  int wanted = fewer_if_whole(axis, std::clamp(static_cast<int>(height / 38.0), 1, 10));
  Ticks ticks = ticks_of(scale_of(axis), wanted);
  while (wanted > 1 && !lines_fit(ticks, height)) {
    ticks = ticks_of(scale_of(axis), --wanted);
  }
  if (!lines_fit(ticks, height)) {
    // The lowest alone.
    bool is_first = true;
    for (Tick& tick : ticks.ticks) {
      tick.label = is_first ? tick.label : std::string();
      is_first = is_first && tick.label.empty();
    }
  }
  return ticks;
}

/// Marks of a vertical axis that lists names, from above.
Ticks name_ticks(const std::vector<std::string>& names, double most_width) {
  Ticks ticks;
  const auto n = static_cast<double>(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double share = 1.0 - (static_cast<double>(i) + 0.5) / n;
    ticks.ticks.push_back({share * n, share, cut_to(names[i], kSmallSize, most_width)});
  }
  return ticks;
}

/// Makes the frame smaller so that both axes have one scale, in the middle of the room.
void make_equal(Box& frame, const Panel& panel) {
  const double per_x = frame.width / (panel.x.range.to - panel.x.range.from);
  const double per_y = frame.height / (panel.y.range.to - panel.y.range.from);
  const double per = std::min(per_x, per_y);
  const double width = per * (panel.x.range.to - panel.x.range.from);
  const double height = per * (panel.y.range.to - panel.y.range.from);
  frame = {frame.x + (frame.width - width) / 2.0, frame.y + (frame.height - height) / 2.0, width,
           height};
}

/// Whether a panel's horizontal axis is that of the one below, which has the numbers then.
bool shares_axis_below(const std::vector<Panel>& panels, std::size_t number) {
  if (number + 1 >= panels.size()) {
    return false;
  }
  const Panel& one = panels[number];
  const Panel& below = panels[number + 1];
  return one.x.label == below.x.label && one.x.range == below.x.range && !one.has_equal_aspect &&
         !below.has_equal_aspect;
}

/// Shares out what is left between the margins.
class Arranger {
 public:
  Arranger(const Figure& figure, const Size& size) : figure_(figure) {
    layout_.size = {std::clamp(size.width, kSmallestSide, kLargestSide),
                    std::clamp(size.height, kSmallestSide, kLargestSide)};
    room_ = {kMargin, kMargin, layout_.size.width - 2.0 * kMargin,
             layout_.size.height - 2.0 * kMargin};
  }

  Layout arranged() {
    place_texts();
    place_legend();
    grow_if_low();
    place_colour_bar();
    place_panels();
    return std::move(layout_);
  }

 private:
  void cut_above(double height) {
    room_.y += height;
    room_.height -= height;
  }

  void place_texts() {
    constexpr double kBold = 1.13;  // wider than the usual letters
    layout_.title = lines_of(figure_.title, kTitleSize * kBold, room_.width);
    layout_.subtitle = lines_of(figure_.subtitle, kTextSize, room_.width);
    for (const auto& note : figure_.notes) {
      for (auto& line : lines_of(note, kSmallSize, room_.width)) {
        layout_.notes.push_back(std::move(line));
      }
    }
    cut_above(kTitleHeight * static_cast<double>(layout_.title.size()) +
              kSubtitleHeight * static_cast<double>(layout_.subtitle.size()) + 8.0);
    const double notes = kNoteHeight * static_cast<double>(layout_.notes.size());
    room_.height -= notes > 0.0 ? notes + 4.0 : 0.0;
  }

  void place_legend() {
    layout_.entries = legend_of(figure_);
    if (layout_.entries.empty()) {
      return;
    }
    const LegendLayout beside =
        laid_out_beside(layout_.entries, std::min(0.36 * room_.width, 290.0));
    // A colour bar has the place beside.
    const bool is_beside = !has_colour_scale(figure_) && layout_.size.width >= kFewestSideBySide &&
                           beside.height <= room_.height;
    layout_.legend = is_beside ? beside : laid_out_below(layout_.entries, room_.width);
    if (is_beside) {
      room_.width -= beside.width + kBesideFrame;
      layout_.legend_x = room_.right() + kBesideFrame;
      layout_.legend_y = room_.y;
    } else {
      is_legend_below_ = true;
      room_.height -= layout_.legend.height + 6.0;
      layout_.legend_x = room_.x;
      layout_.legend_y = room_.bottom() + 6.0;
    }
  }

  /// Gives panels at least three quarters of the height that was asked for, and what can be read.
  void grow_if_low() {
    constexpr double kLowestPanel = 120.0;
    const double least = std::max({200.0, 0.75 * layout_.size.height,
                                   kLowestPanel * static_cast<double>(figure_.panels.size())});
    const double lacking = least - room_.height;
    if (lacking > 0.0) {
      layout_.size.height += lacking;
      room_.height += lacking;
      layout_.legend_y += is_legend_below_ ? lacking : 0.0;
    }
  }

  void place_colour_bar() {
    if (!has_colour_scale(figure_)) {
      room_.width -= 12.0;  // for half of the last label below
      return;
    }
    layout_.colour_ticks = upright_ticks(figure_.colours->axis, room_.height - 60.0);
    const double width = kColourBarWidth + kTickLength + 4.0 + widest_label(layout_.colour_ticks) +
                         4.0 + kLabelHeight;
    room_.width -= width + kBesideFrame;
    layout_.colour_bar = {room_.right() + kBesideFrame, 0.0, kColourBarWidth, 0.0};
  }

  double share_of_heights() const {
    double sum = 0.0;
    for (const Panel& panel : figure_.panels) {
      sum += std::max(panel.share, 0.01);
    }
    return sum;
  }

  Ticks vertical_ticks(const Panel& panel, double height) const {
    return panel.bars && !panel.bars->names.empty()
               ? name_ticks(panel.bars->names, 0.45 * room_.width)
               : upright_ticks(panel.y, height);
  }

  void place_panels() {
    const auto& panels = figure_.panels;
    const auto count = static_cast<double>(panels.size());
    const double below = kTickLabelHeight + kLabelHeight + 4.0;
    double heights = room_.height - kBetweenPanels * (count - 1.0);
    for (std::size_t i = 0; i < panels.size(); ++i) {
      heights -= shares_axis_below(panels, i) ? 0.0 : below;
    }
    // A label that is longer than its panel is high is written level.
    const bool labels_above =
        panels.size() > 2 || std::any_of(panels.begin(), panels.end(), [&](const Panel& panel) {
          return text_width(panel.y.label, kTextSize) > heights / count + 20.0;
        });
    for (const Panel& panel : panels) {
      heights -= labels_above ? kSubtitleHeight : 0.0;
      heights -= panel.title.empty() ? 0.0 : kSubtitleHeight;
    }
    heights = std::max(heights, 20.0 * count);
    double y = room_.y;
    double left = 0.0;
    for (std::size_t i = 0; i < panels.size(); ++i) {
      const double height = heights * std::max(panels[i].share, 0.01) / share_of_heights();
      PanelLayout place;
      place.has_label_above = labels_above;
      place.has_x_labels = !shares_axis_below(panels, i);
      y += (labels_above ? kSubtitleHeight : 0.0) +
           (panels[i].title.empty() ? 0.0 : kSubtitleHeight);
      place.frame = {0.0, y, 0.0, height};
      place.y_ticks = vertical_ticks(panels[i], height);
      left = std::max(left, widest_label(place.y_ticks) + kTickLength + 4.0 +
                                (labels_above || panels[i].y.label.empty() ? 0.0 : kLabelHeight));
      y += height + (place.has_x_labels ? below : 0.0) + kBetweenPanels;
      layout_.panels.push_back(std::move(place));
    }
    finish_panels(left);
  }

  void finish_panels(double left) {
    for (std::size_t i = 0; i < figure_.panels.size(); ++i) {
      const Panel& panel = figure_.panels[i];
      auto& place = layout_.panels[i];
      place.frame.x = room_.x + left;
      place.frame.width = std::max(room_.width - left, 20.0);
      if (panel.has_equal_aspect) {
        make_equal(place.frame, panel);
        place.y_ticks = vertical_ticks(panel, place.frame.height);
      }
      place.x_ticks = level_ticks(panel.x, place.frame.width);
    }
    if (layout_.colour_bar.width > 0.0 && !layout_.panels.empty()) {
      const Box& first = layout_.panels.front().frame;
      layout_.colour_bar.y = first.y + 10.0;
      layout_.colour_bar.height = layout_.panels.back().frame.bottom() - first.y - 20.0;
      layout_.colour_ticks = upright_ticks(figure_.colours->axis, layout_.colour_bar.height);
    }
  }

  const Figure& figure_;
  Layout layout_;
  Box room_;  // that is not given away yet
  bool is_legend_below_ = false;
};

}  // namespace

Layout layout_of(const Figure& figure, const Size& size) {
  return Arranger(figure, size).arranged();
}

}  // namespace oblique::client::plot
