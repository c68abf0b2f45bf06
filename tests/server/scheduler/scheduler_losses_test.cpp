// Workers that are lost without fault of the points that they held: nothing of that fails a point.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/loss_history.h"
#include "server/scheduler/scheduler.h"
#include "server/scheduler/worker_processes.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

/// Workers 1, 2 and 3 are lost with points and have solved none.
void lose_newcomers(SchedulerBench& bench) {
  for (const WorkerId newcomer : {1U, 2U, 3U}) {
    bench.join(newcomer, 1);
    bench.feed(WorkerUnreachable{newcomer});
  }
}

TEST(SchedulerLosses, PeersThatTakeBatchesAndVanishUnderNewNamesFailNoPoint) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(2000), {}});
  WorkerId fake = 100;
  const auto vanish = [&] {
    ++fake;
    bench.join_as("fake " + std::to_string(fake), fake, 1000);
    return only<StoreFailure>(bench.feed(WorkerUnreachable{fake})).size();
  };
  std::size_t failures = 0;
  for (int i = 0; i < 100; ++i) {
    failures += vanish();
  }
  failures += only<StoreFailure>(bench.pass(60'000)).size();
  std::vector<Effect> effects = bench.join_as("sound", 1, 2);
  bool finished = false;
  for (int i = 0; i < 10'000 && !finished; ++i) {
    failures += vanish() + only<StoreFailure>(effects).size();
    std::vector<Effect> next = bench.pass(250, {1});
    for (const auto& probe : only<SendProbe>(effects)) {
      SchedulerBench::append(next,
                             probe.worker == 1 ? bench.solve_probe(probe) : std::vector<Effect>{});
    }
    for (const auto& batch : only<SendBatch>(effects)) {
      SchedulerBench::append(next, bench.solve_and_store(batch));
      SchedulerBench::append(next, bench.feed(CreditGiven{1, 1}));
    }
    finished = !only<StudyFinished>(next).empty();
    effects = std::move(next);
  }
  EXPECT_EQ(failures, 0U);
  EXPECT_TRUE(finished);
  EXPECT_EQ(bench.scheduler.study(1).solved(), 2000U);
}

TEST(SchedulerLosses, NewcomersSolveAProbeFirstWhileOthersVanishWithTheirPoints) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  for (const WorkerId fake : {1U, 2U, 3U}) {
    EXPECT_FALSE(bench.join(fake, 1).empty());
    bench.feed(WorkerUnreachable{fake});
  }
  const auto effects = bench.join_as("sound", 4, 2);
  EXPECT_TRUE(only<SendBatch>(effects).empty());
  ASSERT_EQ(only<SendProbe>(effects).size(), 1U) << "one at a time";
  EXPECT_TRUE(bench.scheduler.worker(4, bench.now_ms).is_set_aside);
  EXPECT_FALSE(bench.scheduler.worker(4, bench.now_ms).is_proven);
  EXPECT_FALSE(only<SendBatch>(bench.solve_probe(only<SendProbe>(effects)[0])).empty());
  EXPECT_FALSE(bench.scheduler.worker(4, bench.now_ms).is_set_aside);
  EXPECT_TRUE(bench.scheduler.worker(4, bench.now_ms).is_proven);
  bench.pass(61'000, {4});
  EXPECT_FALSE(bench.join(5, 1).empty()) << "it has been calm for a minute";
}

TEST(SchedulerLosses, AProbeThatIsNotSolvedIsRepeatedEverySecondAndNoOftener) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  lose_newcomers(bench);
  const auto probe = only<SendProbe>(bench.join_as("faulty", 4, 10)).at(0);
  const auto failed =
      bench.feed(ResultsReceived{4, kProbeStudy, probe.lease, 1, true, 0.1, {{0, true}}});
  EXPECT_TRUE(only<SendProbe>(failed).empty());
  EXPECT_TRUE(only<SendBatch>(failed).empty());
  EXPECT_EQ(only<SendProbe>(bench.pass(1000, {4})).size(), 1U);
}

TEST(SchedulerLosses, AProbeThatNeverArrivedIsGivenAgain) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  lose_newcomers(bench);
  const auto probe = only<SendProbe>(bench.join_as("sound", 4, 2)).at(0);
  bench.pass(2750, {4});
  EXPECT_TRUE(bench.feed(HeartbeatReceived{4, {}}).empty()) << "it may be on its way";
  bench.pass(250, {4});
  EXPECT_TRUE(bench.feed(HeartbeatReceived{4, {probe.lease}}).empty());
  EXPECT_EQ(only<SendProbe>(bench.feed(HeartbeatReceived{4, {}})).size(), 1U);
}

TEST(SchedulerLosses, ResultsThatBelongToNoLeaseAreNoAnswerToAProbeThatWasNotGiven) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
  bench.join(1, 1);
  bench.feed(ResultsReceived{1, 1, 0, 1, false, 1e-3, {{50, false}}});
  EXPECT_FALSE(bench.scheduler.worker(1, bench.now_ms).is_proven);
}

TEST(SchedulerLosses, AHeartbeatThatNamesLeaseZeroNamesNothing) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  const auto batch = bench.join(1, 1).at(0);
  bench.pass(3000, {1});
  EXPECT_TRUE(bench.feed(HeartbeatReceived{1, {0, batch.lease}}).empty());
  EXPECT_EQ(bench.scheduler.study(1).leased, 1U);
  bench.feed(HeartbeatReceived{1, {0}});
  EXPECT_EQ(bench.scheduler.study(1).leased, 0U) << "the batch did not reach it";
}

TEST(SchedulerLosses, ABatchThatCouldNotBeSentSpeaksNeitherAgainstItsPointsNorAgainstTheWorker) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  for (WorkerId worker = 1; worker <= 20; ++worker) {
    const auto sent = only<SendBatch>(bench.join_as("process", worker, 1));
    ASSERT_EQ(sent.size(), 1U) << "the point is not suspect and the process not set aside";
    EXPECT_EQ(sent[0].attempt, worker);
    bench.feed(WorkerUnreachable{worker, "gone", {sent[0].lease}});
  }
}

TEST(SchedulerLosses, OnlyWhatWasSentToALostWorkerCountsAsLost) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(100), {}});
  const auto sent = bench.join(1, 2);
  ASSERT_EQ(sent.size(), 2U);
  bench.feed(WorkerUnreachable{1, "gone", {sent[1].lease, 12'345}});
  EXPECT_EQ(bench.scheduler.study(1).leased, 0U);
  const auto again = bench.join(2, 1);
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].attempt, 2U);
}

TEST(SchedulerLosses, AWorkerHoldsAtMostTwoBatchesMoreThanItHasSolved) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const auto first = bench.join(1, 1000);
  ASSERT_EQ(first.size(), 2U);
  const auto second = only<SendBatch>(bench.solve(first[0]));
  EXPECT_EQ(second.size(), 2U) << "three are with it";
  EXPECT_EQ(only<SendBatch>(bench.solve(second.at(0))).size(), 2U) << "four are with it";
}

TEST(SchedulerLosses, AProcessLostThreeTimesInARowIsSetAsideUntilItSolvesAProbe) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  bench.solve(only<SendBatch>(bench.join_as("weak", 1, 1)).at(0));
  for (const WorkerId worker : {2U, 3U, 4U}) {
    EXPECT_EQ(only<SendBatch>(bench.join_as("weak", worker, 1)).size(), 1U);
    bench.feed(WorkerUnreachable{worker});
  }
  auto effects = bench.join_as("weak", 5, 2);
  EXPECT_TRUE(bench.scheduler.worker(5, bench.now_ms).is_set_aside);
  EXPECT_EQ(bench.scheduler.worker(5, bench.now_ms).losses, 3U);
  EXPECT_TRUE(only<SendBatch>(effects).empty());
  effects = bench.solve_probe(only<SendProbe>(effects).at(0));
  EXPECT_EQ(only<SendBatch>(effects).size(), 2U);
  EXPECT_FALSE(bench.scheduler.worker(5, bench.now_ms).is_set_aside);
}

TEST(SchedulerLosses, ABatchWhosePointsWereAllAnsweredBeforeItEndedIsNone) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch batch = bench.join(1, 1).at(0);
  ResultsReceived answers{1, 1, batch.lease, 1, false, 1e-3, {}};
  for (std::uint64_t i = 0; i < batch.count(); ++i) {
    answers.outcomes.push_back({batch.first_point() + i, false});
  }
  bench.feed(answers);
  bench.feed(ResultsReceived{1, 1, batch.lease, 2, true, 0.0, {}});
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 0U);
}

TEST(SchedulerLosses, ABatchThatEndsWithoutAnAnswerIsOne) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  const SendBatch batch = bench.join(1, 1).at(0);
  bench.feed(ResultsReceived{1, 1, batch.lease, 1, true, 0.0, {}});
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 1U);
}

TEST(SchedulerLosses, ANewConnectionOfAProcessEndsItsOldOneAtOnce) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  const auto lost = only<SendBatch>(bench.join_as("one", 1, 1)).at(0);
  const auto effects = bench.join_as("one", 2, 1);
  ASSERT_EQ(only<DropWorker>(effects).size(), 1U);
  EXPECT_EQ(only<DropWorker>(effects)[0].worker, 1U);
  ASSERT_EQ(only<SendBatch>(effects).size(), 1U);
  EXPECT_EQ(only<SendBatch>(effects)[0].first_point(), lost.first_point());
}

TEST(SchedulerLosses, ANewcomerThatConnectsAnewHasNotVanished) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1'000'000), {}});
  // Each of four processes has an earlier connection, which held a batch, replaced by a new one.
  for (const WorkerId worker : {1U, 2U, 3U, 4U}) {
    const std::string process = "sound " + std::to_string(worker);
    ASSERT_EQ(only<SendBatch>(bench.join_as(process, worker, 1)).size(), 1U);
    bench.join_as(process, worker + 10, 0);
  }
  EXPECT_EQ(only<SendBatch>(bench.join_as("another", 30, 1)).size(), 1U);
  EXPECT_FALSE(bench.scheduler.worker(30, bench.now_ms).is_set_aside);
}

TEST(SchedulerLosses, PointsAreSuspectNoMoreWhenTheirWorkersComeBack) {
  SchedulerSettings settings;
  settings.tail_batches_per_thread = 0;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(4), {}});
  for (const WorkerId worker : {1U, 2U}) {
    EXPECT_EQ(only<SendBatch>(bench.join_as(std::to_string(worker), worker, 1)).size(), 1U);
    bench.feed(WorkerUnreachable{worker});
  }
  EXPECT_TRUE(bench.join(3, 1).empty()) << "they are suspect, and this one is new";
  const auto given = bench.join_as("1", 4, 0);
  EXPECT_TRUE(only<SendBatch>(given).empty());
  EXPECT_EQ(only<SendBatch>(bench.feed(CreditGiven{4, 1})).size(), 1U);
}

TEST(SchedulerLosses, AWorkerIsNotLostAfterExactlyTheTimeThatItMayBeSilent) {
  SchedulerBench bench;
  bench.feed(WorkerJoined{1, 1});
  for (const std::int64_t step_ms : {900, 900, 900, 100}) {
    bench.now_ms += step_ms;
    EXPECT_TRUE(only<DropWorker>(bench.feed(Tick{})).empty());
  }
  bench.now_ms += 1;
  EXPECT_EQ(only<DropWorker>(bench.feed(Tick{})).size(), 1U);
}

TEST(LossHistory, CountsEachProcessOnceAndTakesItsLossBackWhenItReturns) {
  LossHistory history;
  history.add({1, false});
  history.add({1, false});
  EXPECT_EQ(history.standing({}), Standing::kSound);
  history.add({2, false});
  EXPECT_EQ(history.standing({}), Standing::kSuspect);
  history.add({2, true});
  EXPECT_EQ(history.standing({}), Standing::kAccused);
  EXPECT_TRUE(history.take_back(2));
  EXPECT_FALSE(history.take_back(2));
  EXPECT_EQ(history.standing({}), Standing::kSound);
}

TEST(LossHistory, ThoseWhoLiveOnAreCountedEachTimeAndNotTakenBack) {
  LossHistory history;
  for (int i = 0; i < 3; ++i) {
    history.add({kNobody, true});
  }
  EXPECT_FALSE(history.take_back(kNobody));
  EXPECT_EQ(history.standing({}), Standing::kCondemned);
}

TEST(LossHistory, DoesNotGrowWithoutEnd) {
  LossHistory history;
  for (ProcessNumber process = 1; process < 1000; ++process) {
    history.add({process, false});
  }
  EXPECT_FALSE(history.take_back(999)) << "the first losses made the points suspect";
  history.add({5000, true});
  EXPECT_EQ(history.alone(), 1U);
}

TEST(WorkerProcesses, OfThoseThatAreGoneTheLatestAreRemembered) {
  WorkerProcesses processes(2);
  for (WorkerId worker = 1; worker < 100; ++worker) {
    const std::string id = "process " + std::to_string(worker);
    processes.leave(processes.join(id, worker), worker);
    processes.leave(processes.join("", worker), worker);
    processes.check_invariants();
    EXPECT_LE(processes.size(), 2U);
  }
  EXPECT_EQ(processes.join("process 98", 100), 195U);
  EXPECT_EQ(processes.join("process 2", 101), 199U) << "it was forgotten";
}

}  // namespace
}  // namespace oblique::server
