// Batches that a worker gives back by itself.
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

TEST(SchedulerReturnTest, ABatchThatIsGivenBackIsFreeAtOnceAndNoLoss) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(100), {}});
  const SendBatch batch = only<SendBatch>(bench.join_as("a", 1, 1)).at(0);
  ASSERT_GT(batch.count(), 1U);
  bench.join_as("b", 2, 1000);  // takes all others and waits for more
  // One point is solved, the rest goes back.
  bench.feed(ResultsReceived{1, 1, batch.lease, 1, false, 1e-3, {{batch.first_point(), false}}});
  const auto again = only<SendBatch>(bench.feed(BatchesReturned{1, {batch.lease}}));
  std::uint64_t next = batch.first_point() + 1;
  for (const SendBatch& part : again) {
    EXPECT_EQ(part.worker, 2U);
    EXPECT_EQ(part.first_point(), next);
    EXPECT_EQ(part.attempt, batch.attempt + 1);
    next += part.count();
  }
  EXPECT_EQ(next, batch.first_point() + batch.count());
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 0U);
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).leased_points, 0U);
}

TEST(SchedulerReturnTest, ResultsThatComeAfterTheirBatchWentBackCount) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1), {}});
  const SendBatch batch = bench.join(1, 1).at(0);
  bench.feed(BatchesReturned{1, {batch.lease}});
  EXPECT_EQ(only<StoreResults>(bench.feed(ResultsReceived{1, 1, 0, 1, false, 1e-3, {{0, false}}}))
                .at(0)
                .accepted.size(),
            1U);
}

TEST(SchedulerReturnTest, LeasesOfOthersAndUnknownOnesStay) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(100), {}});
  const SendBatch batch = bench.join(1, 1).at(0);
  const SendBatch other = bench.join(2, 1).at(0);
  bench.feed(BatchesReturned{2, {batch.lease, 0, UINT64_MAX, other.lease, other.lease}});
  bench.feed(BatchesReturned{99, {batch.lease}});
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).leased_points, batch.count());
  EXPECT_EQ(bench.scheduler.worker(2, bench.now_ms).leased_points, 0U);
}

TEST(SchedulerReturnTest, ASuspectPointStaysSuspectWhenItIsGivenBack) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1), {}});
  // Two processes are lost with it: it is suspect.
  bench.join_as("a", 1, 1);
  bench.feed(WorkerUnreachable{1});
  bench.join_as("b", 2, 1);
  bench.feed(WorkerUnreachable{2});
  auto effects = bench.join_as("c", 3, 2);
  const auto probes = only<SendProbe>(effects);
  ASSERT_EQ(probes.size(), 1U) << "it goes to proven workers only";
  effects = bench.solve_probe(probes[0]);
  const auto batches = only<SendBatch>(effects);
  ASSERT_EQ(batches.size(), 1U);
  bench.feed(BatchesReturned{3, {batches[0].lease}});
  effects = bench.join_as("d", 4, 1);
  EXPECT_TRUE(only<SendBatch>(effects).empty()) << "an unproven worker gets it";
}

TEST(SchedulerReturnTest, AProbeThatIsGivenBackKeepsNobodyWaiting) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1), {}});
  bench.join_as("a", 1, 1);
  bench.feed(WorkerUnreachable{1});
  bench.join_as("b", 2, 1);
  bench.feed(WorkerUnreachable{2});
  const auto probe = only<SendProbe>(bench.join_as("c", 3, 2)).at(0);
  bench.feed(BatchesReturned{3, {probe.lease}});
  EXPECT_FALSE(only<SendProbe>(bench.pass(2000, {3})).empty());
}

}  // namespace
}  // namespace oblique::server
