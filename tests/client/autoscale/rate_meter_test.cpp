#include "client/autoscale/rate_meter.h"

#include <cstdint>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

Demand demand_with(std::uint64_t settled, std::size_t threads = 4, std::uint64_t open = 1'000'000) {
  Demand seen;
  seen.open_points = open;
  seen.settled_points = settled;
  seen.threads = threads;
  return seen;
}

class RateMeterTest : public ::testing::Test {
 protected:
  RateMeter meter_{RateMeterSettings{.settle_s = 5.0, .window_s = 300.0}};
};

TEST_F(RateMeterTest, NothingIsKnownBeforeItHasSettled) {
  meter_.update(demand_with(0), 0.0);
  meter_.update(demand_with(400), 4.9);
  EXPECT_FALSE(meter_.points_per_s_a_thread());
}

TEST_F(RateMeterTest, CountsWhatIsSettledATimeAndAThread) {
  meter_.update(demand_with(1000), 100.0);
  meter_.update(demand_with(1400), 110.0);
  ASSERT_TRUE(meter_.points_per_s_a_thread());
  EXPECT_DOUBLE_EQ(*meter_.points_per_s_a_thread(), 10.0);
}

TEST_F(RateMeterTest, BeginsAgainWhenWorkersComeAndKeepsTheOldRateMeanwhile) {
  meter_.update(demand_with(0), 0.0);
  meter_.update(demand_with(400), 10.0);
  meter_.update(demand_with(401, 400),
                11.0);  // a hundred times the threads, at work for an instant
  meter_.update(demand_with(402, 400), 12.0);
  EXPECT_DOUBLE_EQ(*meter_.points_per_s_a_thread(), 10.0);
  meter_.update(demand_with(401 + 400 * 9 * 20, 400), 31.0);
  EXPECT_DOUBLE_EQ(*meter_.points_per_s_a_thread(), 9.0);
}

TEST_F(RateMeterTest, PointsThatTakeLongAreOneInTheTimeThatTheyTookSoFar) {
  meter_.update(demand_with(0), 0.0);
  meter_.update(demand_with(0), 50.0);
  EXPECT_DOUBLE_EQ(*meter_.points_per_s_a_thread(), 1.0 / (50.0 * 4));
  meter_.update(demand_with(0), 100.0);
  EXPECT_DOUBLE_EQ(*meter_.points_per_s_a_thread(), 1.0 / (100.0 * 4));
  meter_.update(demand_with(4), 200.0);
  EXPECT_DOUBLE_EQ(*meter_.points_per_s_a_thread(), 4.0 / (200.0 * 4));
}

TEST_F(RateMeterTest, TheLastPointsOfAStudyWhichLeaveThreadsIdleSayNothing) {
  meter_.update(demand_with(0), 0.0);
  meter_.update(demand_with(400), 10.0);
  meter_.update(demand_with(401, 4, 3), 20.0);
  meter_.update(demand_with(401, 4, 3), 40.0);
  EXPECT_DOUBLE_EQ(*meter_.points_per_s_a_thread(), 10.0);
}

TEST_F(RateMeterTest, ForgottenOrRetriedPointsDoNotMakeARate) {
  meter_.update(demand_with(1000), 0.0);
  meter_.update(demand_with(10), 10.0);  // a study was deleted
  EXPECT_FALSE(meter_.points_per_s_a_thread());
}

TEST_F(RateMeterTest, OneLookTakesTheServersRate) {
  RateMeter at_once(RateMeterSettings{.settle_s = 0.0});
  auto seen = demand_with(1000);
  at_once.update(seen, 0.0);
  EXPECT_FALSE(at_once.points_per_s_a_thread());
  seen.points_per_s = 80.0;
  at_once.update(seen, 0.0);
  EXPECT_DOUBLE_EQ(*at_once.points_per_s_a_thread(), 20.0);
}

}  // namespace
}  // namespace oblique::client
