#pragma once

#include <cstddef>
#include <string>

#include "client/plot/draw/svg.h"
#include "client/plot/figures/figure.h"
#include "client/plot/figures/layout.h"

namespace oblique::client::plot {

/// The figure as an SVG document.
std::string svg_of(const Figure& figure, const Size& size = {});

// For pictures of several figures.

/// Defines the frames of a figure's panels, which must be done before they are drawn. Frames are
/// numbered through one document.
void define_frames(SvgWriter& svg, const Layout& layout, std::size_t first_frame);
/// Draws it with its upper left corner at 0, without styles and paper.
void draw_figure(SvgWriter& svg, const Figure& figure, const Layout& layout,
                 std::size_t first_frame);
/// For those who do not see it.
std::string description_of(const Figure& figure);

}  // namespace oblique::client::plot
