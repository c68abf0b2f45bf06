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

/// What the worker gets once it has solved the batch at so many seconds a point.
SendBatch next_after(SchedulerBench& bench, const SendBatch& batch, double s_per_point) {
  bench.solve_and_store(batch, s_per_point * static_cast<double>(batch.count));
  return only<SendBatch>(bench.feed(CreditGiven{batch.worker, 1})).at(0);
}

TEST(SchedulerPace, ABatchTakesTheTimeAimedAt) {
  SchedulerBench bench(by_pace_alone());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch next = next_after(bench, bench.join(1, 1).at(0), 1e-3);
  EXPECT_EQ(next.count, 100U) << "0.1 s at 1 ms a point";
}

TEST(SchedulerPace, WithMoreWorkersThanTheServerServesAtThatPaceBatchesTakeLonger) {
  SchedulerSettings settings = by_pace_alone();
  settings.most_batches_per_s = 20.0;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch first = bench.join(1, 1).at(0);
  for (WorkerId worker = 2; worker <= 8; ++worker) {
    bench.join(worker, 0);
  }
  EXPECT_EQ(next_after(bench, first, 1e-3).count, 400U) << "8 workers, each a batch in 0.4 s";
}

TEST(SchedulerPace, OneSlowBatchCountsHalfAgainstWhatWasKnown) {
  SchedulerBench bench(by_pace_alone());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch second = next_after(bench, bench.join(1, 1).at(0), 1e-3);
  EXPECT_EQ(next_after(bench, second, 3e-3).count, 50U) << "0.1 s at 2 ms a point";
}

TEST(SchedulerPace, ABatchGrowsToSoManyTimesTheLastOneAtMost) {
  SchedulerSettings settings = by_pace_alone();
  settings.growth = 4;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch first = bench.join(1, 1).at(0);
  EXPECT_EQ(next_after(bench, first, 1e-6).count, 4 * first.count);
}

}  // namespace
}  // namespace oblique::server
