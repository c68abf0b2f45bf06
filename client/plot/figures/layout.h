#pragma once

#include <string>
#include <vector>

#include "client/plot/figures/figure.h"
#include "client/plot/figures/legend.h"

namespace oblique::client::plot {

/// Size of a picture, in pixels of a screen.
struct Size {
  double width = 760.0;
  double height = 520.0;
};
/// No picture is smaller: nothing could be read in it. Nor larger.
inline constexpr double kSmallestSide = 240.0;
inline constexpr double kLargestSide = 10'000.0;

struct Box {
  double x = 0.0;
  double y = 0.0;
  double width = 0.0;
  double height = 0.0;

  double right() const { return x + width; }
  double bottom() const { return y + height; }
};

/// Where one panel is, with the marks of its axes.
struct PanelLayout {
  Box frame;
  Ticks x_ticks;
  Ticks y_ticks;
  bool has_x_labels = true;      ///< else they are below the panel under it
  bool has_label_above = false;  ///< the vertical axis' label, written level
};

/// Where everything of a picture is. Nothing covers anything else: where texts and the legend leave
/// too little of the height for the panels, the picture is higher than it was to be.
struct Layout {
  Size size;
  std::vector<std::string> title;
  std::vector<std::string> subtitle;
  std::vector<PanelLayout> panels;
  Box colour_bar;  ///< of no width: there is none
  Ticks colour_ticks;
  std::vector<LegendEntry> entries;
  LegendLayout legend;
  double legend_x = 0.0;
  double legend_y = 0.0;
  std::vector<std::string> notes;
};

Layout layout_of(const Figure& figure, const Size& size);

// Distances that drawing shares with the layout.
inline constexpr double kMargin = 12.0;
inline constexpr double kTitleHeight = 20.0;
inline constexpr double kSubtitleHeight = 16.0;
inline constexpr double kNoteHeight = 15.0;
inline constexpr double kTickLength = 5.0;
inline constexpr double kTickLabelHeight = 17.0;
inline constexpr double kLabelHeight = 18.0;
inline constexpr double kColourBarWidth = 14.0;

}  // namespace oblique::client::plot
