// How large batches are.
#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

/// Batches follow a worker's pace and nothing else.
SchedulerSettings by_pace_alone() {
  SchedulerSettings settings = trusting();
  settings.tail_batches_per_thread = 0;
  settings.growth = 1'000'000;
  return settings;
}

TEST(SchedulerPace, ABatchTakesTheTimeAimedAt) {
  SchedulerBench bench(by_pace_alone());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch next = bench.next_after(bench.join(1, 1).at(0), 1e-3);
  EXPECT_EQ(next.count(), 100U) << "0.1 s at 1 ms a point";
}

TEST(SchedulerPace, OneSlowBatchCountsHalfAgainstOneOfItsSizeThatIsKnown) {
  SchedulerSettings settings = by_pace_alone();
  settings.first_batch_points = 100;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch second = bench.next_after(bench.join(1, 1).at(0), 1e-3);
  EXPECT_EQ(bench.next_after(second, 3e-3).count(), 50U) << "0.1 s at 2 ms a point";
}

TEST(SchedulerPace, AMessageCountsByItsPointsSoThatAFallBeforeTheFirstOnesSaysLittleOfOthers) {
  SchedulerSettings settings = by_pace_alone();
  settings.first_batch_points = 1000;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch first = bench.join(1, 1).at(0);
  const auto part = [&](std::uint64_t from, std::uint64_t to, double busy_s, bool is_last) {
    ResultsReceived message{1, 1, first.lease, ++bench.sequence, is_last, busy_s, {}};
    for (std::uint64_t point = from; point < to; ++point) {
      message.outcomes.push_back({point, false});
    }
    bench.feed(message);
  };
  part(0, 10, 0.2, false);
  part(10, 1000, 0.099, true);
  const SendBatch next = only<SendBatch>(bench.feed(CreditGiven{1, 1})).at(0);
  EXPECT_NEAR(static_cast<double>(next.count()), 0.1 / (0.299 / 1000), 5.0);
}

TEST(SchedulerPace, WhoSaysThatPointsTakeDaysIsNotBelieved) {
  SchedulerSettings settings = by_pace_alone();
  settings.first_batch_points = 100;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  EXPECT_EQ(bench.next_after(bench.join(1, 1).at(0), 1e9).count(), 100U);
}

TEST(SchedulerPace, SlowPointsOfOneModelFillTheLanesOfAWorker) {
  SchedulerBench bench(by_pace_alone());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch second = bench.next_after(bench.join(1, 1).at(0), 0.5);
  EXPECT_EQ(second.count(), 8U) << "0.5 s a point, and eight at a time take little longer than one";
  const SendBatch third = bench.next_after(second, 5.0);
  EXPECT_LT(third.count(), 4U) << "but not when they take minutes";
}

TEST(SchedulerPace, TheLastBatchesOfAStudyAreNotShorterThanTheirWayIsWorth) {
  SchedulerSettings settings = trusting();
  settings.shortest_batch_s = 0.01;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1000), {}});
  SendBatch batch = bench.join(1, 1).at(0);
  std::vector<std::uint64_t> counts;
  for (std::uint64_t left = 1000 - batch.count(); left > 0; left -= batch.count()) {
    batch = bench.next_after(batch, 1e-4);
    counts.push_back(batch.count());
  }
  EXPECT_GE(counts.at(counts.size() - 2), 100U) << "0.01 s at 0.1 ms a point";
  EXPECT_LT(counts.size(), 12U);
}

TEST(SchedulerPace, ABatchGrowsToSoManyTimesTheLastOneAtMost) {
  SchedulerSettings settings = by_pace_alone();
  settings.growth = 4;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch first = bench.join(1, 1).at(0);
  EXPECT_EQ(bench.next_after(first, 1e-6).count(), 4 * first.count());
}

}  // namespace
}  // namespace oblique::server
