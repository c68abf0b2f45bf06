#include "server/study/interval_set.h"

#include <map>
#include <random>

#include <gtest/gtest.h>

namespace oblique::server {
namespace {

TEST(PointAttempts, SayOfEachPointWhatWasSetLast) {
  constexpr std::uint64_t kPoints = 40;
  std::mt19937 random(1);
  const auto draw = [&](std::uint64_t below) { return std::uint64_t{random()} % below; };
  for (int round = 0; round < 200; ++round) {
    PointAttempts kept;
    std::map<std::uint64_t, std::uint32_t> expected;
    for (int change = 0; change < 20; ++change) {
      const std::uint64_t begin = draw(kPoints);
      const std::uint64_t end = begin + draw(8);
      const auto attempts = static_cast<std::uint32_t>(1 + draw(3));
      kept.set({begin, end}, attempts);
      for (std::uint64_t point = begin; point < end; ++point) {
        expected[point] = attempts;
      }
    }
    std::map<std::uint64_t, std::uint32_t> found;
    Interval last{0, 0};
    std::uint32_t last_attempts = 0;
    kept.for_each([&](const Interval& interval, std::uint32_t attempts) {
      EXPECT_LT(interval.begin, interval.end);
      EXPECT_FALSE(interval.begin == last.end && attempts == last_attempts)
          << "one interval in two pieces";
      last = interval;
      last_attempts = attempts;
      for (std::uint64_t point = interval.begin; point < interval.end; ++point) {
        found[point] = attempts;
      }
    });
    ASSERT_EQ(found, expected) << round;
  }
}

}  // namespace
}  // namespace oblique::server
