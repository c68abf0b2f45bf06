// Colours: told apart by all, read on paper and on dark screens.
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/draw/palette.h"
#include "client/plot/draw/theme.h"
#include "client/plot/figures/maps.h"

namespace oblique::client::plot {
namespace {

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;

// How eyes without one of the three cones see linear sRGB: G. M. Machado, M. M. Oliveira and
// L. A. F. Fernandes, "A physiologically-based model for simulation of color vision deficiency"
// (2009), severity 1.
constexpr Matrix kAllCones{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
constexpr Matrix kProtanopia{{{0.152286, 1.052583, -0.204868},
                              {0.114503, 0.786281, 0.099216},
                              {-0.003882, -0.048116, 1.051998}}};
constexpr Matrix kDeuteranopia{{{0.367322, 0.860646, -0.227968},
                                {0.280085, 0.672501, 0.047413},
                                {-0.011820, 0.042940, 0.968881}}};
constexpr Matrix kTritanopia{{{1.255528, -0.076749, -0.178779},
                              {-0.078411, 0.930809, 0.147602},
                              {0.004733, 0.691367, 0.303900}}};

Vector times(const Matrix& matrix, const Vector& vector) {
  Vector product{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      product[i] += matrix[i][k] * vector[k];
    }
  }
  return product;
}

/// CIE L*a*b* of a colour as such eyes see it.
Vector lab_of(const Colour& colour, const Matrix& eyes) {
  const auto linear = [](double channel) {
    const double v = channel / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  Vector rgb = times(eyes, {linear(colour.red), linear(colour.green), linear(colour.blue)});
  for (double& channel : rgb) {
    channel = std::min(std::max(channel, 0.0), 1.0);
  }
  constexpr Matrix kXyz{
      {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};
  Vector xyz = times(kXyz, rgb);
  const Vector white{0.9505, 1.0, 1.089};
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116.0; };
  for (std::size_t i = 0; i < 3; ++i) {
    xyz[i] = f(xyz[i] / white[i]);
  }
  return {116.0 * xyz[1] - 16.0, 500.0 * (xyz[0] - xyz[1]), 200.0 * (xyz[1] - xyz[2])};
}

double difference(const Colour& a, const Colour& b, const Matrix& eyes) {
  const Vector x = lab_of(a, eyes);
  const Vector y = lab_of(b, eyes);
  return std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
}

TEST(Shades, GetLighterAllTheWaySoThatTheyReadInGreyAndWithoutTellingRedFromGreen) {
  for (const Matrix& eyes : {kAllCones, kProtanopia, kDeuteranopia}) {
    double last = -1.0;
    for (std::size_t i = 0; i < kShades; i += 5) {
      const double lightness = lab_of(shade(i), eyes)[0];
      EXPECT_GT(lightness, last - 0.2) << i;
      last = lightness;
    }
    EXPECT_GT(last, 75.0);
  }
}

TEST(Shades, OfWhatIsOutsideAreThoseOfTheEnds) {
  EXPECT_EQ(shade_number(-1.0), 0U);
  EXPECT_EQ(shade_number(std::nan("")), 0U);
  EXPECT_EQ(shade_number(1.0), kShades - 1);
  EXPECT_EQ(shade_number(1e9), kShades - 1);
}

TEST(Fills, DifferInHatchingOrToAllEyesInColour) {
  for (const Matrix& eyes : {kAllCones, kProtanopia, kDeuteranopia, kTritanopia}) {
    for (std::size_t i = 0; i < kFills; ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        const bool is_told_apart = fill(i).hatch != fill(k).hatch ||
                                   difference(fill(i).colour, fill(k).colour, eyes) > 12.0;
        EXPECT_TRUE(is_told_apart) << i << " and " << k;
      }
    }
  }
}

TEST(Fills, WithoutHatchingHaveAColourEach) {
  constexpr std::size_t kKindsOfAMap = 12;
  for (std::size_t i = 0; i < kKindsOfAMap; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_GT(difference(plain_fill(i), plain_fill(k), kAllCones), 10.0) << i << " and " << k;
    }
  }
}

TEST(Fills, AreThoseOfThePage) {
  std::ifstream file(OBLIQUE_SOURCE_DIR "/client/web/parts/colours.js");
  const std::string page{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const auto as_there = [](const Fill& look) {
    return "[\"" + hexadecimal(look.colour).substr(1) + "\", " +
           std::to_string(static_cast<int>(look.hatch)) + "]";
  };
  std::size_t at = page.find("const kKinds");
  for (std::size_t i = 0; i < kFills; ++i) {
    const std::size_t found = page.find("[\"", at);
    ASSERT_NE(found, std::string::npos);
    EXPECT_EQ(page.substr(found, as_there(fill(i)).size()), as_there(fill(i))) << i;
    at = found + 1;
  }
  EXPECT_THAT(page, testing::HasSubstr("(" + as_there(kFillOfOthers) + ")"));
  EXPECT_THAT(page, testing::HasSubstr("kMostKinds = " + std::to_string(kMostKinds) + ";"));
}

TEST(Strokes, DifferInDashesAndAreReadOnPaperAndOnDarkScreens) {
  std::set<std::string> dashes;
  for (std::size_t i = 0; i < kStrokes; ++i) {
    dashes.insert(std::string(stroke(i).dashes));
    EXPECT_GE(contrast(stroke(i).on_light, kLightInks.paper), 3.0) << i;
    EXPECT_GE(contrast(stroke(i).on_dark, kDarkInks.paper), 3.0) << i;
  }
  EXPECT_EQ(dashes.size(), kStrokes);
}

TEST(Shades, OfLinesAndPointsAreToldFromTheirPlate) {
  for (int i = 0; i <= 20; ++i) {
    const Colour colour = shade(shade_number(kDarkShare * i / 20.0));
    EXPECT_GE(contrast(colour, kLightInks.paper), 2.4) << i;
  }
}

TEST(Texts, HaveTheContrastThatReadersNeed) {
  for (const Inks& inks : {kLightInks, kDarkInks}) {
    EXPECT_GE(contrast(inks.ink, inks.paper), 4.5);
    EXPECT_GE(contrast(inks.muted, inks.paper), 4.5);
    EXPECT_GE(contrast(inks.alarm, inks.paper), 4.5);
  }
  EXPECT_NEAR(contrast(colour_of(0xffffff), colour_of(0x000000)), 21.0, 1e-9);
}

}  // namespace
}  // namespace oblique::client::plot
