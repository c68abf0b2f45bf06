// Batches of studies of several models: fall by fall they cost more than their points.
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::PointTable;
using protocol::range;

/// `models` models of `points` points each.
std::shared_ptr<const PointTable> table_of_models(std::uint64_t models, std::uint64_t points) {
  return std::make_shared<const PointTable>(protocol::recipe_of(
      {{range("E", 6e10, 7e10, models), listed("H", {1.0}),
        points == 1 ? listed("mu", {0.4}) : range("mu", 0.1, 1.0, points), listed("e", {1.0})}}));
}

/// In studies of models of many points: the model that a batch begins with.
constexpr std::uint64_t kMany = 100'000;
std::uint64_t model_of(const SendBatch& batch) {
  return batch.first_point() / kMany;
}

TEST(SchedulerModels, TheFirstBatchHasAModelForEachLaneOfAWorkersThreads) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of_models(10'000, 1), {}});
  const auto batches = bench.join(1, 2, 3);
  ASSERT_EQ(batches.size(), 2U);
  EXPECT_EQ(batches[0].count(), 24U);
  EXPECT_EQ(batches[1].first_point(), 24U);
}

TEST(SchedulerModels, BatchesOfAPointAModelFillLanesAlsoWhereAFallTakesLongerThanABatchShould) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of_models(10'000, 1), {}});
  SendBatch batch = bench.join(1, 1).at(0);
  for (int i = 0; i < 5; ++i) {
    batch = bench.next_after(batch, 0.5);
    EXPECT_EQ(batch.count(), 8U);
  }
  for (int i = 0; i < 5; ++i) {
    batch = bench.next_after(batch, 30.0);
  }
  EXPECT_EQ(batch.count(), 1U) << "a lost worker would cost minutes";
}

TEST(SchedulerModels, QuickModelsGoOutByPaceAsPointsOfOneDo) {
  SchedulerSettings settings = trusting();
  settings.growth = 1000;
  settings.tail_batches_per_thread = 0;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of_models(10'000, 1), {}});
  EXPECT_EQ(bench.next_after(bench.join(1, 1).at(0), 1e-3).count(), 100U)
      << "0.1 s at 1 ms a point";
}

TEST(SchedulerModels, InTheEndEveryWorkerHasItsPart) {
  SchedulerBench bench(trusting());
  bench.feed(WorkerJoined{1, 1});
  bench.feed(WorkerJoined{2, 1});
  bench.feed(CreditGiven{1, 2});
  bench.feed(CreditGiven{2, 2});
  const auto batches = only<SendBatch>(bench.feed(StudyAdded{1, table_of_models(14, 1), {}}));
  ASSERT_EQ(batches.size(), 2U);
  EXPECT_EQ(batches[0].count(), 7U);
  EXPECT_EQ(batches[1].count(), 7U);
  EXPECT_NE(batches[0].worker, batches[1].worker);
}

TEST(SchedulerModels, ABatchEndsWithAModelWhereItCan) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of_models(2000, 9), {}});
  SendBatch batch = bench.join(1, 1).at(0);
  std::uint64_t whole = 0;
  for (int i = 0; i < 12; ++i) {
    batch = bench.next_after(batch, 1e-3);
    whole += (batch.first_point() + batch.count()) % 9 == 0 ? 1U : 0U;
  }
  EXPECT_GE(whole, 10U) << "at first too little is known of its pace";
}

TEST(SchedulerModels, ModelsOfManyPointsFillLanesForAsLongAsABatchMayTakeForIt) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of_models(1000, 1000), {}});
  SendBatch batch = bench.join(1, 1).at(0);
  for (int i = 0; i < 20; ++i) {
    batch = bench.next_after(batch, 1e-4);
  }
  EXPECT_EQ(batch.count(), 8000U) << "0.8 s, and eight falls side by side";
  for (int i = 0; i < 20; ++i) {
    batch = bench.next_after(batch, 5e-4);
  }
  EXPECT_EQ(batch.count(), 2000U) << "1 s";
}

TEST(SchedulerModels, WorkersTakeModelsOfTheirOwnWhileThereAreAny) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of_models(3, kMany), {}});
  std::vector<SendBatch> held;
  for (const WorkerId worker : {1U, 2U, 3U}) {
    held.push_back(bench.join(worker, 1).at(0));
  }
  for (int round = 0; round < 10; ++round) {
    for (std::uint64_t i = 0; i < held.size(); ++i) {
      EXPECT_EQ(model_of(held[i]), i) << "whose fall it has";
      held[i] = bench.next_after(held[i], 1e-4);
    }
  }
  EXPECT_EQ(model_of(bench.join(4, 1).at(0)), 0U) << "all models are begun: it helps with one";
}

TEST(SchedulerModels, AWorkerFinishesItsModelAlsoWhenAnotherTookPartOfIt) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of_models(2, kMany), {}});
  const SendBatch first = bench.join(1, 1).at(0);
  const SendBatch other = bench.join(2, 1).at(0);
  const SendBatch helper = bench.join(3, 1).at(0);
  EXPECT_EQ(model_of(helper), model_of(first));
  EXPECT_EQ(model_of(bench.next_after(first, 1e-4)), model_of(first));
  EXPECT_EQ(model_of(bench.next_after(other, 1e-4)), model_of(other));
}

TEST(SchedulerModels, WhatALostWorkerHeldOfSeveralModelsGoesOutAgainAsItWas) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of_models(8, 1), {}});
  const SendBatch lost = bench.join(1, 1).at(0);
  ASSERT_EQ(lost.count(), 8U);
  bench.join(2, 1);
  const auto again = only<SendBatch>(bench.feed(WorkerUnreachable{1}));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].first_point(), lost.first_point());
  EXPECT_EQ(again[0].count(), lost.count());
  EXPECT_EQ(again[0].attempt, 2U);
}

TEST(SchedulerModels, ABatchOfSeveralModelsThatStragglesGoesToASecondWorkerToo) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of_models(8, 1), {}});
  const SendBatch slow = bench.join(1, 1).at(0);
  bench.feed(ResultsReceived{1, 1, slow.lease, ++bench.sequence, false, 1e-3, {{0, false}}});
  bench.join(2, 1);
  const auto twins = only<SendBatch>(bench.pass(1500, {1, 2}));
  ASSERT_EQ(twins.size(), 1U);
  EXPECT_EQ(twins[0].first_point(), 1U);
  EXPECT_EQ(twins[0].count(), 7U);
}

TEST(SchedulerModels, APointOfManyModelsThatKillsIsFoundAndNoOtherFails) {
  constexpr std::uint64_t kKiller = 137;
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of_models(400, 1), {}});
  WorkerId worker = 0;
  std::vector<std::uint64_t> failed;
  std::deque<SendBatch> held;
  const std::function<void(const std::vector<Effect>&)> take = [&](const auto& effects) {
    for (const auto& batch : only<SendBatch>(effects)) {
      held.push_back(batch);
    }
    for (const auto& failure : only<StoreFailure>(effects)) {
      failed.push_back(failure.point);
      take(bench.feed(ResultsStored{0, 1, 0, {{failure.point, true}}}));
    }
  };
  const auto join = [&] {
    ++worker;
    take(bench.join_as(std::to_string(worker), worker, 1));
  };
  join();
  join();
  for (int step = 0; step < 2000 && bench.scheduler.study(1).open() > 0; ++step) {
    if (held.empty()) {
      take(bench.pass(250, {worker, worker - 1}));
      continue;
    }
    const SendBatch batch = held.front();
    held.pop_front();
    if (batch.study == 1 && batch.first_point() <= kKiller &&
        kKiller < batch.first_point() + batch.count()) {
      take(bench.feed(WorkerUnreachable{batch.worker}));
      std::erase_if(held, [&](const SendBatch& other) { return other.worker == batch.worker; });
      join();
    } else {
      take(bench.solve_and_store(batch, 1e-3 * static_cast<double>(batch.count())));
      take(bench.feed(CreditGiven{batch.worker, 1}));
    }
  }
  EXPECT_EQ(bench.scheduler.study(1).solved(), 399U);
  EXPECT_EQ(failed, std::vector<std::uint64_t>{kKiller});
}

TEST(SchedulerModels, ALongBatchCountsForAsManyAsItTakesInTheShareOfAStudy) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of_models(100'000, 1), {}});
  bench.feed(StudyAdded{2, table_of(1'000'000), {}});
  std::deque<SendBatch> held;
  for (const auto& batch : bench.join(1, 2)) {
    held.push_back(batch);
  }
  double busy_s[3] = {};
  for (int i = 0; i < 500; ++i) {
    const SendBatch batch = held.front();
    held.pop_front();
    const double s = (batch.study == 1 ? 0.1 : 1e-4) * static_cast<double>(batch.count());
    busy_s[batch.study] += s;
    bench.solve_and_store(batch, s);
    held.push_back(only<SendBatch>(bench.feed(CreditGiven{1, 1})).at(0));
  }
  EXPECT_NEAR(busy_s[1] / busy_s[2], 1.0, 0.1);
}

}  // namespace
}  // namespace oblique::server
