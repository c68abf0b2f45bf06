#include "client/autoscale/need.h"

#include <cstdint>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

constexpr double kTarget_s = 100.0;

/// Jobs of ten threads, each of which settles two points a second.
constexpr Capacity kMeasured{.points_per_s_a_thread = 2.0, .threads_a_job = 10.0};

std::size_t needed(std::uint64_t open_points, const Capacity& capacity = kMeasured,
                   std::size_t jobs_now = 0) {
  return jobs_needed(open_points, capacity, kTarget_s, jobs_now);
}

TEST(JobsNeeded, AreNoneWithoutOpenPoints) {
  EXPECT_EQ(needed(0), 0U);
  EXPECT_EQ(needed(0, {}, 7), 0U);
}

TEST(JobsNeeded, AreAsManyAsSettleWhatIsOpenWithinTheTarget) {
  // A job settles 2000 points in 100 s.
  EXPECT_EQ(needed(1), 1U);
  EXPECT_EQ(needed(2000), 1U);
  EXPECT_EQ(needed(2001), 2U);
  EXPECT_EQ(needed(200'000), 100U);
}

TEST(JobsNeeded, IsOneUntilSomethingIsMeasuredOrThoseThatAreThere) {
  EXPECT_EQ(needed(1'000'000, {}), 1U);
  EXPECT_EQ(needed(1'000'000, {}, 7), 7U);
  EXPECT_EQ(needed(1'000'000, {.points_per_s_a_thread = 2.0}), 1U);
}

TEST(JobsNeeded, LeaveOutWhatOtherWorkersDo) {
  Capacity with_others = kMeasured;
  with_others.other_threads = 20;
  EXPECT_EQ(needed(4000, with_others), 0U);
  EXPECT_EQ(needed(6000, with_others), 1U);
}

TEST(JobsNeeded, AreNoMoreThanHaveAPointForEachThread) {
  Capacity slow = kMeasured;
  slow.points_per_s_a_thread = 1e-9;
  EXPECT_EQ(needed(25, slow), 3U);
}

TEST(JobsNeeded, StayANumberForAnyQueueAndAnyRate) {
  Capacity slow = kMeasured;
  slow.points_per_s_a_thread = 1e-300;
  EXPECT_EQ(needed(UINT64_MAX, slow), 1'000'000'000U);
}

}  // namespace
}  // namespace oblique::client
