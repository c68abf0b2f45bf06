// Points that a filter leaves out: how the places of points and the scheduler come across them.
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/points/study_points.h"
#include "tests/server/scheduler/scheduler_bench.h"
#include "tests/support/recipes.h"

namespace oblique::server {
namespace {

constexpr std::uint64_t kEnoughLooks = 1'000'000;

/// `numbers` points with mu from 0 to numbers - 1, of which those are left in for which this is
/// true.
std::shared_ptr<const protocol::PointTable> filtered_table(std::uint64_t numbers,
                                                           const std::string& where) {
  protocol::PointTable table(protocol::recipe_of_blocks(
      {protocol::filtered({protocol::listed("H", {1.0}),
                           protocol::range("mu", 0.0, static_cast<double>(numbers - 1), numbers),
                           protocol::listed("e", {1.0})},
                          where)}));
  table.survey([] { return true; });
  return std::make_shared<const protocol::PointTable>(std::move(table));
}

/// Every second point.
constexpr const char* kEven = "floor(mu / 2) == mu / 2";

StudyPoints points_of(const std::shared_ptr<const protocol::PointTable>& table,
                      IntervalSet settled = {}) {
  return {StudyTable(table), std::move(settled), LossLimits{}};
}

/// A bench whose events look at few points.
SchedulerSettings short_sighted() {
  SchedulerSettings settings = trusting();
  settings.most_looks = 10;
  return settings;
}

/// What is solved of a batch by a worker that passes over what is left out.
std::vector<Effect> solve_left_in(SchedulerBench& bench, const protocol::PointTable& table,
                                  const SendBatch& batch, std::set<std::uint64_t>& solved) {
  ResultsReceived event{batch.worker, batch.study, batch.lease, ++bench.sequence, true, 1e-3, {}};
  const std::uint64_t end = batch.first_point() + batch.count();
  for (std::uint64_t point = table.first_left_in(batch.first_point(), end); point < end;
       point = table.first_left_in(point + 1, end)) {
    event.outcomes.push_back({point, false});
    EXPECT_TRUE(solved.insert(point).second) << point << " was handed out twice";
  }
  auto effects = bench.feed(event);
  bench.append(effects, bench.feed(ResultsStored{batch.worker, batch.study, bench.sequence,
                                                 event.outcomes}));
  bench.append(effects, bench.feed(CreditGiven{batch.worker, 1}));
  return effects;
}

// ---- Places -----------------------------------------------------------------------------------

TEST(LeftOutPointsTest, ABatchIsARunOfNumbersAndCountsThoseThatAreLeftIn) {
  const auto table = filtered_table(20, kEven);
  StudyPoints points = points_of(table);
  EXPECT_EQ(points.size(), 10U);
  EXPECT_EQ(points.numbers(), 20U);
  std::uint64_t looks = kEnoughLooks;
  const auto batch = points.take({3}, looks);
  ASSERT_TRUE(batch.has_value());
  EXPECT_EQ(batch->first_place, 0U);
  EXPECT_EQ(batch->count, 3U);
  EXPECT_EQ(batch->points, 2U);
  EXPECT_EQ(points.leased(), 2U);
  EXPECT_EQ(points.free(), 8U);
  EXPECT_EQ(points.settled(), 0U) << "what is left out is no row";
  points.check_invariants();
}

TEST(LeftOutPointsTest, ItIsCompleteWhenAllThatAreLeftInAreSettledThoughNobodySawTheOthers) {
  const auto table = filtered_table(1000, "mu < 3");
  StudyPoints points = points_of(table);
  std::uint64_t looks = kEnoughLooks;
  ASSERT_TRUE(points.take({3}, looks).has_value());
  EXPECT_FALSE(points.has_free()) << "three are out, and there are no more";
  for (const std::uint64_t point : {0U, 1U, 2U}) {
    EXPECT_TRUE(points.receive(point));
    EXPECT_TRUE(points.settle(point));
  }
  EXPECT_TRUE(points.is_complete());
  EXPECT_EQ(points.free(), 0U);
}

TEST(LeftOutPointsTest, ASearchEndsWithItsLooksAndGoesOnWhereItEnded) {
  const auto table = filtered_table(1000, "mu == 700");
  StudyPoints points = points_of(table);
  std::uint64_t turns = 0;
  while (true) {
    std::uint64_t looks = 100;
    if (const auto batch = points.take({50}, looks)) {
      EXPECT_EQ(batch->first_place, 700U);
      EXPECT_EQ(batch->points, 1U);
      break;
    }
    EXPECT_EQ(looks, 0U);
    EXPECT_TRUE(points.has_free());
    ASSERT_LT(++turns, 20U);
    points.check_invariants();
  }
  EXPECT_EQ(turns, 7U);
}

TEST(LeftOutPointsTest, AResultOfAPointThatIsLeftOutIsNotTaken) {
  StudyPoints points = points_of(filtered_table(20, kEven));
  EXPECT_FALSE(points.receive(7));
  EXPECT_TRUE(points.receive(8));
  std::uint64_t looks = kEnoughLooks;
  ASSERT_TRUE(points.take({20}, looks).has_value());
  EXPECT_FALSE(points.receive(7));
  points.check_invariants();
}

TEST(LeftOutPointsTest, WhatComesBackTogetherGoesOutTogether) {
  StudyPoints points = points_of(filtered_table(40, kEven));
  std::uint64_t looks = kEnoughLooks;
  const auto batch = points.take({20}, looks);
  ASSERT_TRUE(batch.has_value());
  EXPECT_EQ(batch->points, 10U);
  EXPECT_TRUE(points.receive(4));  // one was answered
  const std::vector<Interval> held = points.leased_set().within(0, batch->end());
  points.give_back(held, 1, {}, 0);
  points.check_invariants();
  const auto first = points.take({20}, looks);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->first_place, 0U);
  EXPECT_EQ(first->points, 2U) << "the answered one is not solved again";
  const auto rest = points.take({20}, looks);
  ASSERT_TRUE(rest.has_value());
  EXPECT_EQ(rest->first_place, 6U);
  EXPECT_EQ(rest->points, 7U);
  points.check_invariants();
}

TEST(LeftOutPointsTest, AfterARestartTheRowsAndTheCountTellWhatIsOpen) {
  const auto table = filtered_table(20, kEven);
  IntervalSet rows;
  for (const std::uint64_t point : {0U, 2U, 4U, 18U}) {
    rows.insert(point);
  }
  StudyPoints points = points_of(table, rows);
  EXPECT_EQ(points.settled(), 4U);
  EXPECT_EQ(points.free(), 6U);
  std::set<std::uint64_t> out;
  std::uint64_t looks = kEnoughLooks;
  while (const auto batch = points.take({4}, looks)) {
    for (const Interval& run : points.leased_set().within(batch->first_place, batch->end())) {
      for (std::uint64_t point = run.begin; point < run.end; ++point) {
        out.insert(point);
      }
    }
  }
  EXPECT_EQ(out, (std::set<std::uint64_t>{6, 8, 10, 12, 14, 16}));
  points.check_invariants();
}

TEST(LeftOutPointsTest, AStudyThatIsCompleteAtARestartIsSoWithoutALook) {
  const auto table = filtered_table(6, kEven);
  IntervalSet rows;
  for (const std::uint64_t point : {0U, 2U, 4U}) {
    rows.insert(point);
  }
  StudyTable bytes(table->recipe().SerializeAsString(), 3);
  StudyPoints points(bytes, rows, LossLimits{});
  EXPECT_TRUE(points.is_complete());
  points.check_invariants();
  EXPECT_EQ(points.reopen(IntervalSet(2, 3)), 1U);  // it had failed, and is tried again
  EXPECT_TRUE(points.has_free());
  std::uint64_t looks = kEnoughLooks;
  EXPECT_EQ(points.take({4}, looks)->first_place, 2U);
  points.check_invariants();
}

TEST(LeftOutPointsTest, ACountThatIsTooLargeKeepsNobodyWaiting) {
  protocol::Recipe recipe = filtered_table(20, kEven)->recipe();
  recipe.mutable_blocks(0)->set_points_left_in(15);
  StudyPoints points = points_of(std::make_shared<const protocol::PointTable>(recipe));
  std::uint64_t looks = kEnoughLooks;
  while (const auto batch = points.take({4}, looks)) {
    for (const Interval& run : points.leased_set().within(batch->first_place, batch->end())) {
      for (std::uint64_t point = run.begin; point < run.end; ++point) {
        points.receive(point);
        points.settle(point);
      }
    }
  }
  EXPECT_TRUE(points.is_complete());
  EXPECT_EQ(points.size(), 10U);
}

TEST(LeftOutPointsTest, AStudyGrowsByWhatItsFurtherNumbersLeaveIn) {
  const auto of_two = [](const char* second) {
    protocol::Recipe recipe = filtered_table(10, kEven)->recipe();
    *recipe.add_blocks() = filtered_table(10, second)->recipe().blocks(0);
    return std::make_shared<const protocol::PointTable>(recipe);
  };
  StudyPoints points = points_of(filtered_table(10, kEven));
  points.grow(StudyTable(of_two("mu > 7")));
  EXPECT_EQ(points.size(), 7U);
  EXPECT_EQ(points.free(), 7U);
  EXPECT_EQ(points.numbers(), 20U);
  points.check_invariants();
}

// ---- The scheduler ----------------------------------------------------------------------------

TEST(LeftOutPointsTest, EveryPointThatIsLeftInIsSolvedOnceHoweverFewLooksAnEventHas) {
  for (const char* where : {kEven, "mu > 50", "mu < 50", "mu == 77", "floor(mu / 30) == mu / 30"}) {
    const auto table = filtered_table(100, where);
    SchedulerBench bench(short_sighted());
    bench.feed(StudyAdded{1, table, {}});
    std::set<std::uint64_t> solved;
    std::vector<SendBatch> held = bench.join(1, 2);
    for (int turn = 0; turn < 1000 && solved.size() < table->points(); ++turn) {
      std::vector<Effect> effects = bench.feed(SearchGoesOn{});
      for (const SendBatch& batch : std::exchange(held, {})) {
        bench.append(effects, solve_left_in(bench, *table, batch, solved));
      }
      held = only<SendBatch>(effects);
    }
    EXPECT_EQ(solved.size(), table->points()) << where;
    EXPECT_EQ(bench.scheduler.points(1).settled, table->points());
    EXPECT_EQ(bench.scheduler.points(1).open(), 0U);
    EXPECT_FALSE(bench.scheduler.is_searching());
  }
}

TEST(LeftOutPointsTest, WhileAStudySearchesAnotherGetsTheWorkers) {
  SchedulerBench bench(short_sighted());
  bench.feed(StudyAdded{1, filtered_table(100'000, "mu == 99999"), {}, 0, false, false, {5}});
  bench.feed(StudyAdded{2, table_of(100), {}});
  const auto batches = bench.join(1, 3);
  ASSERT_EQ(batches.size(), 3U);
  for (const SendBatch& batch : batches) {
    EXPECT_EQ(batch.study, 2U);
  }
  EXPECT_EQ(bench.scheduler.points(1).leased, 0U);
}

TEST(LeftOutPointsTest, ASearchIsWantedOnlyWhileWorkersWait) {
  SchedulerBench bench(short_sighted());
  bench.feed(StudyAdded{1, filtered_table(100, "mu == 99"), {}});
  EXPECT_FALSE(bench.scheduler.is_searching());
  EXPECT_TRUE(bench.join(1, 1).empty());
  EXPECT_TRUE(bench.scheduler.is_searching());
  std::vector<SendBatch> batches;
  for (int turn = 0; turn < 20 && batches.empty(); ++turn) {
    batches = only<SendBatch>(bench.feed(SearchGoesOn{}));
  }
  ASSERT_EQ(batches.size(), 1U);
  EXPECT_EQ(batches[0].first_point(), 99U);
  EXPECT_FALSE(bench.scheduler.is_searching());
}

TEST(LeftOutPointsTest, ATickGoesOnSearchingToo) {
  SchedulerBench bench(short_sighted());
  bench.feed(StudyAdded{1, filtered_table(100, "mu == 99"), {}});
  EXPECT_TRUE(bench.join(1, 1).empty());
  EXPECT_EQ(only<SendBatch>(bench.pass(5000, {1})).size(), 1U);
}

TEST(LeftOutPointsTest, AStudyThatStopsWhileItSearchesGoesOnLater) {
  SchedulerBench bench(short_sighted());
  bench.feed(StudyAdded{1, filtered_table(100, "mu == 99"), {}});
  bench.join(1, 1);
  bench.feed(StudyPaused{1});
  bench.feed(SearchGoesOn{});
  EXPECT_FALSE(bench.scheduler.is_searching());
  bench.feed(StudyReopened{1});
  std::vector<SendBatch> batches;
  for (int turn = 0; turn < 20 && batches.empty(); ++turn) {
    batches = only<SendBatch>(bench.feed(SearchGoesOn{}));
  }
  EXPECT_EQ(batches.size(), 1U);
  bench.feed(StudyRemoved{1});
  EXPECT_FALSE(bench.scheduler.is_searching());
}

TEST(LeftOutPointsTest, ABatchThatIsDoneLosesNothingThoughManyOfItsNumbersHaveNoResult) {
  const auto table = filtered_table(100, kEven);
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table, {}});
  const SendBatch batch = bench.join(1, 1).at(0);
  std::set<std::uint64_t> solved;
  solve_left_in(bench, *table, batch, solved);
  EXPECT_FALSE(solved.empty());
  EXPECT_EQ(bench.scheduler.worker(1, bench.now_ms).losses, 0U);
}

TEST(LeftOutPointsTest, APointThatKillsAmongOthersIsFoundByFewWorkers) {
  const auto table = filtered_table(2000, kEven);
  constexpr std::uint64_t kKiller = 1234;
  SchedulerSettings settings;
  settings.first_batch_points = 2000;
  settings.tail_batches_per_thread = 0;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table, {}});
  std::set<std::uint64_t> solved;
  std::uint64_t deaths = 0;
  WorkerId worker = 0;
  std::vector<Effect> effects;
  const auto join = [&] {
    ++worker;
    effects = bench.join_as("process " + std::to_string(worker), worker, 1);
  };
  join();
  for (int turn = 0; turn < 3000 && !bench.scheduler.points(1).failed; ++turn) {
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
      effects = solve_left_in(bench, *table, batch, solved);
    }
  }
  EXPECT_EQ(bench.scheduler.points(1).failed, 1U);
  EXPECT_LE(deaths, 9U);
}

}  // namespace
}  // namespace oblique::server
