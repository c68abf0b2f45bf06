// Points whose leases cost workers: found, leased alone, failed with the reason.
#include <algorithm>
#include <deque>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "server/scheduler.h"
#include "tests/server/scheduler_bench.h"

namespace oblique::server {
namespace {

/// Lets workers join one after another and die of any batch that holds a killing point; returns how
/// many died.
int run_with_killers(SchedulerBench& bench, const std::set<std::uint64_t>& killers,
                     std::map<std::uint64_t, std::string>& failed, std::uint32_t prefetch) {
  int deaths = 0;
  for (WorkerId worker = 1; deaths < 1000; ++worker) {
    auto first = bench.join(worker, prefetch);
    std::deque<SendBatch> held(first.begin(), first.end());
    bool alive = true;
    while (alive && !held.empty()) {
      const auto batch = held.front();
      held.pop_front();
      const auto killer = killers.lower_bound(batch.first_point);
      if (killer != killers.end() && *killer < batch.first_point + batch.count) {
        alive = false;
        break;
      }
      const auto solved = only<SendBatch>(bench.solve_and_store(batch, 1e-6));
      const auto given = only<SendBatch>(bench.feed(CreditGiven{worker, 1}));
      held.insert(held.end(), solved.begin(), solved.end());
      held.insert(held.end(), given.begin(), given.end());
    }
    if (alive) {
      return deaths;
    }
    ++deaths;
    for (const auto& failure : only<StoreFailure>(bench.pass(3250))) {
      failed[failure.point] = failure.reason;
      bench.feed(ResultsStored{0, failure.study, 0, {{failure.point, true}}});
    }
  }
  return deaths;
}

TEST(SchedulerTest, APointThatKillsItsWorkersIsFoundAndFailedAndTheStudyGoesOn) {
  SchedulerSettings settings;
  settings.first_batch_points = 64;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1000), {}});
  std::map<std::uint64_t, std::string> failed;
  const int deaths = run_with_killers(bench, {137, 777}, failed, 3);
  EXPECT_LT(deaths, 50);
  ASSERT_EQ(failed.size(), 2U);
  EXPECT_TRUE(failed.contains(137) && failed.contains(777));
  EXPECT_NE(failed[137].find("worker was lost"), std::string::npos);
  EXPECT_EQ(bench.scheduler.study(1).solved, 998U);
}

TEST(SchedulerTest, SuspectPointsGoToAWorkerThatHoldsNothingElse) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1000), {}});
  for (const WorkerId worker : {1U, 2U}) {  // two deaths make the batches suspect
    bench.join(worker, 2);
    bench.pass(3250);
  }
  const auto given = bench.join(3, 5);
  EXPECT_EQ(given.size(), 1U);
  EXPECT_EQ(given.at(0).attempt, 3U);
  const auto others = bench.join(4, 5);
  EXPECT_EQ(others.size(), 1U);
}

TEST(SchedulerTest, ABusyWorkerIsEmptiedForSuspectPoints) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100'000), {}});
  bench.join(1, 1);
  bench.pass(3250);
  const auto second = bench.join(2, 1).at(0);
  EXPECT_EQ(second.attempt, 2U);
  const auto busy = bench.join(3, 2);  // holds two ordinary batches
  ASSERT_EQ(busy.size(), 2U);
  std::deque<SendBatch> held(busy.begin(), busy.end());
  bench.pass(3250, {3});  // worker 2 dies: its points are suspect now
  EXPECT_FALSE(bench.scheduler.knows_worker(2));
  bool suspect_was_leased = false;
  for (int i = 0; i < 200 && !held.empty() && !suspect_was_leased; ++i) {
    const auto batch = held.front();
    held.pop_front();
    const auto solved = bench.solve(batch);
    const auto given = bench.feed(CreditGiven{3, 1});
    for (const auto& effects : {solved, given}) {
      for (const auto& next : only<SendBatch>(effects)) {
        suspect_was_leased = suspect_was_leased || next.first_point == second.first_point;
        held.push_back(next);
      }
    }
  }
  EXPECT_TRUE(suspect_was_leased);
}

TEST(SchedulerTest, AWorkerThatFinishesBatchesWithoutAnswersDoesNotTakeThemForEver) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  auto batches = bench.join(1, 1);
  int rounds = 0;
  std::vector<StoreFailure> failures;
  while (!batches.empty() && rounds < 100) {
    ++rounds;
    const auto effects = bench.feed(
        ResultsReceived{1, 1, batches[0].lease, static_cast<std::uint64_t>(rounds), true, 0.1, {}});
    failures = only<StoreFailure>(effects);
    batches = only<SendBatch>(bench.feed(CreditGiven{1, 1}));
  }
  EXPECT_EQ(rounds, 3);
  EXPECT_EQ(failures.size(), 1U);
}

}  // namespace
}  // namespace oblique::server
