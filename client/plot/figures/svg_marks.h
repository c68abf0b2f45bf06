#pragma once

#include "client/plot/draw/svg.h"
#include "client/plot/figures/figure.h"
#include "client/plot/figures/layout.h"

namespace oblique::client::plot {

/// From values of a panel to places in the picture.
class Places {
 public:
  Places(const Panel& panel, const Box& frame);
  double x(double value) const { return frame_.x + x_.share_of(value) * frame_.width; }
  double y(double value) const { return frame_.bottom() - y_.share_of(value) * frame_.height; }
  const Scale& x_scale() const { return x_; }
  const Scale& y_scale() const { return y_; }
  const Box& frame() const { return frame_; }

 private:
  Scale x_;
  Scale y_;
  Box frame_;
};

/// The colour of a value.
Colour colour_at(const Colours& colours, double value);

// Each draws what a panel has of one sort, inside its frame.
void draw_cells(SvgWriter& svg, const Cells& cells, const Colours& colours, const Places& places);
void draw_kinds(SvgWriter& svg, const KindCells& kinds, const Places& places);
void draw_spans(SvgWriter& svg, const Panel& panel, const Places& places);
void draw_bars(SvgWriter& svg, const Bars& bars, const Places& places);
void draw_dots(SvgWriter& svg, const Dots& dots, const Figure& figure, const Places& places);
void draw_curves(SvgWriter& svg, const Panel& panel, const Figure& figure, const Places& places);
void draw_known(SvgWriter& svg, const Panel& panel, const Places& places);

}  // namespace oblique::client::plot
