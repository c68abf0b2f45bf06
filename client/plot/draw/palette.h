#pragma once

#include <cstddef>
#include <string_view>

#include "client/plot/draw/colour.h"

namespace oblique::client::plot {

/// Number of colours of a map.
inline constexpr std::size_t kShades = 256;
/// A colour of a map, of viridis. Its lightness rises with the number, so that maps read in grey
/// and without telling red from green.
Colour shade(std::size_t number);

/// The shade of a share from 0 to 1; others take that of the nearer end.
std::size_t shade_number(double share);

/// The shades up to this share of all can be told from white paper, as lines and points must.
inline constexpr double kDarkShare = 0.68;

/// A hatching, drawn over a colour, in the ink of text.
enum class Hatch { kNone, kRising, kFalling, kCrossed, kDots, kLevel, kUpright, kGrid };
inline constexpr std::size_t kHatches = 8;

/// How an area of one of several kinds is filled. Kinds with the same colour differ in hatching.
struct Fill {
  Colour colour;
  Hatch hatch;
};

/// The fills of kinds, from the one that is met most. So many differ; more begin again.
inline constexpr std::size_t kFills = 16;
Fill fill(std::size_t kind);
/// The colours of the same kinds where there is no hatching: none for two of them.
Colour plain_fill(std::size_t kind);
/// Of what belongs to no kind of its own.
inline constexpr Fill kFillOfOthers{colour_of(0xdddddd), Hatch::kDots};

/// How a line is drawn. Its colour on white and on black, its dashes as SVG has them, and the shape
/// of its marks.
enum class Mark { kDisc, kSquare, kTriangle, kDiamond, kCross, kPlus };
struct Stroke {
  Colour on_light;
  Colour on_dark;
  std::string_view dashes;  ///< empty: none
  Mark mark;
};
inline constexpr std::size_t kStrokes = 8;
Stroke stroke(std::size_t number);

}  // namespace oblique::client::plot
