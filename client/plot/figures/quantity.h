#pragma once

#include <string>

#include "client/plot/figures/figure.h"

namespace oblique::client::plot {

/// What a column or a key is called on an axis.
struct Quantity {
  std::string name;       ///< of the column: "duration_s"
  std::string label;      ///< "contact duration [\u00b5s]"
  double per_unit = 1.0;  ///< so much of that unit is 1 in SI units
};

/// `unit` is that of SI; empty: none, or not known. Columns of short times, slides and the like are
/// labelled in the units that tables for people have.
Quantity quantity_of(const std::string& name, const std::string& unit);

/// An axis for values of that quantity.
FigureAxis axis_of(const Quantity& quantity, const Range& range, bool is_logarithmic);

/// "mu = 0.4", "H = 1 m": a value with its name, for titles and notes.
std::string shown_value(const Quantity& quantity, double value);

}  // namespace oblique::client::plot
