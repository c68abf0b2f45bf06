#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <zlib.h>

namespace oblique::client::plot::test {

/// The pixels of a PNG as png_of writes it, 0xRRGGBBAA each.
struct Pixels {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<std::uint32_t> colours = {};
};

inline std::uint32_t big_endian(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value = value << 8U | static_cast<unsigned char>(bytes.at(at + i));
  }
  return value;
}

/// Reads chunks, checks their sums, undoes compression and filters.
inline Pixels pixels_of(const std::string& png) {
  if (!png.starts_with("\x89PNG\r\n\x1a\n")) {
    throw std::runtime_error("no PNG");
  }
  Pixels pixels;
  std::string palette;
  std::string opacity;
  std::string packed;
  for (std::size_t at = 8; at < png.size();) {
    const std::size_t size = big_endian(png, at);
    const std::string type = png.substr(at + 4, 4);
    const std::string data = png.substr(at + 8, size);
    const std::string summed = type + data;
    if (crc32(0, reinterpret_cast<const Bytef*>(summed.data()), static_cast<uInt>(summed.size())) !=
        big_endian(png, at + 8 + size)) {
      throw std::runtime_error("a chunk with a wrong sum");
    }
    if (type == "IHDR") {
      pixels.width = big_endian(data, 0);
      pixels.height = big_endian(data, 4);
    }
    (type == "PLTE"   ? palette
     : type == "tRNS" ? opacity
                      : packed) +=
        type == "IDAT" || type == "PLTE" || type == "tRNS" ? data : std::string();
    at += 12 + size;
  }
  std::string rows((pixels.width + 1) * pixels.height, '\0');
  uLongf size = rows.size();
  if (uncompress(reinterpret_cast<Bytef*>(rows.data()), &size,
                 reinterpret_cast<const Bytef*>(packed.data()), packed.size()) != Z_OK ||
      size != rows.size()) {
    throw std::runtime_error("no sound rows");
  }
  std::vector<std::uint8_t> above(pixels.width, 0);
  for (std::size_t y = 0; y < pixels.height; ++y) {
    const char filter = rows[y * (pixels.width + 1)];
    std::vector<std::uint8_t> row(pixels.width);
    for (std::size_t x = 0; x < pixels.width; ++x) {
      const auto byte = static_cast<unsigned char>(rows[y * (pixels.width + 1) + 1 + x]);
      const int before = filter == 1 ? (x > 0 ? row[x - 1] : 0) : filter == 2 ? above[x] : 0;
      row[x] = static_cast<std::uint8_t>(byte + before);
      const auto channel = [&](std::size_t k) {
        return static_cast<std::uint32_t>(
            static_cast<unsigned char>(palette.at(std::size_t{3} * row[x] + k)));
      };
      const std::uint32_t alpha =
          row[x] < opacity.size() ? static_cast<unsigned char>(opacity[row[x]]) : 0xffU;
      pixels.colours.push_back(channel(0) << 24U | channel(1) << 16U | channel(2) << 8U | alpha);
    }
    above = row;
  }
  return pixels;
}

inline std::string from_base64(const std::string& text) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char letter : text) {
    const auto value = letters.find(letter);
    if (value == std::string::npos) {
      break;
    }
    bits = bits << 6U | static_cast<std::uint32_t>(value);
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes += static_cast<char>(bits >> static_cast<unsigned>(count) & 0xffU);
    }
  }
  return bytes;
}

/// The first picture that an SVG holds.
inline Pixels pixels_in(const std::string& svg) {
  const std::string mark = "data:image/png;base64,";
  const auto begin = svg.find(mark);
  if (begin == std::string::npos) {
    throw std::runtime_error("no picture");
  }
  const auto from = begin + mark.size();
  return pixels_of(from_base64(svg.substr(from, svg.find('"', from) - from)));
}

}  // namespace oblique::client::plot::test
