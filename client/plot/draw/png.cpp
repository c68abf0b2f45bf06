#include "client/plot/draw/png.h"

#include <array>
#include <cstdlib>
#include <stdexcept>

#include <zlib.h>

namespace oblique::client::plot {
namespace {

void append_big_endian(std::string& out, std::uint32_t value) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    out += static_cast<char>(value >> shift & 0xffU);
  }
}

const Bytef* bytes_of(std::string_view text) {
  return reinterpret_cast<const Bytef*>(text.data());
}

void append_chunk(std::string& out, std::string_view type, std::string_view data) {
  append_big_endian(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = out.size();
  out += type;
  out += data;
  const std::string_view summed = std::string_view(out).substr(begin);
  const auto sum = crc32(0, bytes_of(summed), static_cast<uInt>(summed.size()));
  append_big_endian(out, static_cast<std::uint32_t>(sum));
}

// Filters of PNG: a byte as it is, or less that on its left or that above.
enum Filter : std::uint8_t { kAsIs = 0, kLessLeft = 1, kLessUp = 2 };

/// The row behind the number of the filter that makes its bytes smallest, by the sum of their
/// magnitudes: the rule that PNG's specification recommends.
void append_filtered_row(std::string& out, const std::uint8_t* row, const std::uint8_t* above,
                         std::size_t width) {
  std::array<long, 3> sums{};
  std::array<std::string, 3> rows;
  for (const Filter filter : {kAsIs, kLessLeft, kLessUp}) {
    rows[filter].reserve(width + 1);
    rows[filter] += static_cast<char>(filter);
    for (std::size_t x = 0; x < width; ++x) {
      const int before = filter == kLessLeft ? (x > 0 ? row[x - 1] : 0)
                         : filter == kLessUp ? (above != nullptr ? above[x] : 0)
                                             : 0;
      const auto byte = static_cast<std::uint8_t>(row[x] - before);
      sums[filter] += std::abs(static_cast<int>(static_cast<std::int8_t>(byte)));
      rows[filter] += static_cast<char>(byte);
    }
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < sums.size(); ++i) {
    best = sums[i] < sums[best] ? i : best;
  }
  out += rows[best];
}

std::string compressed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  // The best compression takes ten times as long for noise, and saves nothing there.
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, bytes_of(bytes), bytes.size(),
                Z_DEFAULT_COMPRESSION) != Z_OK) {
    throw std::runtime_error("zlib could not compress a picture");
  }
  out.resize(size);
  return out;
}

std::string header_of(const IndexedImage& image) {
  std::string header;
  append_big_endian(header, static_cast<std::uint32_t>(image.width));
  append_big_endian(header, static_cast<std::uint32_t>(image.height));
  constexpr std::string_view kEightBitsIndexed("\x08\x03\x00\x00\x00", 5);
  return header.append(kEightBitsIndexed);
}

}  // namespace

std::string png_of(const IndexedImage& image) {
  constexpr std::size_t kMostColours = 256;
  if (image.width == 0 || image.pixels.size() != image.width * image.height ||
      image.colours.empty() || image.colours.size() > kMostColours) {
    throw std::invalid_argument("a picture of no such size, or with too many colours");
  }
  std::string colours;
  for (const Colour& colour : image.colours) {
    colours += {static_cast<char>(colour.red), static_cast<char>(colour.green),
                static_cast<char>(colour.blue)};
  }
  std::string rows;
  for (std::size_t y = 0; y < image.height; ++y) {
    const std::uint8_t* row = &image.pixels[y * image.width];
    append_filtered_row(rows, row, y > 0 ? row - image.width : nullptr, image.width);
  }
  std::string file("\x89PNG\r\n\x1a\n");
  append_chunk(file, "IHDR", header_of(image));
  append_chunk(file, "PLTE", colours);
  if (image.clear) {
    std::string opacity(*image.clear, '\xff');
    append_chunk(file, "tRNS", opacity + '\0');
  }
  append_chunk(file, "IDAT", compressed(rows));
  append_chunk(file, "IEND", {});
  return file;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) -> std::uint32_t {
      return i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U;
    };
    const std::uint32_t three = byte(0) << 16U | byte(1) << 8U | byte(2);
    for (std::size_t k = 0; k < 4; ++k) {
      const bool is_padding = i + k > bytes.size();
      text += is_padding ? '=' : kLetters[three >> (18U - 6U * static_cast<unsigned>(k)) & 0x3fU];
    }
  }
  return text;
}

}  // namespace oblique::client::plot
