// Pictures of cells: what a reader of PNG sees.
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/draw/png.h"
#include "tests/client/plot/draw/png_reader.h"

namespace oblique::client::plot {
namespace {

TEST(Png, HasThePixelsThatItWasMadeOf) {
  IndexedImage image{37, 23, {}, 5, {}};
  for (unsigned i = 0; i < 200; ++i) {
    image.colours.push_back(colour_of(i * 0x010203U));
  }
  for (std::size_t i = 0; i < image.width * image.height; ++i) {
    // Runs, slopes and noise, so that every filter is met.
    image.pixels.push_back(static_cast<std::uint8_t>(i < 200   ? i % 200
                                                     : i < 500 ? (i / 37) % 200
                                                               : (i * i * 31) % 200));
  }
  const auto pixels = test::pixels_of(png_of(image));
  ASSERT_EQ(pixels.width, image.width);
  ASSERT_EQ(pixels.height, image.height);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const std::uint32_t number = image.pixels[i];
    const std::uint32_t wanted = number * 0x010203U << 8U | (number == 5 ? 0U : 0xffU);
    ASSERT_EQ(pixels.colours[i], wanted) << i;
  }
}

TEST(Png, OfAWrongSizeIsRefused) {
  EXPECT_THROW(png_of({2, 2, {Colour{}}, {}, {0, 0, 0}}), std::invalid_argument);
  EXPECT_THROW(png_of({0, 0, {Colour{}}, {}, {}}), std::invalid_argument);
  EXPECT_THROW(png_of({1, 1, {}, {}, {0}}), std::invalid_argument);
}

TEST(Base64, IsThatOfTheStandard) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

}  // namespace
}  // namespace oblique::client::plot
