#pragma once

#include <string>

#include "client/plot/figure.h"

namespace oblique::client::plot {

/// What a figure draws as CSV (RFC 4180, a header line), in SI units, numbers as they read back the
/// same: one row per cell with the middle of the cell, per point of a line, or per bar. Panels
/// follow each other after an empty line.
std::string csv_of(const Figure& figure);

}  // namespace oblique::client::plot
