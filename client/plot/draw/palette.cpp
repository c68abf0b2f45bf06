#include "client/plot/draw/palette.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "client/plot/draw/viridis.h"

namespace oblique::client::plot {
namespace {

// Light enough for hatching and letters in black; after the scheme "light" of P. Tol, and a brown
// for its grey, which is that of the others.
constexpr std::array<std::uint32_t, 8> kFillColours{0x77aadd, 0xeedd88, 0xee8866, 0x99ddff,
                                                    0xbbcc33, 0xffaabb, 0x44bb99, 0xb59a80};

constexpr std::array<Stroke, kStrokes> kStrokeTable{{
    {colour_of(0x0067a5), colour_of(0x56b4e9), "", Mark::kDisc},
    {colour_of(0xc44e00), colour_of(0xff9e57), "7 3", Mark::kSquare},
    {colour_of(0x007f5c), colour_of(0x3ddbb0), "2 2.5", Mark::kTriangle},
    {colour_of(0xaa3377), colour_of(0xf19cd0), "9 3 2 3", Mark::kDiamond},
    {colour_of(0x7a6200), colour_of(0xf0e442), "14 4", Mark::kCross},
    {colour_of(0x332288), colour_of(0xa99cf5), "4 2 1.5 2 1.5 2", Mark::kPlus},
    {colour_of(0x666666), colour_of(0xbbbbbb), "1.5 4", Mark::kDisc},
    {colour_of(0x111111), colour_of(0xffffff), "12 3 3 3", Mark::kSquare},
}};

}  // namespace

Colour shade(std::size_t number) {
  return colour_of(kViridis[number]);
}

std::size_t shade_number(double share) {
  if (!(share > 0.0)) {
    return 0;
  }
  const double last = static_cast<double>(kShades - 1);
  return static_cast<std::size_t>(std::min(last, std::floor(share * last + 0.5)));
}

Fill fill(std::size_t kind) {
  // Kinds with the same hatching have colours that all eyes tell apart (palette_test); the first,
  // which has most of the area, has none.
  const std::size_t number = kind % kFills;
  const std::size_t round = number / kFillColours.size();
  const std::size_t hatch = (number + round * 4) % kHatches;
  return {colour_of(kFillColours[number % kFillColours.size()]), static_cast<Hatch>(hatch)};
}

Colour plain_fill(std::size_t kind) {
  const Colour colour = fill(kind).colour;
  const auto darker = [](std::uint8_t channel) {
    return static_cast<std::uint8_t>(channel * 3 / 5);
  };
  return kind % kFills < kFillColours.size()
             ? colour
             : Colour{darker(colour.red), darker(colour.green), darker(colour.blue)};
}

Stroke stroke(std::size_t number) {
  return kStrokeTable[number % kStrokeTable.size()];
}

}  // namespace oblique::client::plot
