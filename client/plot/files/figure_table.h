#pragma once

#include <string>

#include "client/plot/figures/figure.h"
#include "client/plot/figures/layout.h"

namespace oblique::client::plot {

/// What a figure draws as CSV (RFC 4180, a header line), in SI units, numbers as they read back the
/// same: a row a cell with the middle of the cell, a point of a line, or a bar. A figure of several
/// panels has them in a first column.
std::string csv_of(const Figure& figure);

/// A script for gnuplot with its data in it, that draws about the same to a file of SVG that it
/// names by itself: for those who go on from there.
std::string gnuplot_of(const Figure& figure, const Size& size);

}  // namespace oblique::client::plot
