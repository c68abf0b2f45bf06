#pragma once

#include <span>
#include <string>

#include "client/plot/draw/palette.h"

namespace oblique::client::plot {

// Sizes of letters.
inline constexpr double kTitleSize = 15.0;
inline constexpr double kTextSize = 12.0;
inline constexpr double kSmallSize = 11.0;

/// Colours of what is no data, on paper and on dark screens.
struct Inks {
  Colour paper;
  Colour ink;    ///< of text
  Colour muted;  ///< of what matters less, and of the frame
  Colour faint;  ///< of lines across
  Colour alarm;  ///< of what failed
};
inline constexpr Inks kLightInks{colour_of(0xffffff), colour_of(0x1b1f24), colour_of(0x57606a),
                                 colour_of(0xdfe3e8), colour_of(0xb3261e)};
inline constexpr Inks kDarkInks{colour_of(0x14171c), colour_of(0xe8eaed), colour_of(0xa9b2bc),
                                colour_of(0x31373f), colour_of(0xff8a80)};

/// Shades of spans of an axis, as of phases and of stick.
inline constexpr std::size_t kSpanKinds = 4;

/// The rules of all classes that pictures use, light, and dark on screens of those who want that.
/// Classes: paper, title, text, small, muted, faint, frame, tick, grid, letter, plate (of colours
/// on light and dark alike), boundary, missing, failed, s0 to s7 and m0 to m7 for lines and marks,
/// p0 to p3 for spans, bar.
std::string style_sheet();

/// Patterns for hatchings: their id is that of `hatch_id`, and "missing" and "failed". Only those
/// that are named; "filtered" only where it `is_filtered`.
std::string pattern_definitions(std::span<const Hatch> hatches, bool is_filtered);

/// "h1" for Hatch 1 and so on.
std::string hatch_id(Hatch hatch);

}  // namespace oblique::client::plot
