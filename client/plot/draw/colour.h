#pragma once

#include <cstdint>
#include <string>

namespace oblique::client::plot {

/// A colour of sRGB, eight bits a channel.
struct Colour {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;

  bool operator==(const Colour&) const = default;
};

/// Of 0xRRGGBB.
constexpr Colour colour_of(std::uint32_t rgb) {
  return {static_cast<std::uint8_t>(rgb >> 16U & 0xffU),
          static_cast<std::uint8_t>(rgb >> 8U & 0xffU), static_cast<std::uint8_t>(rgb & 0xffU)};
}

/// "#rrggbb".
std::string hexadecimal(const Colour& colour);

/// From 0, black, to 1, white: the relative luminance of WCAG 2.
double luminance(const Colour& colour);

/// Of two colours beside each other, from 1 to 21, as WCAG 2 has it: text wants 4.5, lines want 3.
double contrast(const Colour& one, const Colour& other);

}  // namespace oblique::client::plot
