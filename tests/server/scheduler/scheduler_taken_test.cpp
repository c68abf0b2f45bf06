#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/scheduler/scheduler_bench.h"

// Points that are taken over from other studies.
namespace oblique::server {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

StudyAdded held_study(std::uint64_t points) {
  StudyAdded added{1, table_of(points), {}};
  added.held = true;
  return added;
}

TEST(SchedulerTaken, NothingOfAStudyThatIsHeldIsHandedOut) {
  SchedulerBench bench;
  bench.feed(held_study(10));
  EXPECT_THAT(bench.join(1, 4), IsEmpty());
  EXPECT_THAT(only<SendBatch>(bench.feed(StudyHeld{1, false})), Not(IsEmpty()));
}

TEST(SchedulerTaken, WhatIsTakenIsNotHandedOut) {
  SchedulerBench bench;
  bench.feed(held_study(10));
  bench.feed(PointsTaken{1, IntervalSet(2, 10)});
  EXPECT_EQ(bench.scheduler.study(1).solved(), 8U);
  bench.feed(StudyHeld{1, false});
  const auto batches = bench.join(1, 4);
  ASSERT_THAT(batches, Not(IsEmpty()));
  EXPECT_LE(batches.back().first_point() + batches.back().count(), 2U);
}

TEST(SchedulerTaken, AStudyOfWhichAllIsTakenIsFinished) {
  SchedulerBench bench;
  bench.feed(held_study(10));
  bench.feed(PointsTaken{1, IntervalSet(0, 5)});
  EXPECT_THAT(only<StudyFinished>(bench.feed(PointsTaken{1, IntervalSet(5, 10)})), SizeIs(1));
  bench.feed(StudyHeld{1, false});
  EXPECT_THAT(bench.join(1, 4), IsEmpty());
}

TEST(SchedulerTaken, PointsThatAreOutAreTakenAllTheSameAndTheirBatchIsWithdrawn) {
  SchedulerBench bench(trusting());
  bench.feed(StudyAdded{1, table_of(1000), {}});
  bench.feed(WorkerJoined{1, 1});
  const auto batches = only<SendBatch>(bench.feed(CreditGiven{1, 2}));
  ASSERT_THAT(batches, SizeIs(2));
  const auto& second = batches[1];
  const IntervalSet taken(second.first_point(), second.first_point() + second.count() + 5);
  const auto released = only<ReleaseBatch>(bench.feed(PointsTaken{1, taken}));
  ASSERT_THAT(released, SizeIs(1));
  EXPECT_EQ(released[0].lease, second.lease);
  bench.feed(WorkerLeft{1});
  EXPECT_EQ(bench.scheduler.study(1).solved(), second.count() + 5);
}

TEST(SchedulerTaken, AHeldStudyCanBePausedCancelledAndGoOn) {
  SchedulerBench bench;
  bench.feed(held_study(10));
  bench.join(1, 4);
  bench.feed(StudyPaused{1});
  EXPECT_THAT(only<SendBatch>(bench.feed(StudyHeld{1, false})), IsEmpty());
  bench.feed(StudyHeld{1, true});
  EXPECT_THAT(only<SendBatch>(bench.feed(StudyReopened{1})), IsEmpty());
  EXPECT_THAT(only<SendBatch>(bench.feed(StudyHeld{1, false})), Not(IsEmpty()));
}

TEST(SchedulerTaken, SuspectPointsAreTakenToo) {
  SchedulerBench bench;
  bench.feed(StudyAdded{1, table_of(3), {}});
  for (WorkerId worker = 1; worker <= 2; ++worker) {  // both are lost with all points
    bench.join(worker, 4);
    bench.feed(WorkerUnreachable{worker});
  }
  EXPECT_THAT(only<StudyFinished>(bench.feed(PointsTaken{1, IntervalSet(0, 3)})), SizeIs(1));
}

}  // namespace
}  // namespace oblique::server
