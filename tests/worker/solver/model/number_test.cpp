#include "worker/solver/model/number.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace oblique::solver {
namespace {

double read_back(const std::string& text) {
  double value = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

TEST(Number, IsWrittenAsAPersonWouldWriteIt) {
  for (const char* text : {"0.1", "0.3", "1", "-2.5", "0.0001", "100000", "1234567", "1e+06",
                           "7e+10", "0.0005309", "2.243e-08", "-0", "1e-05"}) {
    EXPECT_EQ(exact_number(read_back(text)), text);
  }
  EXPECT_EQ(exact_number(1e22), "1e+22");
  EXPECT_EQ(exact_number(std::numeric_limits<double>::infinity()), "inf");
}

TEST(Number, ReadsBackAsTheSameBits) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 100000; ++i) {
    const std::uint64_t bits = random();
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isfinite(value)) {
      continue;
    }
    ASSERT_EQ(read_back(exact_number(value)), value);
  }
}

TEST(ReadableNumber, HasSignificantDigitsAndNoTrailingZeros) {
  EXPECT_EQ(readable_number(5057.62999), "5057.63");
  EXPECT_EQ(readable_number(12.5), "12.5");
  EXPECT_EQ(readable_number(0.1 + 0.2), "0.3");
  EXPECT_EQ(readable_number(0.000543704321), "0.000543704");
  EXPECT_EQ(readable_number(4.49529321e-05), "4.49529e-05");
  EXPECT_EQ(readable_number(9.9999999), "10");
  EXPECT_EQ(readable_number(-1234.5678, 10), "-1234.5678");
}

TEST(ReadableNumber, PrefersDigitsBeforeThePointToAnExponent) {
  EXPECT_EQ(readable_number(123.4, 2), "123");
  EXPECT_EQ(readable_number(99.6, 2), "100");
  EXPECT_EQ(readable_number(14300.2, 3), "14300");
  EXPECT_EQ(readable_number(999999.0, 2), "1e+06");
  EXPECT_EQ(readable_number(7e10), "7e+10");
  EXPECT_EQ(readable_number(1234567890.25, 10), "1234567890");
}

TEST(ReadableNumber, IsNeverMinusZero) {
  EXPECT_EQ(readable_number(-0.0), "0");
  EXPECT_EQ(fixed_number(-1e-17, 6), "0.000000");
  EXPECT_EQ(fixed_number(-0.004, 2), "0.00");
  EXPECT_EQ(signed_number(-0.004, 2), "0.00");
  EXPECT_EQ(fixed_number(-0.006, 2), "-0.01");
}

TEST(ReadableNumber, NamesInfinityAndNaN) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(readable_number(nan), "nan");
  EXPECT_EQ(readable_number(-infinity), "-inf");
  EXPECT_EQ(fixed_number(-infinity, 2), "-inf");
  EXPECT_EQ(signed_number(infinity, 2), "+inf");
}

TEST(FixedNumber, HasItsDecimalsAtEverySize) {
  EXPECT_EQ(fixed_number(345.8199, 2), "345.82");
  EXPECT_EQ(fixed_number(2.0, 3), "2.000");
  EXPECT_EQ(fixed_number(std::numeric_limits<double>::max(), 17).size(), 309U + 1U + 17U);
  EXPECT_EQ(signed_number(0.05, 2), "+0.05");
  EXPECT_EQ(signed_number(-1.1, 2), "-1.10");
}

}  // namespace
}  // namespace oblique::solver
