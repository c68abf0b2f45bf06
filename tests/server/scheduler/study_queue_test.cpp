#include "server/scheduler/study_queue.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "server/scheduler/lease_index.h"
#include "tests/server/scheduler/scheduler_bench.h"

namespace oblique::server {
namespace {

using Place = StudyQueue::Place;

TEST(StudyQueueTest, TheHighestPriorityComesFirstThenTheOneServedLeastThenTheOldest) {
  StudyQueue queue;
  queue.put(1, {true, false, 0, 5.0});
  queue.put(2, {true, false, 0, 3.0});
  queue.put(3, {true, false, 0, 3.0});
  EXPECT_EQ(queue.next_free(), 2U);
  queue.put(4, {true, false, 1, 99.0});
  EXPECT_EQ(queue.next_free(), 4U);
  queue.put(4, {});
  EXPECT_EQ(queue.next_free(), 2U);
}

TEST(StudyQueueTest, AStudyWithNothingToHandOutIsNowhere) {
  StudyQueue queue;
  queue.put(1, {true, true, 0, 1.0});
  queue.put(1, {false, true, 0, 1.0});
  EXPECT_EQ(queue.next_free(), 0U);
  EXPECT_EQ(queue.with_suspects().count(1), 1U);
  queue.put(1, {});
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.find(1), nullptr);
  EXPECT_FALSE(queue.least_served(2).has_value());
}

TEST(StudyQueueTest, TheLeastServedIsTheMinimumWhateverWasPutBefore) {
  StudyQueue queue;
  std::mt19937 random(7);
  std::vector<Place> places(50);
  for (int change = 0; change < 5000; ++change) {
    const std::size_t study = random() % places.size();
    places[study] = {random() % 2 == 0, false, 0, static_cast<double>(random() % 20)};
    queue.put(study + 1, places[study]);
    double least = 1e9;
    std::size_t first = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i].has_free && places[i].served < least) {
        least = places[i].served;
        first = i + 1;
      }
    }
    ASSERT_EQ(queue.next_free(), first);
    ASSERT_EQ(queue.least_served(0).value_or(1e9), least);
  }
}

TEST(LeaseIndexTest, OfManyLeasesOnlyTheNeighboursOfAChunkAreLookedAt) {
  LeaseIndex index;
  constexpr std::uint64_t kLeases = 56'000;
  for (std::uint64_t lease = 1; lease <= kLeases; ++lease) {
    index.insert(lease, Batch{4 * lease, 4, 0, {}});
  }
  const Batch batch{4 * 30'000 + 1, 3, 0, {}};
  const auto near = index.near(batch);
  EXPECT_LE(near.size(), 3U);
  EXPECT_NE(std::find(near.begin(), near.end(), 30'000U), near.end());
}

TEST(LeaseIndexTest, ALongLeaseIsFoundByEachOfItsPoints) {
  LeaseIndex index;
  index.insert(1, Batch{0, 1000, 0, {}});
  index.insert(2, Batch{400, 10, 0, {}});
  index.insert(3, Batch{2000, 10, 0, {}});
  EXPECT_EQ(index.near(Batch{999, 1, 0, {}}), (std::vector<std::uint64_t>{1, 2}));
  index.erase(1, Batch{0, 1000, 0, {}});
  EXPECT_EQ(index.size(), 2U);
  EXPECT_EQ(index.all(), (std::vector<std::uint64_t>{2, 3}));
}

TEST(SchedulerTest, ACancelGivesBackThePointsOfLeasesThatOverlap) {
  SchedulerSettings settings;
  settings.tail_batches_per_thread = 0;
  SchedulerBench bench(settings);
  bench.feed(StudyAdded{1, table_of(4), {}});
  const SendBatch first = bench.join(1, 1).at(0);
  bench.join(2, 1);
  ASSERT_EQ(only<SendBatch>(bench.pass(1500, {1, 2})).size(), 1U) << "it straggles";
  ASSERT_EQ(bench.scheduler.worker(2, bench.now_ms).leased_points, first.count());
  EXPECT_EQ(only<WithdrawStudy>(bench.feed(StudyCancelled{1})).size(), 2U);
  EXPECT_EQ(bench.scheduler.study(1).leased, 0U);
  bench.feed(CreditGiven{1, 1});
  EXPECT_EQ(only<SendBatch>(bench.feed(StudyReopened{1})).size(), 1U);
}

}  // namespace
}  // namespace oblique::server
