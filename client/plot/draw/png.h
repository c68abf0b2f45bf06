#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/plot/draw/colour.h"

namespace oblique::client::plot {

/// A picture of cells with at most 256 colours, from the upper left, row by row.
struct IndexedImage {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<Colour> colours = {};
  std::optional<std::uint8_t> clear = {};  ///< the colour that lets through what is below
  std::vector<std::uint8_t> pixels = {};   ///< numbers of colours, width * height of them
};

/// The picture as a PNG file. Its pixels are the same everywhere, its bytes where zlib compresses
/// alike. Throws std::invalid_argument for a picture that has other numbers of pixels or colours.
std::string png_of(const IndexedImage& image);

/// Bytes as letters (RFC 4648), for a link that holds a file.
std::string base64(std::string_view bytes);

}  // namespace oblique::client::plot
