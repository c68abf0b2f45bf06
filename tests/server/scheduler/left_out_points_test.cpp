// Points that a filter leaves out: workers name them, and they are settled without a row.
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/study_points.h"
#include "tests/server/scheduler/scheduler_bench.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

/// `numbers` points with mu from 0 to numbers - 1, of which those are left in for which this is
/// true.
std::shared_ptr<const protocol::PointTable> filtered_table(std::uint64_t numbers,
                                                           const std::string& where) {
  return std::make_shared<const protocol::PointTable>(protocol::recipe_of_blocks(
      {protocol::filtered({protocol::listed("H", {1.0}),
                           protocol::range("mu", 0.0, static_cast<double>(numbers - 1), numbers),
                           protocol::listed("e", {1.0})},
                          where)}));
}

/// Every second point.
constexpr const char* kEven = "floor(mu / 2) == mu / 2";

/// What a worker sends of a whole batch.
ResultsReceived answer_to(SchedulerBench& bench, const protocol::PointTable& table,
                          const SendBatch& batch) {
  ResultsReceived event{batch.worker, batch.study, batch.lease, ++bench.sequence, true, 1e-3, {}};
  for (const Interval& range : batch.points) {
    for (std::uint64_t point = range.begin; point < range.end; ++point) {
      if (table.is_left_in(point)) {
        event.outcomes.push_back({point, false});
      } else {
        event.left_out.insert(point);
      }
    }
  }
  return event;
}

/// The worker answers the whole batch, its answer is stored, and it wants another.
std::vector<Effect> solve(SchedulerBench& bench, const protocol::PointTable& table,
                          const SendBatch& batch) {
  const ResultsReceived event = answer_to(bench, table, batch);
  auto effects = bench.feed(event);
  for (const StoreResults& store : only<StoreResults>(effects)) {
    EXPECT_EQ(store.accepted.size(), event.outcomes.size()) << "a point came twice";
    EXPECT_EQ(store.left_out, event.left_out) << "a point was left out twice";
    bench.append(effects, bench.feed(ResultsStored{batch.worker, batch.study, bench.sequence,
                                                   event.outcomes, store.left_out}));
  }
  bench.append(effects, bench.feed(CreditGiven{batch.worker, 1}));
  return effects;
}

class LeftOutPointsTest : public testing::Test {
 protected:
  LeftOutPointsTest() { bench_.feed(StudyAdded{1, table_, {}}); }

  std::shared_ptr<const protocol::PointTable> table_ = filtered_table(100, kEven);
  SchedulerBench bench_{trusting()};
};

TEST_F(LeftOutPointsTest, AStudyIsDoneWhenEveryPointIsSolvedOrLeftOut) {
  for (const char* where : {kEven, "mu > 50", "mu < 50", "mu == 77", "mu < 0"}) {
    const auto table = filtered_table(100, where);
    SchedulerBench bench(trusting());
    bench.feed(StudyAdded{1, table, {}});
    std::vector<SendBatch> held = bench.join(1, 2);
    std::size_t finished = 0;
    while (!held.empty()) {
      std::vector<SendBatch> next;
      for (const SendBatch& batch : std::exchange(held, {})) {
        const auto effects = solve(bench, *table, batch);
        finished += only<StudyFinished>(effects).size();
        for (const SendBatch& more : only<SendBatch>(effects)) {
          held.push_back(more);
        }
      }
    }
    std::uint64_t left_in = 0;
    for (std::uint64_t point = 0; point < 100; ++point) {
      left_in += table->is_left_in(point) ? 1U : 0U;
    }
    const StudyCounts counts = bench.scheduler.study(1);
    EXPECT_EQ(finished, 1U) << where;
    EXPECT_EQ(counts.solved(), left_in) << where;
    EXPECT_EQ(counts.left_out, 100U - left_in) << where;
    EXPECT_EQ(bench.scheduler.study(1).open(), 0U) << where;
  }
}

TEST_F(LeftOutPointsTest, APointIsLeftOutOnceThatIsDurable) {
  const SendBatch batch = bench_.join(1, 1).at(0);
  const ResultsReceived event = answer_to(bench_, *table_, batch);
  const auto stores = only<StoreResults>(bench_.feed(event));
  ASSERT_EQ(stores.size(), 1U);
  EXPECT_EQ(stores[0].left_out, event.left_out);
  EXPECT_EQ(bench_.scheduler.study(1).left_out, 0U);
  bench_.feed(ResultsStored{1, 1, bench_.sequence, event.outcomes, event.left_out});
  EXPECT_EQ(bench_.scheduler.study(1).left_out, event.left_out.size());
}

TEST_F(LeftOutPointsTest, ABatchOfWhichNothingIsLeftInIsAnAnswerAndNoLoss) {
  SchedulerBench bench;
  const auto table = filtered_table(100, "mu == 99");
  bench.feed(StudyAdded{1, table, {}});
  const SendBatch batch = bench.join(1, 1).at(0);
  const SendBatch next = only<SendBatch>(solve(bench, *table, batch)).at(0);
  EXPECT_GT(next.first_point(), batch.first_point());
  EXPECT_GT(next.count(), batch.count()) << "it took no time";
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 0U);
}

TEST_F(LeftOutPointsTest, APointThatADoneBatchNeitherSolvedNorNamedIsHandedOutAgain) {
  const SendBatch batch = bench_.join(1, 1).at(0);
  ResultsReceived event = answer_to(bench_, *table_, batch);
  const std::uint64_t forgotten = event.left_out.front().begin;
  event.left_out.erase(forgotten);
  bench_.feed(event);
  EXPECT_EQ(bench_.scheduler.study(1).leased, 0U);
  const SendBatch again = only<SendBatch>(bench_.feed(CreditGiven{1, 1})).at(0);
  EXPECT_EQ(again.first_point(), forgotten);
  EXPECT_EQ(again.count(), 1U);
  EXPECT_EQ(again.attempt, 2U);
}

TEST_F(LeftOutPointsTest, AWorkerThatNamesPointsOutsideItsBatchIsLostAndNothingOfThatCounts) {
  const SendBatch batch = bench_.join(1, 1).at(0);
  const SendBatch other = bench_.join(2, 1).at(0);
  for (const std::uint64_t point : {other.first_point(), std::uint64_t{99}, std::uint64_t{100}}) {
    SchedulerBench bench(trusting());
    bench.feed(StudyAdded{1, table_, {}});
    bench.join(1, 1);
    bench.join(2, 1);
    ResultsReceived event = answer_to(bench, *table_, batch);
    event.left_out.insert(point);
    const auto effects = bench.feed(event);
    ASSERT_EQ(only<DropWorker>(effects).size(), 1U) << point;
    EXPECT_TRUE(only<StoreResults>(effects).empty());
    EXPECT_FALSE(bench.scheduler.knows_worker(1));
    EXPECT_EQ(bench.scheduler.study(1).settled, 0U);
  }
}

TEST_F(LeftOutPointsTest, AWorkerThatNamesPointsOfAStudyWithoutAFilterIsLost) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(100), {}});
  const SendBatch batch = bench.join(1, 1).at(0);
  const auto effects = bench.feed(ResultsReceived{
      1, 1, batch.lease, ++bench.sequence, true, 1e-3, {}, IntervalSet(batch.first_point(), 1)});
  EXPECT_EQ(only<DropWorker>(effects).size(), 1U);
  EXPECT_EQ(bench.scheduler.study(1).settled, 0U);
}

TEST_F(LeftOutPointsTest, AWorkerThatNamesPointsOfABlockWithoutAFilterIsLost) {
  protocol::Recipe recipe = filtered_table(2, kEven)->recipe();
  *recipe.add_blocks() = table_of(100)->recipe().blocks(0);
  const auto table = std::make_shared<const protocol::PointTable>(recipe);
  for (const Interval named : {Interval{0, 1}, Interval{1, 3}, Interval{2, 3}}) {
    SchedulerBench bench(trusting());
    bench.feed(StudyAdded{1, table, {}});
    const SendBatch batch = bench.join(1, 1).at(0);
    const auto effects = bench.feed(ResultsReceived{
        1, 1, batch.lease, ++bench.sequence, true, 1e-3, {}, IntervalSet(named.begin, named.end)});
    EXPECT_EQ(only<DropWorker>(effects).size(), named.end > 2 ? 1U : 0U);
  }
}

TEST_F(LeftOutPointsTest, OfALeaseThatHasEndedResultsCountAndRangesDoNot) {
  const SendBatch batch = bench_.join(1, 1).at(0);
  ResultsReceived event = answer_to(bench_, *table_, batch);
  event.lease = 0;  // as after a restart of the server
  const auto stores = only<StoreResults>(bench_.feed(event));
  ASSERT_EQ(stores.size(), 1U);
  EXPECT_EQ(stores[0].accepted.size(), event.outcomes.size());
  EXPECT_TRUE(stores[0].left_out.empty());
  EXPECT_TRUE(bench_.scheduler.knows_worker(1));
}

TEST_F(LeftOutPointsTest, AfterARestartTheyAreKnownAndNotHandedOut) {
  IntervalSet settled(0, 90);
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_, settled, 3, false, false, {}, "", false, 45});
  EXPECT_EQ(bench.scheduler.study(1).solved(), 42U);
  EXPECT_EQ(bench.scheduler.study(1).left_out, 45U);
  EXPECT_EQ(bench.join(1, 1).at(0).first_point(), 90U);
}

TEST_F(LeftOutPointsTest, PointsThatAStudyGrowsByAreNamedToo) {
  std::vector<SendBatch> held = bench_.join(1, 1);
  const auto solve_all = [&](const protocol::PointTable& table) {
    while (!held.empty()) {
      held = only<SendBatch>(solve(bench_, table, held.front()));
    }
  };
  solve_all(*table_);
  protocol::Recipe recipe = table_->recipe();
  *recipe.add_blocks() = filtered_table(10, "mu > 7")->recipe().blocks(0);
  const auto grown = std::make_shared<const protocol::PointTable>(recipe);
  held = only<SendBatch>(bench_.feed(StudyGrown{1, StudyTable(grown)}));
  solve_all(*grown);
  EXPECT_EQ(bench_.scheduler.study(1).solved(), 52U);
  EXPECT_EQ(bench_.scheduler.study(1).left_out, 58U);
}

/// The number of points in the batch that a worker gets after `batches` others, which took no time.
std::uint64_t batch_size_after(int batches, const std::string& where) {
  const auto table = filtered_table(1'000'000, where);
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table, {}});
  SendBatch batch = bench.join(1, 1).at(0);
  for (int i = 0; i < batches; ++i) {
    batch = only<SendBatch>(solve(bench, *table, batch)).at(0);
  }
  return batch.count();
}

TEST(LeftOutPoints, BatchesStayShortUntilAPointWasSolved) {
  EXPECT_EQ(batch_size_after(20, "mu > 900000"), SchedulerSettings().unsolved_batch_points);
}

TEST(LeftOutPoints, BatchesStayLongWhileTheFilterKeepsNothing) {
  EXPECT_EQ(batch_size_after(50, "mu < 100"), SchedulerSettings().largest_batch_points);
}

TEST_F(LeftOutPointsTest, AStudyOfWhichPointsAreOnlyLeftOutHasNoSolverVersion) {
  const auto table = filtered_table(100, "mu > 90");
  SchedulerSettings settings = trusting();
  settings.solver_version = "1.0";
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table, {}});
  const SendBatch batch = bench.join(1, 1).at(0);
  const ResultsReceived event = answer_to(bench, *table, batch);
  bench.feed(event);
  bench.feed(ResultsStored{1, 1, bench.sequence, {}, event.left_out});
  bench.feed(WorkerLeft{1});
  EXPECT_EQ(bench.scheduler.study(1).solver_version, "");
}

TEST_F(LeftOutPointsTest, MoreLeftOutPointsThanAreSettledMakeNoHugeNumbers) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_, IntervalSet(0, 10), 3, false, false, {}, "", false, 7});
  EXPECT_EQ(bench.scheduler.study(1).solved(), 0U);
  Scheduler scheduler{trusting()};
  scheduler.handle(StudyAdded{1, table_, IntervalSet(0, 10), 3, false, false, {}, "", false, 45},
                   0);
  EXPECT_EQ(scheduler.study(1).solved(), 0U);
  EXPECT_EQ(scheduler.study(1).solved(), 0U);
}

TEST_F(LeftOutPointsTest, APointThatKillsAmongOthersIsFoundByFewWorkers) {
  const auto table = filtered_table(2000, kEven);
  constexpr std::uint64_t kKiller = 1234;
  SchedulerSettings settings;
  settings.first_batch_points = 2000;
  settings.unsolved_batch_points = 2000;
  settings.tail_batches_per_thread = 0;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table, {}});
  std::uint64_t deaths = 0;
  WorkerId worker = 0;
  std::vector<Effect> effects;
  const auto join = [&] {
    ++worker;
    effects = bench.join_as("process " + std::to_string(worker), worker, 1);
  };
  join();
  for (int turn = 0; turn < 3000 && !bench.scheduler.study(1).failed; ++turn) {
    if (const auto failures = only<StoreFailure>(effects); !failures.empty()) {
      EXPECT_EQ(failures[0].point, kKiller);
      bench.feed(ResultsStored{0, 1, 0, {{failures[0].point, true}}});
      break;
    }
    if (const auto probes = only<SendProbe>(effects); !probes.empty()) {
      effects = bench.solve_probe(probes[0]);
      continue;
    }
    const auto batches = only<SendBatch>(effects);
    if (batches.empty()) {
      effects = bench.pass(250, {worker});
      continue;
    }
    const SendBatch batch = batches[0];
    if (batch.first_point() <= kKiller && kKiller < batch.first_point() + batch.count()) {
      ++deaths;
      effects = bench.pass(15'000);  // it is silent, and then lost
      if (only<StoreFailure>(effects).empty()) {
        join();
      }
    } else {
      effects = solve(bench, *table, batch);
    }
  }
  EXPECT_EQ(bench.scheduler.study(1).failed, 1U);
  EXPECT_LE(deaths, 9U);
}

}  // namespace
}  // namespace oblique::server
