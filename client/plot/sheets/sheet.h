#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "client/plot/figures/figure.h"
#include "client/plot/figures/layout.h"

namespace oblique::client::plot {

/// Shadings that all pictures of contacts share: kinds of Span.
inline constexpr std::size_t kCompressionSpan = 0;
inline constexpr std::size_t kRestitutionSpan = 1;
inline constexpr std::size_t kStickSpan = 2;  ///< hatched, over one of the others

/// Figures beside and below each other. Each has its own legend; titles of their panels name them.
struct Sheet {
  std::string title;
  std::string subtitle = {};
  std::vector<Figure> parts = {};  ///< row by row
  std::size_t columns = 2;         ///< at most; fewer where the sheet is narrow
  Size part{520.0, 340.0};         ///< of one figure, where no size of the sheet is asked for
  std::vector<std::string> notes = {};
};

/// The size that its parts make together.
Size usual_size(const Sheet& sheet);

/// The sheet as an SVG document. What has no room in that height makes it higher.
std::string svg_of(const Sheet& sheet, const Size& size);

/// All panels in one figure, below each other: for tables, scripts and terminals.
Figure flattened(const Sheet& sheet);

}  // namespace oblique::client::plot
