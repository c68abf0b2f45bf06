// Results of a study come from one solver version, that of the server and all its workers.
#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

SchedulerSettings of_version(const std::string& version) {
  SchedulerSettings settings;
  settings.solver_version = version;
  return settings;
}

/// A study of 100 points, the first of which has a result of version 1.0.
StudyAdded old_study(std::uint64_t failed = 0) {
  StudyAdded added{.study = 1, .table = table_of(100), .settled = IntervalSet(0, 1)};
  added.failed = failed;
  added.solver_version = "1.0";
  return added;
}

TEST(SchedulerVersion, AStudyWithResultsOfAnotherVersionIsNotHandedOutAndOthersAre) {
  SchedulerBench bench(of_version("2.0"));
  bench.feed(old_study());
  EXPECT_TRUE(bench.join(1, 1).empty());
  EXPECT_TRUE(bench.scheduler.study(1).is_of_other_solver);
  EXPECT_EQ(only<SendBatch>(bench.feed(StudyAdded{2, table_of(100), {}})).at(0).study, 2U);
  EXPECT_FALSE(bench.scheduler.study(2).is_of_other_solver);
  EXPECT_EQ(bench.scheduler.study(2).solver_version, "2.0");
}

TEST(SchedulerVersion, AStudyWithResultsOfTheServersVersionGoesOn) {
  SchedulerBench bench(of_version("1.0"));
  bench.feed(old_study());
  EXPECT_EQ(bench.join(1, 1).at(0).first_point(), 1U);
}

TEST(SchedulerVersion, AStudyWhoseOnlyResultsWereForgottenFailuresIsHandedOut) {
  SchedulerBench bench(of_version("2.0"));
  bench.feed(old_study(1));
  EXPECT_TRUE(bench.join(2, 1).empty());
  EXPECT_EQ(only<SendBatch>(bench.feed(FailuresForgotten{1, IntervalSet(0, 1)})).size(), 1U);
}

TEST(SchedulerVersion, ResultsForAStudyOfAnotherVersionAreAcknowledgedAndNotStored) {
  SchedulerBench bench(of_version("2.0"));
  bench.feed(old_study());
  bench.join(2, 0);
  const auto effects = bench.feed(ResultsReceived{2, 1, 0, 1, false, 0.1, {{5, false}}});
  ASSERT_EQ(only<StoreResults>(effects).size(), 1U);
  EXPECT_TRUE(only<StoreResults>(effects)[0].accepted.empty());
  EXPECT_EQ(only<AcknowledgeResults>(bench.feed(ResultsStored{2, 1, 1, {}})).size(), 1U);
}

}  // namespace
}  // namespace oblique::server
