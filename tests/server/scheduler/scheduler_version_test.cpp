#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

TEST(SchedulerVersion, AStudyGoesToWorkersOfTheSolverVersionItBeganWith) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
  bench.feed(WorkerJoined{1, 1, "1.0"});
  bench.feed(WorkerJoined{2, 1, "2.0"});
  EXPECT_EQ(only<SendBatch>(bench.feed(CreditGiven{1, 1})).size(), 1U);
  EXPECT_TRUE(only<SendBatch>(bench.feed(CreditGiven{2, 1})).empty());
  EXPECT_EQ(bench.scheduler.study(1).solver_version, "1.0");
}

TEST(SchedulerVersion, AWorkerOfAnotherVersionServesOtherStudies) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), IntervalSet(0, 1), 0, false, false, {}, "1.0"});
  bench.feed(StudyAdded{2, table_of(100), {}});
  bench.feed(WorkerJoined{2, 1, "2.0"});
  EXPECT_EQ(only<SendBatch>(bench.feed(CreditGiven{2, 1})).at(0).study, 2U);
}

TEST(SchedulerVersion, AStudyWhoseVersionNoWorkerHasSaysSo) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), IntervalSet(0, 1), 0, false, false, {}, "1.0"});
  EXPECT_FALSE(bench.scheduler.study(1).lacks_worker) << "there is none at all";
  bench.feed(WorkerJoined{2, 1, "2.0"});
  EXPECT_TRUE(bench.scheduler.study(1).lacks_worker);
  bench.feed(WorkerJoined{3, 1, "1.0"});
  EXPECT_FALSE(bench.scheduler.study(1).lacks_worker);
}

TEST(SchedulerVersion, AStudyWithoutResultsIsFreeForAnotherVersionOnceItsLeasesEnd) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
  bench.feed(WorkerJoined{1, 1, "1.0"});
  bench.feed(CreditGiven{1, 1});
  bench.feed(WorkerJoined{2, 1, "2.0"});
  EXPECT_TRUE(only<SendBatch>(bench.feed(CreditGiven{2, 1})).empty());
  EXPECT_EQ(only<SendBatch>(bench.feed(WorkerLeft{1})).size(), 1U);
  EXPECT_EQ(bench.scheduler.study(1).solver_version, "2.0");
}

TEST(SchedulerVersion, AStudyWhoseOnlyResultsWereForgottenFailuresIsFreeForAnyVersion) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), IntervalSet(0, 1), 1, false, false, {}, "1.0"});
  bench.feed(WorkerJoined{2, 1, "2.0"});
  bench.feed(CreditGiven{2, 1});
  EXPECT_EQ(only<SendBatch>(bench.feed(FailuresForgotten{1, IntervalSet(0, 1)})).size(), 1U);
}

TEST(SchedulerVersion, LateResultsOfAnotherVersionAreAcknowledgedAndNotStored) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), IntervalSet(0, 1), 0, false, false, {}, "1.0"});
  bench.feed(WorkerJoined{2, 1, "2.0"});
  const auto effects = bench.feed(ResultsReceived{2, 1, 0, 1, false, 0.1, {{5, false}}});
  ASSERT_EQ(only<StoreResults>(effects).size(), 1U);
  EXPECT_TRUE(only<StoreResults>(effects)[0].accepted.empty());
  EXPECT_EQ(only<AcknowledgeResults>(bench.feed(ResultsStored{2, 1, 1, {}})).size(), 1U);
}

}  // namespace
}  // namespace oblique::server
