// Points whose leases cost workers: found, leased alone, failed with the reason.
#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

/// One worker after another, as a supervisor starts them, each a new process. Each dies of any
/// batch that holds a killing point.
class Supervised {
 public:
  Supervised(SchedulerBench& bench, std::set<std::uint64_t> killers, std::uint32_t prefetch)
      : bench_(bench), killers_(std::move(killers)), prefetch_(prefetch) {}

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
  /// False when the worker died of it.
  bool live() {
    if (probe_) {
      take(bench_.solve_probe(*std::exchange(probe_, std::nullopt)));
    } else if (held_.empty()) {
      take(bench_.pass(250, {worker_}));
    } else {
      const SendBatch batch = held_.front();
      held_.pop_front();
      const auto killer = killers_.lower_bound(batch.first_point());
      if (killer != killers_.end() && *killer < batch.first_point() + batch.count()) {
        ++deaths;
        take(bench_.feed(WorkerUnreachable{worker_}));
        return false;
      }
      take(bench_.solve_and_store(batch, 1e-6));
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
  WorkerId worker_ = 0;
  std::deque<SendBatch> held_;
  std::optional<SendProbe> probe_;
};

TEST(SchedulerTest, APointThatKillsItsWorkersIsFoundAndFailedAndTheStudyGoesOn) {
  SchedulerSettings settings;
  settings.first_batch_points = 64;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(1000), {}});
  Supervised supervised(bench, {137, 777}, 3);
  supervised.run();
  // Each costs two workers until it is suspect, one for each split of at most 1000 points by eight,
  // and three when it is alone.
  EXPECT_LE(supervised.deaths, 2 * (2 + 3 + 3));
  ASSERT_EQ(supervised.failed.size(), 2U);
  EXPECT_TRUE(supervised.failed.contains(137) && supervised.failed.contains(777));
  EXPECT_NE(supervised.failed[137].find("worker was lost"), std::string::npos);
  EXPECT_EQ(bench.scheduler.study(1).solved(), 998U);
}

TEST(SchedulerTest, AStudyOfNothingButAPointThatKillsEndsToo) {
  // No worker can show that it is fit by any other point: each is given a probe.
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1), {}});
  Supervised supervised(bench, {0}, 2);
  supervised.run();
  EXPECT_TRUE(supervised.finished);
  EXPECT_LE(supervised.deaths, 2 + 3);
  EXPECT_EQ(supervised.failed.size(), 1U);
}

TEST(SchedulerTest, ManyPointsThatKillCostABoundedNumberOfWorkersEach) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(3000), {}});
  std::set<std::uint64_t> killers;
  for (std::uint64_t point = 100; point < 3000; point += 290) {
    killers.insert(point);
  }
  Supervised supervised(bench, killers, 2);
  supervised.run();
  EXPECT_TRUE(supervised.finished);
  EXPECT_EQ(supervised.failed.size(), killers.size());
  EXPECT_LE(supervised.deaths, static_cast<int>(killers.size()) * (2 + 3 + 3));
}

/// Workers of which each has solved something, and the points that are left.
class SuspectTest : public testing::Test {
 protected:
  /// Workers 1 to `workers`, one after another, each of which solves one point of a study of so
  /// many points more than `left`.
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

TEST_F(SuspectTest, APointFailsOnceItCostThreeProvenWorkersAloneAndNoneOfThemCameBack) {
  prove(3, 1);
  for (const WorkerId worker : {1U, 2U, 3U}) {
    EXPECT_EQ(credit(worker).size(), 1U) << worker;
    EXPECT_TRUE(only<StoreFailure>(bench_.feed(WorkerUnreachable{worker})).empty());
  }
  EXPECT_TRUE(only<StoreFailure>(bench_.pass(9750)).empty()) << "one may come back still";
  const auto failures = only<StoreFailure>(bench_.pass(250));
  ASSERT_EQ(failures.size(), 1U);
  EXPECT_EQ(failures[0].point, 3U);
  EXPECT_EQ(failures[0].attempt, 3U);
}

TEST_F(SuspectTest, APointDoesNotFailWhenOneOfItsThreeWorkersComesBack) {
  prove(3, 1);
  for (const WorkerId worker : {1U, 2U, 3U}) {
    credit(worker);
    bench_.feed(WorkerUnreachable{worker});
  }
  bench_.pass(5000);
  const auto again = batches(bench_.join_as(name(2), 12, 1));
  ASSERT_EQ(again.size(), 1U) << "it is still proven";
  EXPECT_TRUE(only<StoreFailure>(bench_.pass(20'000, {12})).empty());
  bench_.solve_and_store(again[0]);
  EXPECT_EQ(bench_.scheduler.study(1).solved(), 4U);
}

TEST_F(SuspectTest, OneProcessThatIsLostAgainAndAgainWithAPointDoesNotFailIt) {
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

TEST_F(SuspectTest, AWorkerThatHeldAnotherPointTooDoesNotAccuseEither) {
  prove(5, 2);
  for (WorkerId worker = 1; worker <= 5; ++worker) {
    bench_.feed(CreditGiven{worker, 2});
    bench_.feed(WorkerUnreachable{worker});
    bench_.join_as(name(worker), worker + 10, 0);  // and back, so that the points stay together
  }
  EXPECT_TRUE(only<StoreFailure>(bench_.pass(60'000)).empty());
}

TEST_F(SuspectTest, AnAccusedPointGoesToTheWorkerThatHasBeenProvenLongest) {
  prove(3, 1);
  credit(3);
  bench_.feed(WorkerUnreachable{3});
  EXPECT_TRUE(credit(2).empty());
  EXPECT_EQ(credit(1).size(), 1U);
}

TEST_F(SuspectTest, AnAccusedPointDoesNotWaitForEverForTheWorkerThatHasBeenProvenLongest) {
  prove(3, 1);
  credit(3);
  bench_.feed(WorkerUnreachable{3});
  EXPECT_TRUE(credit(2).empty());
  EXPECT_TRUE(batches(bench_.pass(9750, {1, 2})).empty());
  const auto given = batches(bench_.pass(250, {1, 2}));
  ASSERT_EQ(given.size(), 1U);
  EXPECT_EQ(given[0].worker, 2U);
}

TEST(SchedulerTest, SuspectPointsGoToAProvenWorkerThatHoldsNothingElse) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(1000), {}});
  for (const WorkerId worker : {1U, 2U}) {  // two losses make the batches suspect
    EXPECT_EQ(bench.join(worker, 2).size(), 2U);
    bench.pass(3250);
  }
  const auto fresh = bench.join(3, 5);
  ASSERT_EQ(fresh.size(), 2U) << "a newcomer gets others, and not too many";
  EXPECT_EQ(fresh[0].attempt, 1U);
  bench.solve(fresh[0]);
  const auto suspect = only<SendBatch>(bench.solve(fresh[1]));
  ASSERT_EQ(suspect.size(), 1U);
  EXPECT_EQ(suspect[0].attempt, 3U);
  EXPECT_EQ(suspect[0].first_point(), 0U);
}

TEST(SchedulerTest, ThePartsOfASplitChunkStaySuspect) {
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
    ASSERT_EQ(part.size(), 1U) << "alone, although it asked for two";
    EXPECT_EQ(part[0].count(), worker == 3 ? 4U : 1U);
    bench.feed(WorkerUnreachable{worker});
  }
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
        suspect_was_leased = suspect_was_leased || next.first_point() == second.first_point();
        held.push_back(next);
      }
    }
  }
  EXPECT_TRUE(suspect_was_leased);
}

TEST_F(SuspectTest, AWorkerThatFinishesBatchesWithoutAnswersDoesNotTakeThemForEver) {
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
