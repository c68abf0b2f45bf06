// What many workers cost, counted in examined workers and not in time.
#include <cstdint>

#include <gtest/gtest.h>

#include "server/scheduler/scheduler.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

constexpr WorkerId kWorkers = 1000;

/// A thousand workers that ask for batches, of which there are none.
class IdleCrowd : public testing::Test {
 protected:
  IdleCrowd() {
    for (WorkerId worker = 1; worker <= kWorkers; ++worker) {
      scheduler_.handle(WorkerJoined{worker, 1}, now_ms_);
      scheduler_.handle(CreditGiven{worker, 2}, now_ms_);
    }
  }
  std::vector<Effect> add_study() {
    return scheduler_.handle(StudyAdded{2, table_of(100), IntervalSet(0, 1)}, now_ms_);
  }

  Scheduler scheduler_{SchedulerSettings{}};
  std::int64_t now_ms_ = 1'000'000;
};

TEST_F(IdleCrowd, AMessageOfOneWorkerMakesTheServerLookAtNoOther) {
  const std::uint64_t before = scheduler_.examined_workers();
  for (WorkerId worker = 1; worker <= kWorkers; ++worker) {
    scheduler_.handle(HeartbeatReceived{worker, {}}, now_ms_);
  }
  EXPECT_LE(scheduler_.examined_workers() - before, kWorkers);
  scheduler_.check_invariants();
}

TEST_F(IdleCrowd, AsSoonAsThereIsSomethingItIsHandedOut) {
  EXPECT_EQ(only<SendBatch>(add_study()).size(), 99U) << "a point each, while there are any";
  scheduler_.check_invariants();
}

TEST_F(IdleCrowd, TheFirstThatAskedIsServedFirstHoweverOftenItFoundNothing) {
  scheduler_.handle(HeartbeatReceived{500, {}}, now_ms_);
  EXPECT_EQ(only<SendBatch>(add_study()).at(0).worker, 1U);
}

TEST_F(IdleCrowd, PointsOfAWorkerThatLeavesGoToOneThatWaitsAtOnce) {
  const auto batches = only<SendBatch>(add_study());
  const auto effects = scheduler_.handle(WorkerLeft{batches.at(0).worker}, now_ms_);
  ASSERT_GE(only<SendBatch>(effects).size(), 1U);
  EXPECT_NE(only<SendBatch>(effects)[0].worker, batches[0].worker);
}

TEST_F(IdleCrowd, APausedStudyThatGoesOnIsHandedOutAtOnce) {
  StudyAdded paused{2, table_of(100), {}};
  paused.paused = true;
  EXPECT_TRUE(only<SendBatch>(scheduler_.handle(paused, now_ms_)).empty());
  EXPECT_FALSE(only<SendBatch>(scheduler_.handle(StudyReopened{2}, now_ms_)).empty());
}

TEST(ManyStudies, ThatRestCostDispatchNothing) {
  const auto cost_with = [](StudyId resting) {
    Scheduler scheduler(trusting());
    for (StudyId study = 1; study <= resting; ++study) {
      StudyAdded event{study, table_of(3), study % 2 == 0 ? IntervalSet(0, 3) : IntervalSet()};
      event.paused = study % 2 == 1;
      scheduler.handle(event, 0);
    }
    scheduler.handle(WorkerJoined{1, 1}, 0);
    scheduler.handle(StudyAdded{resting + 1, table_of(1000), {}}, 0);
    const std::uint64_t before = scheduler.examined_workers();
    std::size_t batches = 0;
    for (int i = 0; i < 100; ++i) {
      batches += only<SendBatch>(scheduler.handle(CreditGiven{1, 1}, 0)).size();
      scheduler.handle(Tick{}, i);
    }
    EXPECT_EQ(batches, 100U);
    return scheduler.examined_workers() - before;
  };
  EXPECT_EQ(cost_with(10'000), cost_with(10));
}

}  // namespace
}  // namespace oblique::server
