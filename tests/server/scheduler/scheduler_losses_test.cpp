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
    for (const auto& batch : only<SendBatch>(effects)) {
      if (batch.worker == 1) {
        SchedulerBench::append(next, bench.solve_and_store(batch));
        SchedulerBench::append(next, bench.feed(CreditGiven{1, 1}));
      }
    }
    finished = !only<StudyFinished>(next).empty();
    effects = std::move(next);
  }
  EXPECT_EQ(failures, 0U);
  EXPECT_TRUE(finished);
  EXPECT_EQ(bench.scheduler.study(1).solved(), 2000U);
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

TEST(SchedulerLosses, ABatchThatCouldNotBeSentIsNoLoss) {
  SchedulerBench bench(table_of(1));
  for (WorkerId worker = 1; worker <= 20; ++worker) {
    const auto sent = only<SendBatch>(bench.join_as("process", worker, 1));
    ASSERT_EQ(sent.size(), 1U) << worker;
    EXPECT_EQ(bench.scheduler.worker(worker, bench.now_ms).losses, 0U);
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

// ---- Points that crash solvers ----

constexpr int kCrash = 11;
constexpr int kKill = 9;

std::string process_of(WorkerId worker) {
  return "process " + std::to_string(worker);
}

/// Simulates workers whose parents start a new process whenever one crashes. A process solves the
/// points of a batch in groups of eight and crashes when a group contains a harmful point.
class Supervised {
 public:
  Supervised(SchedulerBench& bench, std::set<std::uint64_t> killers, std::uint32_t prefetch,
             const protocol::PointTable* table = nullptr)
      : bench_(bench), killers_(std::move(killers)), prefetch_(prefetch), table_(table) {}

  /// Lets `workers` processes work at a time, in turn.
  void run(std::size_t workers = 1) {
    for (std::size_t i = 0; i < workers; ++i) {
      start(std::nullopt);
    }
    for (int turn = 0; turn < 100'000 && !finished; ++turn) {
      live(std::next(held_.begin(), turn % static_cast<int>(workers))->first);
    }
  }

  std::map<std::uint64_t, std::string> failed;  ///< reasons
  int crashes = 0;
  bool finished = false;

 private:
  void start(const std::optional<EndedProcess>& replaced) {
    const WorkerId worker = ++last_worker_;
    held_[worker];
    take(bench_.join_as(process_of(worker), worker, prefetch_, replaced));
  }

  void live(WorkerId worker) {
    if (held_[worker].empty()) {
      take(bench_.pass(250, {worker}));
      return;
    }
    const SendBatch batch = held_[worker].front();
    held_[worker].pop_front();
    std::vector<std::uint64_t> group;
    for (const PointOutcome& outcome : bench_.answer_to(batch, 0.0, table_).outcomes) {
      group.push_back(outcome.point);
      if (batch.study == 1 && killers_.contains(outcome.point)) {
        ++crashes;
        EndedProcess ended{process_of(worker), kCrash};
        for (std::size_t i = group.size() - std::min<std::size_t>(8, group.size());
             i < group.size(); ++i) {
          ended.points.emplace(batch.study, group[i]);
        }
        held_.erase(worker);
        take(bench_.feed(WorkerUnreachable{worker}));
        start(ended);
        return;
      }
    }
    take(bench_.solve_and_store(batch, 1e-6, table_));
    take(bench_.feed(CreditGiven{worker, 1}));
  }

  void take(const std::vector<Effect>& effects) {
    for (const Effect& effect : effects) {
      if (const auto* batch = std::get_if<SendBatch>(&effect)) {
        held_[batch->worker].push_back(*batch);
      } else if (const auto* released = std::get_if<ReleaseBatch>(&effect)) {
        std::erase_if(held_[released->worker], [&](const SendBatch& batch_held) {
          return batch_held.lease == released->lease;
        });
        take(bench_.feed(CreditGiven{released->worker, 1}));
      } else if (const auto* failure = std::get_if<StoreFailure>(&effect)) {
        failed[failure->point] = failure->reason;
        take(bench_.feed(ResultsStored{0, failure->study, 0, {{failure->point, true}}}));
      } else if (const auto* end = std::get_if<StudyFinished>(&effect)) {
        finished = finished || end->study == 1;
      }
    }
  }

  SchedulerBench& bench_;
  std::set<std::uint64_t> killers_;
  std::uint32_t prefetch_;
  const protocol::PointTable* table_;
  WorkerId last_worker_ = 0;
  std::map<WorkerId, std::deque<SendBatch>> held_;
};

TEST(SchedulerCrashes, AHarmfulPointAmong4096CostsAtMostFourCrashes) {
  for (const std::size_t workers : {1U, 2U, 5U}) {
    SchedulerBench bench(table_of(4096));
    Supervised supervised(bench, {1234}, 2);
    supervised.run(workers);
    EXPECT_LE(supervised.crashes, 4) << workers;
    ASSERT_EQ(supervised.failed.size(), 1U);
    EXPECT_EQ(supervised.failed[1234], "the solver crashed on this point: signal 11, twice");
    EXPECT_EQ(bench.scheduler.study(1).solved(), 4095U);
  }
}

TEST(SchedulerCrashes, HarmfulPointsAreFoundInAnyStudy) {
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
    Supervised supervised(bench, {137, 777}, 3, points.get());
    supervised.run();
    EXPECT_LE(supervised.crashes, 2 * 3) << "one in a batch and two alone for each point";
    ASSERT_EQ(supervised.failed.size(), 2U);
    EXPECT_TRUE(supervised.failed.contains(137) && supervised.failed.contains(777));
    const StudyCounts counts = bench.scheduler.study(1);
    EXPECT_EQ(counts.solved() + counts.left_out, 998U);
  }
}

TEST(SchedulerCrashes, AStudyOfOneHarmfulPointCostsTwoCrashes) {
  SchedulerBench bench(table_of(1));
  Supervised supervised(bench, {0}, 2);
  supervised.run();
  EXPECT_TRUE(supervised.finished);
  EXPECT_EQ(supervised.crashes, 2);
  EXPECT_EQ(supervised.failed.size(), 1U);
}

/// Provides a study of 100 points. Worker 1 holds its first batch, of four points.
class CrashTest : public testing::Test {
 protected:
  static std::vector<SendBatch> batches(const std::vector<Effect>& effects) {
    return only<SendBatch>(effects);
  }
  static EndedProcess crash(WorkerId worker, std::set<std::uint64_t> points, int signal = kCrash) {
    EndedProcess ended{process_of(worker), signal};
    for (const std::uint64_t point : points) {
      ended.points.emplace(1, point);
    }
    return ended;
  }
  /// Ends the connection of a worker, whose parent starts another process as `next`. Returns the
  /// batches of the new process.
  std::vector<SendBatch> replace(WorkerId worker, WorkerId next, const EndedProcess& ended) {
    effects_ = bench_.feed(WorkerUnreachable{worker});
    SchedulerBench::append(effects_, bench_.join_as(process_of(next), next, 1, ended));
    auto given = batches(effects_);
    if (worker > 1 && !given.empty() && given[0].first_point() != 2) {
      bench_.solve_and_store(
          given[0]);  // after a loss with a suspect point, other points come first
      given = batches(bench_.feed(CreditGiven{next, 1}));
    }
    return given;
  }
  std::vector<StoreFailure> failures() const { return only<StoreFailure>(effects_); }

  SchedulerBench bench_{table_of(100)};
  SendBatch first_ = batches(bench_.join_as(process_of(1), 1, 1)).at(0);
  std::vector<Effect> effects_;  // of the last call of `replace`
};

TEST_F(CrashTest, ReportedPointsAreLeasedOneAtATimeAndFirst) {
  auto next = replace(1, 2, crash(1, {1, 3}));
  for (const std::uint64_t point : {1U, 3U}) {
    ASSERT_EQ(next.size(), 1U);
    EXPECT_EQ(next[0].first_point(), point);
    EXPECT_EQ(next[0].count(), 1U);
    EXPECT_EQ(next[0].attempt, 2U);
    EXPECT_TRUE(bench_.feed(CreditGiven{2, 1}).empty()) << "the worker holds a suspect point";
    next = batches(bench_.solve_and_store(next[0]));
  }
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0].first_point(), 0U);
}

TEST_F(CrashTest, AReportIsAcceptedBeforeTheLossOfTheProcessIsNoticed) {
  const auto effects = bench_.join_as(process_of(2), 2, 1, crash(1, {2}));
  ASSERT_EQ(only<DropWorker>(effects).size(), 1U);
  EXPECT_EQ(only<DropWorker>(effects)[0].worker, 1U);
  EXPECT_EQ(batches(effects).at(0).first_point(), 2U);
  EXPECT_EQ(bench_.scheduler.worker(2, bench_.now_ms).losses, 1U);
}

TEST_F(CrashTest, AReportThatIsRepeatedCountsOnce) {
  const EndedProcess report = crash(1, {2});
  SendBatch alone = replace(1, 2, report).at(0);
  const EndedProcess second = crash(2, {2});
  alone = replace(2, 3, second).at(0);
  for (WorkerId worker = 4; worker < 10; ++worker) {  // the process reconnects
    effects_ = bench_.join_as(process_of(3), worker, 1, second);
    ASSERT_EQ(batches(effects_).size(), 1U);
    EXPECT_EQ(batches(effects_)[0].first_point(), 2U);
    EXPECT_TRUE(failures().empty());
  }
}

TEST_F(CrashTest, AReportOfPointsThatTheProcessDidNotHoldIsIgnored) {
  const auto next = replace(1, 2, crash(1, {50, 99, 100, UINT64_MAX}));
  EXPECT_EQ(next.at(0).count(), 4U);
  EndedProcess other{"another process", kCrash};
  other.points.emplace(1, 0);
  bench_.join_as("malicious", 7, 1, other);
  EXPECT_EQ(batches(bench_.solve_and_store(next[0])).size(), 0U);
  EXPECT_EQ(bench_.scheduler.study(1).solved(), 4U);
}

TEST_F(CrashTest, AReportOfSolvedPointsOrOfADeletedStudyIsIgnored) {
  bench_.store(ResultsReceived{1, 1, first_.lease, 1, false, 1e-3, {{2, false}}});
  EXPECT_EQ(replace(1, 2, crash(1, {2})).at(0).count(), 2U) << "points 0 and 1 are one batch";
  bench_.feed(WorkerUnreachable{2});
  bench_.feed(StudyRemoved{1});
  EXPECT_TRUE(bench_.join_as(process_of(3), 3, 1, crash(2, {0})).empty());
}

TEST_F(CrashTest, AWorkerThatGotTheReportedPointsMeanwhileMustDropThem) {
  bench_.join_as("other", 5, 1);
  bench_.feed(CreditGiven{5, 1});
  const auto taken = batches(bench_.feed(WorkerUnreachable{1}));
  bench_.feed(WorkerLeft{5});
  const auto again = batches(bench_.join_as("third", 6, 1));
  ASSERT_EQ(again.at(0).first_point(), 0U);
  const auto effects = bench_.join_as(process_of(2), 2, 1, crash(1, {2}));
  ASSERT_EQ(only<ReleaseBatch>(effects).size(), 1U);
  EXPECT_EQ(only<ReleaseBatch>(effects)[0].lease, again[0].lease);
  EXPECT_EQ(batches(effects).at(0).first_point(), 2U);
}

TEST_F(CrashTest, APointFailsAtTheSecondCrashThatItHadAloneAndAKillDoesNotCount) {
  WorkerId worker = 1;
  SendBatch alone = replace(1, 2, crash(1, {2})).at(0);
  for (worker = 2; worker < 6; ++worker) {  // killed from outside
    alone = replace(worker, worker + 1, crash(worker, {}, kKill)).at(0);
    EXPECT_EQ(alone.first_point(), 2U);
  }
  alone = replace(6, 7, crash(6, {2}, 6)).at(0);
  EXPECT_EQ(alone.first_point(), 2U);
  EXPECT_TRUE(failures().empty());
  replace(7, 8, crash(7, {2}));
  ASSERT_EQ(failures().size(), 1U);
  EXPECT_EQ(failures()[0].point, 2U);
  EXPECT_EQ(failures()[0].reason, "the solver crashed on this point: signal 6, then 11");
  EXPECT_EQ(failures()[0].attempt, 7U);
}

TEST_F(CrashTest, APointWhoseResultHasArrivedDoesNotFail) {
  SendBatch alone = replace(1, 2, crash(1, {2})).at(0);
  alone = replace(2, 3, crash(2, {2})).at(0);
  bench_.feed(WorkerUnreachable{3});
  bench_.join_as("another", 9, 1);
  bench_.feed(ResultsReceived{9, 1, 0, 1, false, 1e-3, {{2, false}}});
  effects_ = bench_.join_as(process_of(4), 4, 0, crash(3, {2}));
  EXPECT_TRUE(failures().empty());
}

TEST_F(CrashTest, AnotherStudyContinuesWhileEachPointOfAStudyCrashesTheSolver) {
  SchedulerBench bench(table_of(50));
  bench.feed(StudyAdded{2, table_of(2000), {}});
  std::set<std::uint64_t> all;
  for (std::uint64_t point = 0; point < 50; ++point) {
    all.insert(point);
  }
  Supervised supervised(bench, all, 2);
  supervised.run();
  EXPECT_GT(bench.scheduler.study(2).solved(), 200U);
  EXPECT_EQ(supervised.failed.size(), 50U);
}

TEST_F(CrashTest, ASuspectPointWaitsForAWorkerThatHoldsNothing) {
  const auto busy = bench_.join(9, 2);
  ASSERT_EQ(busy.size(), 2U);
  EXPECT_EQ(replace(1, 2, crash(1, {2})).size(), 1U);
  bench_.feed(WorkerUnreachable{2});
  EXPECT_TRUE(batches(bench_.solve(busy[0])).empty());
  EXPECT_TRUE(batches(bench_.feed(CreditGiven{9, 2})).empty()) << "the worker holds a batch";
  const auto next = batches(bench_.solve(busy[1]));
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0].first_point(), 2U);
}

// ---- Points that end whole machines ----

/// Provides a study of one point, and workers that are lost with it.
class LostMachines : public testing::Test {
 protected:
  /// Lets a new worker get the point and be lost after `after_ms`.
  std::vector<StoreFailure> lose(std::int64_t after_ms) {
    ++worker_;
    EXPECT_EQ(only<SendBatch>(bench_.join_as(process_of(worker_), worker_, 1)).size(), 1U);
    bench_.now_ms += after_ms;
    return only<StoreFailure>(bench_.feed(WorkerUnreachable{worker_}));
  }
  /// Loses workers until a point fails, at most `most`. Returns their number.
  int losses_until_failure(std::int64_t after_ms, int most) {
    for (int losses = 1; losses <= most; ++losses) {
      if (const auto failures = lose(after_ms); !failures.empty()) {
        reason_ = failures[0].reason;
        return losses;
      }
    }
    return most + 1;
  }

  static constexpr std::int64_t kMinute_ms = 60'000;
  SchedulerBench bench_{table_of(1)};
  WorkerId worker_ = 0;
  std::string reason_;
};

TEST_F(LostMachines, APointFailsAfterFiveLossesAndTwentyThatItHadAlone) {
  EXPECT_EQ(losses_until_failure(kMinute_ms, 100), 5 + 20);
  EXPECT_EQ(reason_, "20 workers in a row were lost while they held only this point");
}

TEST_F(LostMachines, APointDoesNotFailWithinTenMinutes) {
  EXPECT_EQ(losses_until_failure(1000, 1000), 5 + 601);
}

TEST_F(LostMachines, AWorkerThatReturnsOrLeavesEndsTheRow) {
  for (const bool returns : {true, false}) {
    for (int round = 0; round < 5; ++round) {
      ASSERT_EQ(losses_until_failure(kMinute_ms, 19), 20);
      if (returns) {
        bench_.join_as(process_of(worker_), worker_ + 1000, 0);
        bench_.feed(WorkerLeft{worker_ + 1000});
      } else {
        bench_.join(999 - static_cast<WorkerId>(round), 1);
        bench_.feed(WorkerLeft{999 - static_cast<WorkerId>(round)});
      }
    }
  }
}

TEST_F(LostMachines, AWorkerThatReturnsEndsTheRowAlthoughAnotherHoldsThePoint) {
  ASSERT_EQ(losses_until_failure(kMinute_ms, 24), 25);
  const SendBatch batch = bench_.join(1000, 1).at(0);
  bench_.join_as(process_of(worker_), 1001, 0);
  EXPECT_TRUE(only<StoreFailure>(bench_.feed(WorkerUnreachable{1000})).empty());
}

TEST(SchedulerLosses, FiveLossesOfABatchMakeItsPointsBeLeasedAlone) {
  SchedulerBench bench(table_of(1'000'000));
  for (WorkerId worker = 1; worker <= 5; ++worker) {
    EXPECT_EQ(bench.join(worker, 1).at(0).count(), 4U);
    bench.feed(WorkerUnreachable{worker});
  }
  auto batch = bench.join(6, 2);
  for (std::uint64_t point = 0; point < 4; ++point) {
    ASSERT_EQ(batch.size(), 1U);
    EXPECT_EQ(batch[0].first_point(), point);
    EXPECT_EQ(batch[0].count(), 1U);
    auto effects = bench.solve_and_store(batch[0]);
    SchedulerBench::append(effects, bench.feed(CreditGiven{6, 1}));
    batch = only<SendBatch>(effects);
  }
}

TEST(SchedulerLosses, FiveHundredKilledWorkersFailNoPoint) {
  // Two workers at a time, each with a life of 0.3 to 0.9 s, in which it solves at most one of its
  // points.
  SchedulerBench bench(table_of(200));
  std::size_t failures = 0;
  bool finished = false;
  std::map<WorkerId, SendBatch> held;
  const auto take = [&](const std::vector<Effect>& effects) {
    failures += only<StoreFailure>(effects).size();
    finished = finished || !only<StudyFinished>(effects).empty();
    for (const SendBatch& batch : only<SendBatch>(effects)) {
      held.insert_or_assign(batch.worker, batch);
    }
  };
  WorkerId worker = 0;
  for (int kills = 0; kills < 500; ++kills) {
    ++worker;
    take(bench.join_as(process_of(worker), worker, 1));
    take(bench.pass(250 + 250 * (kills % 3), {worker, worker - 1}));
    if (const auto batch = held.find(worker); batch != held.end() && kills % 4 == 0) {
      take(bench.store(ResultsReceived{worker,
                                       1,
                                       batch->second.lease,
                                       ++bench.sequence,
                                       false,
                                       0.1,
                                       {{batch->second.first_point(), false}}}));
    }
    if (worker > 1) {
      take(bench.feed(WorkerUnreachable{worker - 1}));
    }
  }
  EXPECT_EQ(failures, 0U);
  EXPECT_GT(bench.scheduler.study(1).solved(), 50U);
}

TEST(SchedulerLosses, AWorkerThatFinishesABatchWithoutResultsGetsNoneForAMinute) {
  SchedulerBench bench(table_of(100));
  const SendBatch batch = bench.join(1, 1).at(0);
  const auto end = [&](const SendBatch& unsolved) {
    bench.feed(ResultsReceived{1, 1, unsolved.lease, ++bench.sequence, true, 0.1, {}});
    return only<SendBatch>(bench.feed(CreditGiven{1, 1}));
  };
  EXPECT_TRUE(end(batch).empty());
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).state, WorkerState::kStalled);
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 1U);
  EXPECT_TRUE(only<SendBatch>(bench.pass(59'000, {1})).empty());
  EXPECT_EQ(only<SendBatch>(bench.pass(1000, {1})).size(), 1U);
}

TEST(SchedulerLosses, ALimitedNumberOfLostProcessesIsKept) {
  SchedulerSettings settings;
  settings.most_lost_processes = 3;
  SchedulerBench bench(table_of(1'000'000), settings);
  for (WorkerId worker = 1; worker <= 10; ++worker) {
    bench.join_as(process_of(worker), worker, 1);
    bench.feed(WorkerUnreachable{worker});
  }
  std::uint64_t kept = 0;
  for (WorkerId worker = 1; worker <= 10; ++worker) {
    bench.join_as(process_of(worker), 100 + worker, 0);
    kept += bench.scheduler.worker(100 + worker, bench.now_ms).losses;
  }
  EXPECT_EQ(kept, 3U);
}

}  // namespace
}  // namespace oblique::server
