// Axes: where values are, and which are marked.
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/draw/scale.h"

namespace oblique::client::plot {
namespace {

using testing::ElementsAre;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<std::string> labels(const Ticks& ticks) {
  std::vector<std::string> texts;
  for (const Tick& tick : ticks.ticks) {
    if (!tick.label.empty()) {
      texts.push_back(tick.label);
    }
  }
  return texts;
}

TEST(Ticks, AreRoundValuesWithinTheRange) {
  EXPECT_THAT(labels(ticks_of(Scale(0.0, 1.0), 5)),
              ElementsAre("0.0", "0.2", "0.4", "0.6", "0.8", "1.0"));
  EXPECT_THAT(labels(ticks_of(Scale(0.02, 2.0), 4)), ElementsAre("0.5", "1.0", "1.5", "2.0"));
  EXPECT_THAT(labels(ticks_of(Scale(-3.0, 4.0), 4)), ElementsAre("-2", "0", "2", "4"));
}

TEST(Ticks, OfLongNumbersLeaveAPowerOfTenToTheAxis) {
  const Ticks large = ticks_of(Scale(0.0, 5e6), 5);
  EXPECT_THAT(labels(large), ElementsAre("0", "1", "2", "3", "4", "5"));
  EXPECT_EQ(large.factor(), " \u00d7 10\u2076");
  const Ticks small = ticks_of(Scale(0.0, 4e-4), 4);
  EXPECT_THAT(labels(small), ElementsAre("0", "100", "200", "300", "400"));
  EXPECT_EQ(small.factor(), " \u00d7 10\u207b\u2076");
  EXPECT_EQ(ticks_of(Scale(0.0, 1.0), 5).factor(), "");
}

TEST(Ticks, OfALogarithmicScaleArePowersOfTenWithOthersWhereThoseAreFew) {
  EXPECT_THAT(labels(ticks_of(Scale(1e-3, 1e3, true), 6)),
              ElementsAre("0.001", "0.01", "0.1", "1", "10", "100", "1000"));
  EXPECT_THAT(labels(ticks_of(Scale(0.01, 1.0, true), 6)),
              ElementsAre("0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"));
  EXPECT_THAT(labels(ticks_of(Scale(1e-30, 1.0, true), 5)),
              ElementsAre("1e-30", "1e-24", "1e-18", "1e-12", "1e-06", "1"));
  // Less than a decade without a power of ten in it.
  EXPECT_GE(labels(ticks_of(Scale(0.31, 0.37, true), 5)).size(), 3U);
}

TEST(Ticks, OfLessThanADecadeAreAsManyAsThereIsRoomFor) {
  EXPECT_THAT(labels(ticks_of(Scale(1.0, 2.0, true), 5)),
              ElementsAre("1.0", "1.2", "1.4", "1.6", "1.8", "2.0"));
  EXPECT_THAT(labels(ticks_of(Scale(0.3, 1.2, true), 5)), ElementsAre("0.3", "0.5", "1"));
  EXPECT_THAT(labels(ticks_of(Scale(0.3, 1.2, true), 8)),
              ElementsAre("0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "1"));
  EXPECT_THAT(labels(ticks_of(Scale(2.0, 9.0, true), 4)), ElementsAre("2", "3", "5"));
  EXPECT_THAT(labels(ticks_of(Scale(1.0, 1.01, true), 3)), ElementsAre("1.000", "1.005", "1.010"));
}

TEST(Ticks, OfALogarithmicScaleAreTwoAtLeastAndNotMoreThanAreSeenApart) {
  for (const double from : {1e-12, 0.02, 0.3, 1.0, 7.0, 95.0, 2e6}) {
    for (const double ratio : {1.001, 1.01, 1.3, 2.0, 4.0, 9.0, 11.0, 70.0, 1e4, 1e12, 1e40}) {
      for (const int wanted : {2, 3, 5, 10}) {
        const auto all = labels(ticks_of(Scale(from, from * ratio, true), wanted));
        EXPECT_GE(all.size(), 2U) << from << ' ' << ratio << ' ' << wanted;
        EXPECT_LE(all.size(), static_cast<std::size_t>(2 * wanted + 1)) << from << ' ' << ratio;
      }
    }
  }
}

TEST(Ticks, AreAtLeastTwoOnWhateverScale) {
  for (const double from : {-1e300, -1.0, 0.0, 1e-300, 0.1, 1.0, 123456.789, 1e15}) {
    for (const double length : {1e-5, 1.0, 7.3, 1e6, 1e200}) {
      const Scale scale(from, from + length);
      for (const int wanted : {2, 5, 10}) {
        const Ticks ticks = ticks_of(scale, wanted);
        EXPECT_GE(ticks.ticks.size(), 1U) << from << ' ' << length << ' ' << wanted;
        EXPECT_LE(ticks.ticks.size(), 3U * static_cast<unsigned>(wanted)) << from << ' ' << length;
        for (const Tick& tick : ticks.ticks) {
          EXPECT_TRUE(tick.share > -1e-3 && tick.share < 1.001) << from << ' ' << length;
        }
      }
    }
  }
}

TEST(Scale, OfOneValueHasRoomAroundIt) {
  for (const double value : {0.0, 3.0, -0.5, 1e-12}) {
    EXPECT_NEAR(Scale(value, value).share_of(value), 0.5, 1e-9) << value;
  }
  EXPECT_NEAR(Scale(2.0, 2.0, true).share_of(2.0), 0.5, 1e-9);
}

TEST(Scale, HasNoPlaceForWhatIsNoNumber) {
  EXPECT_TRUE(std::isnan(Scale(0.0, 1.0).share_of(kInfinity)));
  EXPECT_TRUE(std::isnan(Scale(0.0, 1.0).share_of(std::nan(""))));
  EXPECT_TRUE(std::isnan(Scale(0.1, 1.0, true).share_of(0.0)));
  EXPECT_TRUE(std::isnan(Scale(0.1, 1.0, true).share_of(-1.0)));
  EXPECT_THROW(Scale(0.0, 1.0, true), std::invalid_argument);
  EXPECT_LT(Scale(std::nan(""), kInfinity).from(), Scale(std::nan(""), kInfinity).to());
}

TEST(Scale, GivesBackTheValueOfAShare) {
  for (const bool is_logarithmic : {false, true}) {
    const Scale scale(0.02, 2.0, is_logarithmic);
    for (const double value : {0.02, 0.1, 1.0, 2.0}) {
      EXPECT_NEAR(scale.value_at(scale.share_of(value)), value, 1e-12);
    }
  }
}

TEST(Range, IsThatOfNumbersAlone) {
  EXPECT_EQ(range_of({std::nan(""), 2.0, kInfinity, -1.0}), (Range{-1.0, 2.0}));
  EXPECT_EQ(range_of({-1.0, 0.0, 2.0, 4.0}, true), (Range{2.0, 4.0}));
  EXPECT_EQ(range_of({}), (Range{0.0, 1.0}));
  EXPECT_EQ(widened({0.0, 10.0}, 0.1), (Range{0.0, 11.0})) << "does not cross 0";
}

}  // namespace
}  // namespace oblique::client::plot
