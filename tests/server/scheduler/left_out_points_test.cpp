// Tests of left-out points. Workers report them, and the server completes them without a row.
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/study_points.h"
#include "tests/server/scheduler/scheduler_bench.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

/// Returns a table of `numbers` points, with mu from 0 to `numbers` - 1 and the filter `where`.
std::shared_ptr<const protocol::PointTable> filtered_table(std::uint64_t numbers,
                                                           const std::string& where) {
  return std::make_shared<const protocol::PointTable>(protocol::recipe_of_blocks(
      {protocol::filtered({protocol::listed("H", {1.0}),
                           protocol::range("mu", 0.0, static_cast<double>(numbers - 1), numbers),
                           protocol::listed("e", {1.0})},
                          where)}));
}

/// A filter that keeps every second point.
constexpr const char* kEven = "floor(mu / 2) == mu / 2";

/// Solves the whole batch, stores its results and requests another batch. Returns all effects.
std::vector<Effect> solve(SchedulerBench& bench, const protocol::PointTable& table,
                          const SendBatch& batch) {
  auto effects = bench.solve_and_store(batch, 1e-3, &table);
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
    SchedulerBench bench(table, trusting());
    bench.solve_all(bench.join(1, 2), 1e-3, table.get());
    std::uint64_t left_in = 0;
    for (std::uint64_t point = 0; point < 100; ++point) {
      left_in += table->passes_filter(point) ? 1U : 0U;
    }
    const StudyCounts counts = bench.scheduler.study(1);
    EXPECT_EQ(counts.solved(), left_in) << where;
    EXPECT_EQ(counts.left_out, 100U - left_in) << where;
    EXPECT_EQ(counts.open(), 0U) << where;
  }
}

TEST_F(LeftOutPointsTest, APointIsLeftOutOnceThatIsDurable) {
  const SendBatch batch = bench_.join(1, 1).at(0);
  const ResultsReceived event = bench_.answer_to(batch, 1e-3, table_.get());
  const auto stores = only<StoreResults>(bench_.feed(event));
  ASSERT_EQ(stores.size(), 1U);
  EXPECT_EQ(stores[0].left_out, event.left_out);
  EXPECT_EQ(bench_.scheduler.study(1).left_out, 0U);
  bench_.feed(ResultsStored{1, 1, bench_.sequence, event.outcomes, event.left_out});
  EXPECT_EQ(bench_.scheduler.study(1).left_out, event.left_out.size());
}

TEST_F(LeftOutPointsTest, ABatchWithOnlyLeftOutPointsIsAnAnswerAndNoLoss) {
  SchedulerBench bench;
  const auto table = filtered_table(100, "mu == 99");
  bench.feed(StudyAdded{1, table, {}});
  const SendBatch batch = bench.join(1, 1).at(0);
  const SendBatch next = only<SendBatch>(solve(bench, *table, batch)).at(0);
  EXPECT_GT(next.first_point(), batch.first_point());
  EXPECT_GT(next.count(), batch.count()) << "batches grow because left-out points take no time";
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 0U);
}

TEST_F(LeftOutPointsTest, APointWithoutAnAnswerInADoneBatchIsLeasedAgain) {
  const SendBatch batch = bench_.join(1, 1).at(0);
  ResultsReceived event = bench_.answer_to(batch, 1e-3, table_.get());
  const std::uint64_t forgotten = event.left_out.front().begin;
  event.left_out.erase(forgotten);
  bench_.feed(event);
  EXPECT_EQ(bench_.scheduler.study(1).leased, 0U);
  const SendBatch again = only<SendBatch>(bench_.feed(CreditGiven{1, 1})).at(0);
  EXPECT_EQ(again.first_point(), forgotten);
  EXPECT_EQ(again.count(), 1U);
  EXPECT_EQ(again.attempt, 2U);
}

TEST_F(LeftOutPointsTest, AWorkerThatReportsPointsOutsideItsBatchIsDisconnected) {
  const SendBatch batch = bench_.join(1, 1).at(0);
  const SendBatch other = bench_.join(2, 1).at(0);
  for (const std::uint64_t point : {other.first_point(), std::uint64_t{99}, std::uint64_t{100}}) {
    SchedulerBench bench(table_, trusting());
    bench.join(1, 1);
    bench.join(2, 1);
    ResultsReceived event = bench.answer_to(batch, 1e-3, table_.get());
    event.left_out.insert(point);
    const auto effects = bench.feed(event);
    ASSERT_EQ(only<DropWorker>(effects).size(), 1U) << point;
    EXPECT_TRUE(only<StoreResults>(effects).empty());
    EXPECT_FALSE(bench.scheduler.has_worker(1));
    EXPECT_EQ(bench.scheduler.study(1).completed, 0U);
  }
}

TEST_F(LeftOutPointsTest, AWorkerThatReportsPointsOfABlockWithoutAFilterIsDisconnected) {
  protocol::Recipe recipe = filtered_table(2, kEven)->recipe();
  *recipe.add_blocks() = table_of(100)->recipe().blocks(0);
  const auto table = std::make_shared<const protocol::PointTable>(recipe);
  for (const Interval named : {Interval{0, 1}, Interval{1, 3}, Interval{2, 3}}) {
    SchedulerBench bench(table, trusting());
    const SendBatch batch = bench.join(1, 1).at(0);
    const auto effects = bench.feed(ResultsReceived{
        1, 1, batch.lease, ++bench.sequence, true, 1e-3, {}, IntervalSet(named.begin, named.end)});
    EXPECT_EQ(only<DropWorker>(effects).size(), named.end > 2 ? 1U : 0U);
  }
}

TEST_F(LeftOutPointsTest, AfterTheEndOfALeaseResultsCountAndLeftOutRangesDoNot) {
  const SendBatch batch = bench_.join(1, 1).at(0);
  ResultsReceived event = bench_.answer_to(batch, 1e-3, table_.get());
  event.lease = 0;  // results sent after a server restart have no lease
  const auto stores = only<StoreResults>(bench_.feed(event));
  ASSERT_EQ(stores.size(), 1U);
  EXPECT_EQ(stores[0].accepted.size(), event.outcomes.size());
  EXPECT_TRUE(stores[0].left_out.empty());
  EXPECT_TRUE(bench_.scheduler.has_worker(1));
}

TEST_F(LeftOutPointsTest, AfterARestartLeftOutPointsAreNotLeased) {
  IntervalSet completed(0, 90);
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_, completed, 3, false, false, {}, "", false, 45});
  EXPECT_EQ(bench.scheduler.study(1).solved(), 42U);
  EXPECT_EQ(bench.scheduler.study(1).left_out, 45U);
  EXPECT_EQ(bench.join(1, 1).at(0).first_point(), 90U);
}

TEST_F(LeftOutPointsTest, PointsAddedByGrowthMayBeLeftOutToo) {
  bench_.solve_all(bench_.join(1, 1), 1e-3, table_.get());
  protocol::Recipe recipe = table_->recipe();
  *recipe.add_blocks() = filtered_table(10, "mu > 7")->recipe().blocks(0);
  const auto grown = std::make_shared<const protocol::PointTable>(recipe);
  bench_.solve_all(only<SendBatch>(bench_.feed(StudyGrown{1, StudyTable(grown)})), 1e-3,
                   grown.get());
  EXPECT_EQ(bench_.scheduler.study(1).solved(), 52U);
  EXPECT_EQ(bench_.scheduler.study(1).left_out, 58U);
}

/// Returns the size of a worker's next batch after it has solved `batches` batches in 1 ms each.
std::uint64_t batch_size_after(int batches, const std::string& where) {
  const auto table = filtered_table(1'000'000, where);
  SchedulerBench bench(table, trusting());
  SendBatch batch = bench.join(1, 1).at(0);
  for (int i = 0; i < batches; ++i) {
    batch = only<SendBatch>(solve(bench, *table, batch)).at(0);
  }
  return batch.count();
}

TEST(LeftOutPoints, BatchesStayShortUntilAPointIsSolvedUnlessNonePassesTheFilter) {
  EXPECT_EQ(batch_size_after(20, "mu > 900000"), SchedulerSettings().unsolved_batch_points);
  EXPECT_EQ(batch_size_after(50, "mu < 100"), SchedulerSettings().largest_batch_points);
}

TEST_F(LeftOutPointsTest, AStudyWithOnlyLeftOutPointsHasNoSolverVersion) {
  const auto table = filtered_table(100, "mu > 90");
  SchedulerBench bench(table, trusting(), "1.0");
  const SendBatch batch = bench.join(1, 1).at(0);
  const ResultsReceived event = bench.answer_to(batch, 1e-3, table.get());
  bench.feed(event);
  bench.feed(ResultsStored{1, 1, bench.sequence, {}, event.left_out});
  bench.feed(WorkerLeft{1});
  EXPECT_EQ(bench.scheduler.study(1).solver_version, "");
}

TEST_F(LeftOutPointsTest, ATooLargeCountOfLeftOutPointsIsCutToTheCompletedOnes) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_, IntervalSet(0, 10), 3, false, false, {}, "", false, 7});
  EXPECT_EQ(bench.scheduler.study(1).solved(), 0U);
}

}  // namespace
}  // namespace oblique::server
