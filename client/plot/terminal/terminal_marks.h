#pragma once

#include "client/plot/figures/figure.h"
#include "client/plot/terminal/terminal_figure.h"
#include "client/plot/terminal/text_canvas.h"

namespace oblique::client::plot {

/// Columns and lines of a canvas that a panel has inside its axes.
struct TextFrame {
  std::size_t left;
  std::size_t top;
  std::size_t columns;
  std::size_t lines;
};

/// Draws what a panel has, inside its axes.
void draw_panel_text(TextCanvas& canvas, const Figure& figure, const Panel& panel,
                     const TextFrame& frame, const TerminalLook& look);

/// Of cells that --where leaves out.
inline constexpr Colour kFilteredInk = colour_of(0x4a5a78);

/// The sign of a shade in ASCII, of ten from light to heavy, for a share from 0 to 1.
char shade_sign(double share);
/// The sign of a line in ASCII.
char stroke_sign(std::size_t stroke);
/// The colour of a line on a terminal, whose ground is not known.
Colour stroke_on_terminal(std::size_t stroke);

}  // namespace oblique::client::plot
