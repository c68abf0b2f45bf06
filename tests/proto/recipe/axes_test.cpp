#include "proto/recipe/axes.h"

#include <cstdlib>
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

TEST(AxisTest, DecimalStepsGiveTheNumbersThatPeopleType) {
  const Axis axis = range("mu", 0.1, 2.0, 20);
  for (std::uint64_t i = 0; i < 20; ++i) {
    const double typed = std::strtod(
        (std::to_string((i + 1) / 10) + "." + std::to_string((i + 1) % 10)).c_str(), nullptr);
    EXPECT_EQ(axis_value(axis, i), typed) << "value " << i;
  }
}

TEST(AxisTest, ARangeOfHugeNumbersDoesNotOverflow) {
  const Axis axis = range("E", 1e300, 1e308, 1'000'000'001);
  EXPECT_DOUBLE_EQ(axis_value(axis, 500'000'000), 0.5 * (1e300 + 1e308));
}

TEST(AxisTest, AValueThatTheAxisDoesNotHaveIsOutOfRange) {
  EXPECT_THROW(axis_value(listed("mu", {0.4}), 1), std::out_of_range);
  EXPECT_THROW(axis_value(range("mu", 0, 1, 3), 3), std::out_of_range);
}

TEST(AxisTest, ARangeOfAnyLengthIsJudgedByThreeOfItsValues) {
  EXPECT_EQ(deciding_values(range("mu", 0.4, 0.4, 1)).size(), 1U);
  EXPECT_EQ(deciding_values(range("mu", 0.0, 1.0, 2)).size(), 2U);
  for (const std::uint64_t count : {3ULL, 1024ULL, 1'000'000'000'000ULL}) {
    EXPECT_EQ(deciding_values(range("mu", 0.0, 1.0, count)),
              (std::vector<std::uint64_t>{0, 1, count - 1}));
  }
}

}  // namespace
}  // namespace oblique::protocol
