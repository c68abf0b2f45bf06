#include "proto/recipe/blocks.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

TEST(AxisTest, ARangeHasBothEndsExactlyAndRisesBetweenThem) {
  const Axis axis = range("mu", 0.1, 0.1 + 1e-12, 1000);
  EXPECT_EQ(axis_value(axis, 0), axis.from());
  EXPECT_EQ(axis_value(axis, 999), axis.to());
  for (std::uint64_t i = 1; i < 1000; ++i) {
    EXPECT_GE(axis_value(axis, i), axis_value(axis, i - 1)) << "value " << i;
  }
}

// Of 1,000 grids from 0 to 5 with steps of up to 50 units of their last decimal, and from 1e7 on.
TEST(AxisTest, EveryValueOfADecimalGridIsTheNumberThatPeopleType) {
  std::mt19937 random(1);
  const auto pick = [&](int from, int to) {
    return std::uniform_int_distribution<std::int64_t>(from, to)(random);
  };
  std::size_t values = 0;
  for (int grid = 0; grid < 1000; ++grid) {
    const auto decimals = static_cast<int>(pick(grid % 5 == 0 ? -7 : 1, 6));
    const std::int64_t first = pick(0, 5000);
    const std::int64_t step = pick(1, 50);
    const std::int64_t last = pick(1, 200);
    const auto number = [&](std::int64_t i) {
      const std::string text = std::to_string(first + step * i) + "e" + std::to_string(-decimals);
      return std::strtod(text.c_str(), nullptr);
    };
    const Axis axis = range("mu", number(0), number(last), static_cast<std::uint64_t>(last) + 1);
    for (std::int64_t i = 0; i <= last; ++i, ++values) {
      EXPECT_EQ(axis_value(axis, static_cast<std::uint64_t>(i)), number(i))
          << axis.from() << ":" << axis.to() << ":" << axis.count() << ", value " << i;
    }
  }
  EXPECT_GT(values, 50'000U);
}

TEST(AxisTest, StepsMayHaveMoreDecimalsThanTheEnds) {
  EXPECT_EQ(axis_value(range("mu", 0.0, 1.0, 5), 3), 0.75);
  EXPECT_EQ(axis_value(range("mu", 0.1, 1.0, 19), 4), 0.3);
  EXPECT_EQ(axis_value(range("mu", 0.1, 1.0, 19), 5), 0.35);
}

TEST(AxisTest, AStepThatIsNoDecimalIsRoundedOnce) {
  EXPECT_EQ(axis_value(range("mu", 0.0, 1.0, 4), 1), 1.0 / 3.0);
  EXPECT_EQ(axis_value(range("mu", 0.0, 1.0 / 3.0, 3), 1), 1.0 / 6.0);
}

TEST(AxisTest, ALogarithmicRangeHasItsEndsAndTheNumbersThatPeopleType) {
  const Axis decades = log_range("mu", 0.01, 100.0, 5);
  const Axis octaves = log_range("links", 1.0, 64.0, 7);
  for (std::uint64_t i = 0; i < 5; ++i) {
    EXPECT_EQ(axis_value(decades, i), std::vector({0.01, 0.1, 1.0, 10.0, 100.0})[i]);
  }
  for (std::uint64_t i = 0; i < 7; ++i) {
    EXPECT_EQ(axis_value(octaves, i), std::ldexp(1.0, static_cast<int>(i)));
  }
  const Axis many = log_range("mu", 0.3, 1.7, 1'000'000'000'000);
  EXPECT_NEAR(axis_value(many, many.count() / 2), std::sqrt(0.3 * 1.7), 1e-11);
  EXPECT_EQ(axis_value(many, many.count() - 1), 1.7);
  EXPECT_EQ(first_value_from(many, axis_value(many, 12345)), 12345U);
}

TEST(AxisTest, ARangeOfHugeNumbersDoesNotOverflow) {
  const Axis axis = range("E", 1e300, 1e308, 1'000'000'001);
  EXPECT_DOUBLE_EQ(axis_value(axis, 500'000'000), 0.5 * (1e300 + 1e308));
}

TEST(AxisTest, AValueThatTheAxisDoesNotHaveIsOutOfRange) {
  EXPECT_THROW(axis_value(listed("mu", {0.4}), 1), std::out_of_range);
  EXPECT_THROW(axis_value(range("mu", 0, 1, 3), 3), std::out_of_range);
}

}  // namespace
}  // namespace oblique::protocol
