// The bytes of pictures. OBLIQUE_WRITE_GOLDEN=1 writes the files anew: look at them before they are
// committed. Cells of maps are compared by their pixels, which zlib does not change.
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/figures/svg_figure.h"
#include "tests/client/plot/draw/png_reader.h"
#include "tests/client/plot/figures_of_tests.h"

namespace oblique::client::plot {
namespace {

/// FNV-1a.
std::uint64_t hash_of(const test::Pixels& pixels) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const std::uint32_t colour : pixels.colours) {
    hash = (hash ^ colour) * 0x100000001b3U;
  }
  return hash;
}

/// The picture with its pixels' hash instead of the PNG file.
std::string without_png(std::string svg) {
  const std::string mark = "data:image/png;base64,";
  const auto begin = svg.find(mark);
  if (begin == std::string::npos) {
    return svg;
  }
  const auto pixels = test::pixels_in(svg);
  return svg.replace(begin, svg.find('"', begin) - begin,
                     "pixels " + std::to_string(pixels.width) + " " +
                         std::to_string(pixels.height) + " " + std::to_string(hash_of(pixels)));
}

void expect_golden(const std::string& name, const Figure& figure, const Size& size = {480, 320}) {
  const std::string path = OBLIQUE_SOURCE_DIR "/tests/client/plot/golden/" + name + ".svg";
  const std::string drawn = without_png(svg_of(figure, size));
  if (std::getenv("OBLIQUE_WRITE_GOLDEN") != nullptr) {
    std::ofstream(path, std::ios::binary) << drawn;
  }
  std::ifstream file(path, std::ios::binary);
  const std::string golden{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  EXPECT_TRUE(drawn == golden) << name << " is drawn otherwise than " << path;
}

TEST(Golden, HeatMap) {
  expect_golden("heat_map", test::gappy_map());
}
TEST(Golden, KindMap) {
  expect_golden("kind_map", test::striped_kinds(4));
}
TEST(Golden, Lines) {
  expect_golden("lines", test::lines_of_count(4, 8));
}
TEST(Golden, Scatter) {
  expect_golden("scatter", test::dots_of_count(40));
}
TEST(Golden, Histogram) {
  expect_golden("histogram", test::histogram_of_count(500));
}
TEST(Golden, Panels) {
  expect_golden("panels", test::panels(), {640, 760});
}
TEST(Golden, LargePicturesByTheirHash) {
  const std::string svg = without_png(svg_of(test::striped_kinds(40), {1200, 800})) +
                          without_png(svg_of(test::dots_of_count(20'000))) +
                          svg_of(test::lines_of_count(40, 200));
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char letter : svg) {
    hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001b3U;
  }
  EXPECT_EQ(hash, 12464211350434630082U) << "drawn otherwise";
}

}  // namespace
}  // namespace oblique::client::plot
