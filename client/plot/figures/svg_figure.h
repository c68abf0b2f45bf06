#pragma once

#include <string>

#include "client/plot/figures/figure.h"
#include "client/plot/figures/layout.h"

namespace oblique::client::plot {

/// The figure as an SVG document. Its bytes are the same on every machine, but for what zlib makes
/// of the cells of a map.
std::string svg_of(const Figure& figure, const Size& size = {});

}  // namespace oblique::client::plot
