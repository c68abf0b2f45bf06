#include "server/store/known/axis_inverse.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/axes.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::range;
using testing::ElementsAre;
using testing::Pair;

const std::atomic<bool> kWanted = false;

TEST(AxisInverse, FindsEachValueOfARangeByItsBitsAndNoOther) {
  for (const auto& axis :
       {range("mu", 0.1, 2.0, 20), range("H", 1e-9, 1.1, 1'000'003), range("k", 1e7, 1e300, 999),
        range("mu", 0.0, 0.0, 1), range("mu", 0.0, 1.0, 2)}) {
    const AxisInverse inverse(axis);
    const std::uint64_t step = std::max<std::uint64_t>(1, axis.count() / 997);
    for (std::uint64_t i = 0; i < axis.count(); i += step) {
      const double value = protocol::axis_value(axis, i);
      EXPECT_EQ(inverse.find(value), i);
      EXPECT_EQ(inverse.find(std::nextafter(value, 2e300)), std::nullopt);
      EXPECT_EQ(inverse.find(std::nextafter(value, -1.0)), std::nullopt);
    }
  }
}

TEST(AxisInverse, FindsListedValuesInTheirPlaces) {
  const auto axis = listed("H", {1.0, 0.3, 0.7});
  const AxisInverse inverse(axis);
  EXPECT_EQ(inverse.find(0.3), 1U);
  EXPECT_EQ(inverse.find(0.4), std::nullopt);
  EXPECT_EQ(inverse.find(std::nan("")), std::nullopt);
}

TEST(AxisInverse, TheSignOfAZeroCounts) {
  const auto axis = listed("mu", {0.0, 1.0});
  EXPECT_EQ(AxisInverse(axis).find(-0.0), std::nullopt);
}

TEST(SharedValues, AreInTheOrderOfTheFirstAxisWhicheverIsShorter) {
  Work work(1'000'000, kWanted);
  const auto whole = range("mu", 0.0, 10.0, 11);
  const auto some = listed("mu", {7.0, 3.5, 2.0});
  EXPECT_THAT(shared_values(whole, some, work), ElementsAre(Pair(2, 2), Pair(7, 0)));
  EXPECT_THAT(shared_values(some, whole, work), ElementsAre(Pair(0, 7), Pair(2, 2)));
}

TEST(SharedValues, OfAnEndlessRangeCostWhatTheShorterOneHas) {
  Work work(1000, kWanted);
  const auto endless = range("mu", 0.0, 1e9, 1'000'000'001);
  EXPECT_EQ(shared_values(endless, range("mu", 0.0, 400.0, 401), work).size(), 401U);
  EXPECT_FALSE(work.is_over());
}

}  // namespace
}  // namespace oblique::server
