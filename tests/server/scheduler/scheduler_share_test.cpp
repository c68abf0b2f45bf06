#include <cstdint>
#include <map>

#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

/// How many of the next `batches` batches each study gets.
std::map<StudyId, int> shares(SchedulerBench& bench, std::uint32_t batches) {
  std::map<StudyId, int> counts;
  for (const auto& batch : only<SendBatch>(bench.feed(CreditGiven{1, batches}))) {
    ++counts[batch.study];
  }
  return counts;
}

TEST(SchedulerShare, StudiesOfOnePriorityShareTheWorkersAlike) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  bench.feed(StudyAdded{2, table_of(1'000'000), {}});
  bench.feed(WorkerJoined{1, 1});
  const auto counts = shares(bench, 400);
  EXPECT_NEAR(counts.at(1), 200, 2);
  EXPECT_NEAR(counts.at(2), 200, 2);
}

TEST(SchedulerShare, AStudyOfAHigherPriorityComesFirst) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  bench.feed(StudyAdded{2, table_of(1'000'000), {}, 0, false, false, 5});
  bench.feed(WorkerJoined{1, 1});
  EXPECT_EQ(shares(bench, 10).count(1), 0U);
  bench.feed(StudyPaused{2});
  EXPECT_EQ(shares(bench, 10).at(1), 10);
}

TEST(SchedulerShare, AStudyThatOpensLaterDoesNotCatchUpWithWhatWentBefore) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  bench.feed(WorkerJoined{1, 1});
  shares(bench, 100);
  bench.feed(StudyAdded{2, table_of(1'000'000), {}});
  const auto counts = shares(bench, 100);
  EXPECT_NEAR(counts.at(1), 50, 1);
  EXPECT_NEAR(counts.at(2), 50, 1);
}

TEST(SchedulerShare, AStudyThatIsReopenedDoesNotCatchUpWithWhatWentOnWithoutIt) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  bench.feed(StudyAdded{2, table_of(1'000'000), {}});
  bench.feed(StudyPaused{2});
  bench.feed(WorkerJoined{1, 1});
  EXPECT_EQ(shares(bench, 100).at(1), 100);
  bench.feed(StudyReopened{2});
  const auto counts = shares(bench, 100);
  EXPECT_NEAR(counts.at(1), 50, 1);
  EXPECT_NEAR(counts.at(2), 50, 1);
}

TEST(SchedulerShare, ForgottenFailuresAreFreeAgainAndOthersStaySettled) {
  SchedulerBench bench(trusting());
  IntervalSet settled(0, 10);
  bench.feed(StudyAdded{1, table_of(10), settled, 3});
  bench.feed(WorkerJoined{1, 1});
  EXPECT_TRUE(shares(bench, 1).empty()) << "all is settled";
  IntervalSet failures(2, 4);
  failures.insert(7);
  const auto batches = only<SendBatch>(bench.feed(FailuresForgotten{1, failures}));
  ASSERT_EQ(batches.size(), 1U);
  EXPECT_EQ(batches[0].first_point(), 2U);
  EXPECT_EQ(bench.scheduler.study(1).failed, 0U);
  EXPECT_EQ(bench.scheduler.study(1).solved(), 7U);
}

}  // namespace
}  // namespace oblique::server
