// Tests that the loss of workers does not make harmless points fail.
#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

/// Makes the new workers 1, 2 and 3 join, get a batch, and disappear without solving a point.
void lose_newcomers(SchedulerBench& bench) {
  for (const WorkerId newcomer : {1U, 2U, 3U}) {
    bench.join(newcomer, 1);
    bench.feed(WorkerUnreachable{newcomer});
  }
}

TEST(SchedulerLosses, PeersThatTakeBatchesAndDisappearUnderNewNamesFailNoPoint) {
  SchedulerBench bench(table_of(2000));
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

TEST(SchedulerLosses, NewWorkersMustSolveAProbeWhileOthersAreLostWithPoints) {
  SchedulerBench bench(table_of(1'000'000));
  for (const WorkerId fake : {1U, 2U, 3U}) {
    EXPECT_FALSE(bench.join(fake, 1).empty());
    bench.feed(WorkerUnreachable{fake});
  }
  const auto effects = bench.join_as("sound", 4, 2);
  EXPECT_TRUE(only<SendBatch>(effects).empty());
  ASSERT_EQ(only<SendProbe>(effects).size(), 1U) << "expected one probe";
  EXPECT_TRUE(bench.scheduler.worker(4, bench.now_ms).is_set_aside);
  EXPECT_FALSE(bench.scheduler.worker(4, bench.now_ms).is_proven);
  EXPECT_FALSE(only<SendBatch>(bench.solve_probe(only<SendProbe>(effects)[0])).empty());
  EXPECT_FALSE(bench.scheduler.worker(4, bench.now_ms).is_set_aside);
  EXPECT_TRUE(bench.scheduler.worker(4, bench.now_ms).is_proven);
  bench.pass(61'000, {4});
  EXPECT_FALSE(bench.join(5, 1).empty())
      << "after a minute without losses a new worker gets batches";
}

TEST(SchedulerLosses, AnUnsolvedProbeIsRepeatedEverySecond) {
  SchedulerBench bench(table_of(1'000'000));
  lose_newcomers(bench);
  const auto probe = only<SendProbe>(bench.join_as("faulty", 4, 10)).at(0);
  const auto failed =
      bench.feed(ResultsReceived{4, kProbeStudy, probe.lease, 1, true, 0.1, {{0, true}}});
  EXPECT_TRUE(only<SendProbe>(failed).empty());
  EXPECT_TRUE(only<SendBatch>(failed).empty());
  EXPECT_EQ(only<SendProbe>(bench.pass(1000, {4})).size(), 1U);
}

TEST(SchedulerLosses, AProbeThatNeverArrivedIsSentAgain) {
  SchedulerBench bench(table_of(1'000'000));
  lose_newcomers(bench);
  const auto probe = only<SendProbe>(bench.join_as("sound", 4, 2)).at(0);
  bench.pass(2750, {4});
  EXPECT_TRUE(bench.feed(HeartbeatReceived{4, {}}).empty()) << "the probe may still be in transit";
  bench.pass(250, {4});
  EXPECT_TRUE(bench.feed(HeartbeatReceived{4, {probe.lease}}).empty());
  EXPECT_EQ(only<SendProbe>(bench.feed(HeartbeatReceived{4, {}})).size(), 1U);
}

TEST(SchedulerLosses, ResultsWithoutALeaseAreNoAnswerToAProbe) {
  SchedulerBench bench(table_of(100));
  bench.join(1, 1);
  bench.feed(ResultsReceived{1, 1, 0, 1, false, 1e-3, {{50, false}}});
  EXPECT_FALSE(bench.scheduler.worker(1, bench.now_ms).is_proven);
}

TEST(SchedulerLosses, AHeartbeatWithLeaseZeroHoldsNoLease) {
  SchedulerBench bench(table_of(1));
  const auto batch = bench.join(1, 1).at(0);
  bench.pass(3000, {1});
  EXPECT_TRUE(bench.feed(HeartbeatReceived{1, {0, batch.lease}}).empty());
  EXPECT_EQ(bench.scheduler.study(1).leased, 1U);
  bench.feed(HeartbeatReceived{1, {0}});
  EXPECT_EQ(bench.scheduler.study(1).leased, 0U) << "the batch did not reach the worker";
}

TEST(SchedulerLosses, ABatchThatCouldNotBeSentMakesNeitherPointsNorWorkerSuspect) {
  SchedulerBench bench(table_of(1));
  for (WorkerId worker = 1; worker <= 20; ++worker) {
    const auto sent = only<SendBatch>(bench.join_as("process", worker, 1));
    ASSERT_EQ(sent.size(), 1U) << "the point is not suspect and the process not set aside";
    EXPECT_EQ(sent[0].attempt, worker);
    bench.feed(WorkerUnreachable{worker, "gone", {sent[0].lease}});
  }
}

TEST(SchedulerLosses, OnlySentBatchesOfALostWorkerCountAsLost) {
  SchedulerBench bench(table_of(100));
  const auto sent = bench.join(1, 2);
  ASSERT_EQ(sent.size(), 2U);
  bench.feed(WorkerUnreachable{1, "gone", {sent[1].lease, 12'345}});
  EXPECT_EQ(bench.scheduler.study(1).leased, 0U);
  const auto again = bench.join(2, 1);
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].attempt, 2U);
}

TEST(SchedulerLosses, AWorkerHoldsAtMostTwoBatchesMoreThanItHasSolved) {
  SchedulerBench bench(table_of(1'000'000));
  const auto first = bench.join(1, 1000);
  ASSERT_EQ(first.size(), 2U);
  const auto second = only<SendBatch>(bench.solve(first[0]));
  EXPECT_EQ(second.size(), 2U) << "the worker then holds three batches";
  EXPECT_EQ(only<SendBatch>(bench.solve(second.at(0))).size(), 2U)
      << "the worker then holds four batches";
}

TEST(SchedulerLosses, AProcessLostThreeTimesInARowIsSetAsideUntilItSolvesAProbe) {
  SchedulerBench bench(table_of(1'000'000));
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

TEST(SchedulerLosses, ABatchThatEndsWithOpenPointsIsALossAndACompletelyAnsweredOneIsNot) {
  SchedulerBench bench(table_of(1'000'000));
  const SendBatch batch = bench.join(1, 1).at(0);
  ResultsReceived answers{1, 1, batch.lease, 1, false, 1e-3, {}};
  for (std::uint64_t i = 0; i < batch.count(); ++i) {
    answers.outcomes.push_back({batch.first_point() + i, false});
  }
  bench.feed(answers);
  bench.feed(ResultsReceived{1, 1, batch.lease, 2, true, 0.0, {}});
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 0U);
  const SendBatch second = only<SendBatch>(bench.feed(CreditGiven{1, 1})).at(0);
  bench.feed(ResultsReceived{1, 1, second.lease, 3, true, 0.0, {}});
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 1U);
}

TEST(SchedulerLosses, ANewConnectionOfAProcessEndsItsOldOneAtOnce) {
  SchedulerBench bench(table_of(1));
  const auto lost = only<SendBatch>(bench.join_as("one", 1, 1)).at(0);
  const auto effects = bench.join_as("one", 2, 1);
  ASSERT_EQ(only<DropWorker>(effects).size(), 1U);
  EXPECT_EQ(only<DropWorker>(effects)[0].worker, 1U);
  ASSERT_EQ(only<SendBatch>(effects).size(), 1U);
  EXPECT_EQ(only<SendBatch>(effects)[0].first_point(), lost.first_point());
}

TEST(SchedulerLosses, ANewWorkerThatReconnectsIsNotLost) {
  SchedulerBench bench(table_of(1'000'000));
  // Four processes each get a batch and reconnect. The new connection replaces the old connection.
  for (const WorkerId worker : {1U, 2U, 3U, 4U}) {
    const std::string process = "sound " + std::to_string(worker);
    ASSERT_EQ(only<SendBatch>(bench.join_as(process, worker, 1)).size(), 1U);
    bench.join_as(process, worker + 10, 0);
  }
  EXPECT_EQ(only<SendBatch>(bench.join_as("another", 30, 1)).size(), 1U);
  EXPECT_FALSE(bench.scheduler.worker(30, bench.now_ms).is_set_aside);
}

TEST(SchedulerLosses, PointsAreNoLongerSuspectWhenTheirWorkersReturn) {
  SchedulerSettings settings;
  settings.tail_batches_per_thread = 0;
  SchedulerBench bench(table_of(4), settings);
  for (const WorkerId worker : {1U, 2U}) {
    EXPECT_EQ(only<SendBatch>(bench.join_as(std::to_string(worker), worker, 1)).size(), 1U);
    bench.feed(WorkerUnreachable{worker});
  }
  EXPECT_TRUE(bench.join(3, 1).empty()) << "a new worker gets no suspect points";
  const auto given = bench.join_as("1", 4, 0);
  EXPECT_TRUE(only<SendBatch>(given).empty());
  EXPECT_EQ(only<SendBatch>(bench.feed(CreditGiven{4, 1})).size(), 1U);
}

TEST(SchedulerLosses, AWorkerIsNotLostAfterExactlyItsLongestSilence) {
  SchedulerBench bench;
  bench.feed(WorkerJoined{1, 1});
  for (const std::int64_t step_ms : {900, 900, 900, 100}) {
    bench.now_ms += step_ms;
    EXPECT_TRUE(only<DropWorker>(bench.feed(Tick{})).empty());
  }
  bench.now_ms += 1;
  EXPECT_EQ(only<DropWorker>(bench.feed(Tick{})).size(), 1U);
}

TEST(WorkerProcesses, TheLatestAbsentProcessesAreKept) {
  WorkerProcesses processes(2);
  for (WorkerId worker = 1; worker < 100; ++worker) {
    const std::string id = "process " + std::to_string(worker);
    processes.leave(processes.join(id, worker), worker);
    processes.leave(processes.join("", worker), worker);
    processes.check_invariants(0);
    EXPECT_LE(processes.size(), 2U);
  }
  EXPECT_EQ(processes.join("process 98", 100), 195U);
  EXPECT_EQ(processes.join("process 2", 101), 199U) << "the process was removed from the list";
}

// ---- Points that kill workers ----

/// Simulates a supervisor that starts a new worker process whenever a process dies. A worker dies
/// when it solves a batch that contains a harmful point.
class Supervised {
 public:
  Supervised(SchedulerBench& bench, std::set<std::uint64_t> killers, std::uint32_t prefetch,
             const protocol::PointTable* table = nullptr)
      : bench_(bench), killers_(std::move(killers)), prefetch_(prefetch), table_(table) {}

  void run() {
    while (!finished && deaths < 1000) {
      ++worker_;
      held_.clear();
      take(bench_.join_as("process " + std::to_string(worker_), worker_, prefetch_));
      while (!finished && live()) {
      }
    }
  }

  std::map<std::uint64_t, std::string> failed;  ///< reasons
  int deaths = 0;
  bool finished = false;

 private:
  /// Lets the worker solve its probe or its next batch, or wait. Returns false if the worker dies.
  bool live() {
    if (probe_) {
      take(bench_.solve_probe(*std::exchange(probe_, std::nullopt)));
    } else if (held_.empty()) {
      take(bench_.pass(250, {worker_}));
    } else {
      const SendBatch batch = held_.front();
      held_.pop_front();
      const bool kills = std::ranges::any_of(batch.points, [&](const Interval& range) {
        const auto killer = killers_.lower_bound(range.begin);
        return killer != killers_.end() && *killer < range.end;
      });
      if (kills) {
        ++deaths;
        take(bench_.feed(WorkerUnreachable{worker_}));
        return false;
      }
      take(bench_.solve_and_store(batch, 1e-6, table_));
      take(bench_.feed(CreditGiven{worker_, 1}));
    }
    return true;
  }

  void take(const std::vector<Effect>& effects) {
    for (const auto& batch : only<SendBatch>(effects)) {
      held_.push_back(batch);
    }
    for (const auto& probe : only<SendProbe>(effects)) {
      probe_ = probe;
    }
    for (const auto& failure : only<StoreFailure>(effects)) {
      failed[failure.point] = failure.reason;
      take(bench_.feed(ResultsStored{0, failure.study, 0, {{failure.point, true}}}));
    }
    finished = finished || !only<StudyFinished>(effects).empty();
  }

  SchedulerBench& bench_;
  std::set<std::uint64_t> killers_;
  std::uint32_t prefetch_;
  const protocol::PointTable* table_;
  WorkerId worker_ = 0;
  std::deque<SendBatch> held_;
  std::optional<SendProbe> probe_;
};

TEST(SchedulerSuspects, HarmfulPointsAreFoundWithFewLostWorkersInAnyStudy) {
  const auto table = [](const protocol::Recipe& recipe) {
    return std::make_shared<const protocol::PointTable>(recipe);
  };
  const auto mu = protocol::range("mu", 0.0, 1.0, 1000);
  const auto H = protocol::listed("H", {1.0});
  const auto e = protocol::listed("e", {1.0});
  for (const auto& points :
       {table_of(1000),
        table(protocol::recipe_of_blocks(
            {protocol::filtered({H, mu, e}, "floor(999 * mu / 2) != 999 * mu / 2")})),
        table(protocol::recipe_of(
            {{protocol::range("E", 6e10, 7e10, 1000), H, protocol::listed("mu", {0.4}), e}})),
        table(protocol::sample_with_falls(1000, 4, protocol::SAMPLE_LATIN_HYPERCUBE))}) {
    SchedulerSettings settings;
    settings.first_batch_points = 64;
    SchedulerBench bench(points, settings);
    const std::set<std::uint64_t> killers{137, 777};
    Supervised supervised(bench, killers, 3, points.get());
    supervised.run();
    // Each harmful point kills at most nine workers: two until it is suspect, four while the
    // scheduler divides 1000 points by eight, and three when the point is alone.
    EXPECT_LE(supervised.deaths, 2 * (2 + 4 + 3));
    ASSERT_EQ(supervised.failed.size(), 2U);
    EXPECT_TRUE(supervised.failed.contains(137) && supervised.failed.contains(777));
    EXPECT_NE(supervised.failed[137].find("worker was lost"), std::string::npos);
    const StudyCounts counts = bench.scheduler.study(1);
    EXPECT_EQ(counts.solved() + counts.left_out, 998U);
  }
}

TEST(SchedulerSuspects, AStudyOfOneHarmfulPointEndsToo) {
  // The study has no second point with which a worker could show that it works. So each worker must
  // first solve an easy point of the probe study.
  SchedulerBench bench(table_of(1));
  Supervised supervised(bench, {0}, 2);
  supervised.run();
  EXPECT_TRUE(supervised.finished);
  EXPECT_LE(supervised.deaths, 2 + 3);
  EXPECT_EQ(supervised.failed.size(), 1U);
}

/// Provides proven workers (each has solved a point) and open points.
class SuspectTest : public testing::Test {
 protected:
  /// Lets each of the workers 1 to `workers` solve one point of a study. `left` points of the study
  /// remain open.
  void prove(WorkerId workers, std::uint64_t left) {
    bench_.feed(StudyAdded{1, table_of(workers + left), {}});
    for (WorkerId worker = 1; worker <= workers; ++worker) {
      bench_.solve_and_store(batches(bench_.join_as(name(worker), worker, 1)).at(0));
      bench_.now_ms += 10;
    }
  }
  static std::string name(WorkerId worker) { return "process " + std::to_string(worker); }
  static std::vector<SendBatch> batches(const std::vector<Effect>& effects) {
    return only<SendBatch>(effects);
  }
  std::vector<SendBatch> credit(WorkerId worker) {
    return batches(bench_.feed(CreditGiven{worker, 1}));
  }
  static SchedulerSettings settings() {
    SchedulerSettings settings;
    settings.first_batch_points = 1;
    settings.largest_batch_points = 1;
    return settings;
  }

  SchedulerBench bench_{settings()};
};

TEST_F(SuspectTest, APointFailsAfterThreeProvenWorkersWereLostWithItAloneAndNoneReturned) {
  prove(3, 1);
  for (const WorkerId worker : {1U, 2U, 3U}) {
    EXPECT_EQ(credit(worker).size(), 1U) << worker;
    EXPECT_TRUE(only<StoreFailure>(bench_.feed(WorkerUnreachable{worker})).empty());
  }
  EXPECT_TRUE(only<StoreFailure>(bench_.pass(9750)).empty())
      << "one of the workers may still return";
  const auto failures = only<StoreFailure>(bench_.pass(250));
  ASSERT_EQ(failures.size(), 1U);
  EXPECT_EQ(failures[0].point, 3U);
  EXPECT_EQ(failures[0].attempt, 3U);
}

TEST_F(SuspectTest, APointDoesNotFailWhenOneOfItsThreeWorkersReturns) {
  prove(3, 1);
  for (const WorkerId worker : {1U, 2U, 3U}) {
    credit(worker);
    bench_.feed(WorkerUnreachable{worker});
  }
  bench_.pass(5000);
  const auto again = batches(bench_.join_as(name(2), 12, 1));
  ASSERT_EQ(again.size(), 1U) << "the worker is still proven";
  EXPECT_TRUE(only<StoreFailure>(bench_.pass(20'000, {12})).empty());
  bench_.solve_and_store(again[0]);
  EXPECT_EQ(bench_.scheduler.study(1).solved(), 4U);
}

TEST_F(SuspectTest, RepeatedLossesOfOneProcessDoNotFailAPoint) {
  prove(1, 1);
  credit(1);
  bench_.feed(WorkerUnreachable{1});
  for (WorkerId worker = 2; worker < 20; ++worker) {
    auto effects = bench_.join_as(name(1), worker, 1);
    const auto probes = only<SendProbe>(effects);
    if (!probes.empty()) {
      effects = bench_.solve_probe(probes[0]);
    }
    ASSERT_EQ(batches(effects).size(), 1U);
    EXPECT_TRUE(only<StoreFailure>(bench_.feed(WorkerUnreachable{worker})).empty());
  }
  EXPECT_TRUE(only<StoreFailure>(bench_.pass(60'000)).empty());
}

TEST_F(SuspectTest, TheLossOfAWorkerWithTwoPointsMakesNeitherPointRisky) {
  prove(5, 2);
  for (WorkerId worker = 1; worker <= 5; ++worker) {
    bench_.feed(CreditGiven{worker, 2});
    bench_.feed(WorkerUnreachable{worker});
    // The process returns, so neither point becomes suspect and the next worker gets both.
    bench_.join_as(name(worker), worker + 10, 0);
  }
  EXPECT_TRUE(only<StoreFailure>(bench_.pass(60'000)).empty());
}

TEST_F(SuspectTest, ARiskyPointIsReservedForTheLongestProvenWorkerForSomeSeconds) {
  for (const bool comes : {true, false}) {
    bench_ = SchedulerBench(settings());
    prove(3, 1);
    credit(3);
    bench_.feed(WorkerUnreachable{3});
    EXPECT_TRUE(credit(2).empty());
    if (comes) {
      EXPECT_EQ(credit(1).size(), 1U);
      continue;
    }
    EXPECT_TRUE(batches(bench_.pass(9750, {1, 2})).empty());
    const auto given = batches(bench_.pass(250, {1, 2}));
    ASSERT_EQ(given.size(), 1U);
    EXPECT_EQ(given[0].worker, 2U);
  }
}

TEST(SchedulerSuspects, SuspectPointsGoToAProvenWorkerThatHoldsNothingElse) {
  SchedulerBench bench(table_of(1000));
  // After two lost workers the points of their batches are suspect.
  for (const WorkerId worker : {1U, 2U}) {
    EXPECT_EQ(bench.join(worker, 2).size(), 2U);
    bench.pass(3250);
  }
  const auto fresh = bench.join(3, 5);
  ASSERT_EQ(fresh.size(), 2U) << "a new worker gets only two of the other batches";
  EXPECT_EQ(fresh[0].attempt, 1U);
  bench.solve(fresh[0]);
  const auto suspect = only<SendBatch>(bench.solve(fresh[1]));
  ASSERT_EQ(suspect.size(), 1U);
  EXPECT_EQ(suspect[0].attempt, 3U);
  EXPECT_EQ(suspect[0].first_point(), 0U);
}

TEST(SchedulerSuspects, ThePartsOfASplitIntervalStaySuspect) {
  SchedulerSettings settings;
  settings.first_batch_points = 32;
  settings.tail_batches_per_thread = 0;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(33), IntervalSet(32, 33)});
  for (const WorkerId worker : {1U, 2U}) {
    EXPECT_EQ(bench.join(worker, 2).at(0).count(), 32U);
    bench.feed(WorkerUnreachable{worker});
  }
  for (const WorkerId worker : {3U, 4U}) {
    const auto probe = only<SendProbe>(bench.join_as("", worker, 2)).at(0);
    const auto part = only<SendBatch>(bench.solve_probe(probe));
    ASSERT_EQ(part.size(), 1U) << "a suspect batch is sent alone although two were requested";
    EXPECT_EQ(part[0].count(), worker == 3 ? 4U : 1U);
    bench.feed(WorkerUnreachable{worker});
  }
}

TEST(SchedulerSuspects, ABusyWorkerFinishesItsBatchesBeforeItGetsSuspectPoints) {
  SchedulerBench bench(table_of(100'000));
  bench.join(1, 1);
  bench.pass(3250);
  const auto second = bench.join(2, 1).at(0);
  EXPECT_EQ(second.attempt, 2U);
  const auto busy = bench.join(3, 2);  // worker 3 holds two ordinary batches
  ASSERT_EQ(busy.size(), 2U);
  std::deque<SendBatch> held(busy.begin(), busy.end());
  bench.pass(3250, {3});  // worker 2 is lost, so its points are suspect
  EXPECT_FALSE(bench.scheduler.has_worker(2));
  bool suspect_was_leased = false;
  for (int i = 0; i < 200 && !held.empty() && !suspect_was_leased; ++i) {
    const auto batch = held.front();
    held.pop_front();
    const auto solved = bench.solve(batch);
    const auto given = bench.feed(CreditGiven{3, 1});
    for (const auto& effects : {solved, given}) {
      for (const auto& next : only<SendBatch>(effects)) {
        suspect_was_leased = suspect_was_leased || next.first_point() == second.first_point();
        held.push_back(next);
      }
    }
  }
  EXPECT_TRUE(suspect_was_leased);
}

TEST_F(SuspectTest, AWorkerThatFinishesBatchesWithoutResultsGetsOnlyThreeBatches) {
  prove(1, 1);
  auto effects = bench_.feed(CreditGiven{1, 1});
  int rounds = 0;
  for (; !batches(effects).empty() && rounds < 100; ++rounds) {
    const auto batch = batches(effects).at(0);
    bench_.feed(ResultsReceived{1, 1, batch.lease, ++bench_.sequence, true, 0.1, {}});
    effects = bench_.feed(CreditGiven{1, 1});
  }
  EXPECT_EQ(rounds, 3);
  EXPECT_EQ(only<StoreFailure>(bench_.pass(10'000, {1})).size(), 1U);
}

}  // namespace
}  // namespace oblique::server
