// Points that share a fall and lie apart in their study, as those of a sample do.
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"
#include "worker/solver/model/fall_model.h"

namespace oblique::server {
namespace {

using protocol::PointTable;

std::shared_ptr<const PointTable> sample(std::uint64_t points, std::uint64_t falls) {
  return std::make_shared<const PointTable>(
      protocol::sample_with_falls(points, falls, protocol::SAMPLE_LATIN_HYPERCUBE));
}

/// What workers were given, in whole.
struct Given {
  std::multiset<std::uint64_t> points;
  std::map<std::uint64_t, std::set<WorkerId>> workers_of_fall;

  void add(const PointTable& table, const SendBatch& batch) {
    for (const PointOutcome& outcome : SchedulerBench::outcomes_of(batch)) {
      points.insert(outcome.point);
      const std::uint64_t model = table.point(outcome.point).model;
      workers_of_fall[solver::fall_hash(table.model(model))].insert(batch.worker);
    }
  }
  std::size_t falls_solved() const {
    std::size_t solved = 0;
    for (const auto& [fall, workers] : workers_of_fall) {
      solved += workers.size();
    }
    return solved;
  }
};

/// Workers take turns until nothing is left.
Given solve_all(SchedulerBench& bench, const PointTable& table, std::deque<SendBatch> batches,
                double s_per_point) {
  Given given;
  while (!batches.empty()) {
    const SendBatch batch = batches.front();
    batches.pop_front();
    given.add(table, batch);
    bench.solve_and_store(batch, s_per_point * static_cast<double>(batch.count()));
    for (const SendBatch& next : only<SendBatch>(bench.feed(CreditGiven{batch.worker, 1}))) {
      batches.push_back(next);
    }
  }
  return given;
}

TEST(SchedulerFalls, EachFallOfASampleGoesToOneWorkerButForAFewThatAreShared) {
  SchedulerBench bench;
  const auto table = sample(20'000, 500);
  bench.feed(StudyAdded{1, table, {}});
  std::deque<SendBatch> batches;
  for (const WorkerId worker : {1U, 2U, 3U, 4U}) {
    for (const SendBatch& batch : bench.join(worker, 2)) {
      batches.push_back(batch);
    }
  }
  const Given given = solve_all(bench, *table, batches, 5e-3);
  EXPECT_EQ(given.points.size(), 20'000U);
  EXPECT_EQ(given.workers_of_fall.size(), 500U);
  EXPECT_LE(given.falls_solved(), 530U);
  EXPECT_EQ(bench.scheduler.study(1).solved(), 20'000U);
}

TEST(SchedulerFalls, AServerThatStartsAgainHandsOutTheRestByFalls) {
  SchedulerBench bench;
  const auto table = sample(2'000, 50);
  IntervalSet settled;
  for (std::uint64_t point = 0; point < 2'000; point += 3) {
    settled.insert(point);
  }
  bench.feed(StudyAdded{1, table, settled});
  const auto first = bench.join(1, 2);
  const Given given = solve_all(bench, *table, {first.begin(), first.end()}, 5e-3);
  EXPECT_EQ(given.points.size(), 2'000U - settled.size());
  for (const std::uint64_t point : given.points) {
    EXPECT_EQ(given.points.count(point), 1U);
    EXPECT_FALSE(settled.contains(point));
  }
  EXPECT_EQ(bench.scheduler.study(1).solved(), 2'000U);
}

TEST(SchedulerFalls, PointsOfALostWorkerComeBackAndAFailedPointIsNamedByItsNumber) {
  SchedulerBench bench(trusting());
  const auto table = sample(300, 4);
  bench.feed(StudyAdded{1, table, {}});
  const SendBatch lost = bench.join(1, 1).at(0);
  bench.feed(WorkerLeft{1});
  const auto first = bench.join(2, 2);
  Given given = solve_all(bench, *table, {first.begin(), first.end()}, 1e-3);
  EXPECT_EQ(given.points.size(), 300U);
  for (const PointOutcome& outcome : SchedulerBench::outcomes_of(lost)) {
    EXPECT_EQ(given.points.count(outcome.point), 1U);
  }
  const std::uint64_t failed = lost.first_point();
  const auto again =
      only<SendBatch>(bench.feed(FailuresForgotten{1, IntervalSet(failed, failed + 1)}));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].points, (std::vector<Interval>{{failed, failed + 1}}));
}

TEST(SchedulerFalls, APointOfASampleThatKillsItsWorkersFailsUnderItsNumber) {
  SchedulerBench bench(trusting());
  const auto table = sample(40, 4);
  constexpr std::uint64_t kKiller = 17;
  bench.feed(StudyAdded{1, table, {}});
  std::set<std::uint64_t> failures;
  std::deque<Effect> effects;
  WorkerId next_worker = 1;
  const auto take = [&](const std::vector<Effect>& more) {
    effects.insert(effects.end(), more.begin(), more.end());
  };
  const auto join = [&] {
    const WorkerId worker = next_worker++;
    take(bench.join_as("process " + std::to_string(worker), worker, 1));
  };
  join();
  join();
  for (int turn = 0; turn < 2000 && failures.empty(); ++turn) {
    if (effects.empty()) {
      take(bench.pass(1000, {next_worker - 2, next_worker - 1}));
      continue;
    }
    const Effect effect = effects.front();
    effects.pop_front();
    if (const auto* probe = std::get_if<SendProbe>(&effect)) {
      take(bench.solve_probe(*probe));
    } else if (const auto* failure = std::get_if<StoreFailure>(&effect)) {
      failures.insert(failure->point);
    } else if (const auto* batch = std::get_if<SendBatch>(&effect)) {
      bool kills = false;
      for (const PointOutcome& outcome : SchedulerBench::outcomes_of(*batch)) {
        kills = kills || outcome.point == kKiller;
      }
      if (kills) {
        take(bench.feed(WorkerUnreachable{batch->worker}));
        join();
      } else {
        take(bench.solve_and_store(*batch));
        take(bench.feed(CreditGiven{batch->worker, 1}));
      }
    }
  }
  EXPECT_EQ(failures, std::set<std::uint64_t>{kKiller});
}

}  // namespace
}  // namespace oblique::server
