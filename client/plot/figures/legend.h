#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "client/plot/draw/svg.h"
#include "client/plot/figures/figure.h"

namespace oblique::client::plot {

/// A sign and what it means.
struct LegendEntry {
  enum class Sign { kCurve, kSpan, kKnown, kKind, kRest, kNoResult, kFiltered, kFailed };
  Sign sign;
  std::size_t number = 0;  ///< of the stroke, shading or kind
  bool has_line = true;    ///< of a curve
  bool has_marks = false;
  bool is_hatched = true;  ///< of a kind
  std::string name;
};

/// Everything of a figure that needs a name, in the order of its panels.
std::vector<LegendEntry> legend_of(const Figure& figure);

/// What a kind is called in its area and in the legend: A, B, ..., Z, AA.
std::string letter_of(std::size_t kind);

/// Entries laid out: beside the panels one below the other, or below them in columns.
struct LegendLayout {
  double width = 0.0;
  double height = 0.0;
  struct Place {
    double x;
    double y;
    std::vector<std::string> lines;
  };
  std::vector<Place> places = {};  ///< of each entry, from the legend's upper left corner
};
LegendLayout laid_out_beside(const std::vector<LegendEntry>& entries, double most_width);
LegendLayout laid_out_below(const std::vector<LegendEntry>& entries, double width);

/// Draws them with the upper left corner at x, y.
void draw_legend(SvgWriter& svg, const std::vector<LegendEntry>& entries,
                 const LegendLayout& layout, double x, double y);

/// The shape of a mark around a place, for paths.
std::string mark_path(Mark mark, double x, double y, double radius);

}  // namespace oblique::client::plot
