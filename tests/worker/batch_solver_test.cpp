#include "worker/batch_solver.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/points.h"
#include "worker/solver/point_runs.h"

namespace oblique::worker {
namespace {

/// Returns a batch of a study without a filter.
Batch batch(std::uint64_t number, std::uint64_t first, std::uint64_t count,
            std::uint64_t study_id = 7) {
  return {number, study_id, {{first, first + count}}, server::table_of(1'000'000'000), 1, "uid"};
}

/// Returns a batch of a study with a filter and a thousand points, with mu from 0 to 999.
Batch filtered_batch(const std::vector<Batch::Range>& ranges, const std::string& where) {
  const auto points = std::make_shared<const protocol::PointTable>(protocol::recipe_of_blocks(
      {protocol::filtered({protocol::listed("H", {1.0}), protocol::range("mu", 0.0, 999.0, 1000),
                           protocol::listed("e", {1.0})},
                          where)}));
  return {1, 7, ranges, points};
}

/// Makes each point wait in the solver until the test lets it end.
class Gate {
 public:
  /// Called by the solver for each point. Counts the point as begun and waits until it may end.
  void pass() {
    std::unique_lock lock(mutex_);
    ++begun_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return open_ > 0; });
    --open_;
  }
  void open(int points) {
    const std::lock_guard lock(mutex_);
    open_ += points;
    changed_.notify_all();
  }
  int begun() {
    const std::lock_guard lock(mutex_);
    return begun_;
  }
  void wait_begun(int points) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return begun_ >= points; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int begun_ = 0;
  int open_ = 0;
};

/// Reports each point of `points` as failed. Calls `before` before each report.
void fail_all(
    solver::PointSource& points, const solver::TakeOutcome& take,
    const std::function<void()>& before = [] {}) {
  while (const auto point = points.next()) {
    before();
    take({*point, std::nullopt, "for the test"});
  }
}

/// Provides a batch solver whose points end when the test opens the gate.
class BatchSolverTest : public ::testing::Test {
 protected:
  void TearDown() override { gate_.open(1'000'000); }

  void wait_batches_ended(int batches) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return batches_ended_ >= batches; });
  }

  Gate gate_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int batches_ended_ = 0;
  BatchSolver solver_{[this](const Batch&, auto& points, const auto& take) {
                        fail_all(points, take, [this] { gate_.pass(); });
                      },
                      [this] {
                        const std::lock_guard lock(mutex_);
                        ++batches_ended_;
                        changed_.notify_all();
                      }};
};

TEST_F(BatchSolverTest, BatchesAreSolvedPointByPointInTheOrderTheyWereAdded) {
  solver_.add(batch(1, 10, 3));
  solver_.add(batch(2, 50, 2));
  gate_.open(5);
  wait_batches_ended(2);
  const auto progress = solver_.collect();
  ASSERT_EQ(progress.size(), 2U);
  EXPECT_EQ(progress[0].batch, 1U);
  EXPECT_EQ(progress[0].study_uid, "uid");
  ASSERT_EQ(progress[0].results.size(), 3U);
  EXPECT_EQ(progress[0].results[2].point(), 12U);
  EXPECT_TRUE(progress[0].batch_done);
  EXPECT_EQ(progress[1].results.size(), 2U);
  EXPECT_TRUE(solver_.collect().empty());
}

TEST_F(BatchSolverTest, PointsOfABatchAreSolvedInOrderAndLeftOutPointsAreReported) {
  struct Case {
    std::vector<Batch::Range> ranges;
    const char* where;
    std::vector<std::uint64_t> solved;
    std::vector<std::uint64_t> left_out;
  };
  const Case cases[] = {
      {{{30, 32}, {7, 8}, {10, 12}}, "mu >= 0", {30, 31, 7, 10, 11}, {}},
      {{{8, 13}, {5, 6}, {20, 22}}, "floor(mu / 10) == mu / 10", {10, 20}, {8, 9, 11, 12, 5, 21}},
      {{{99, 102}, {119, 120}, {200, 201}}, "mu < 120", {99, 100, 101, 119}, {200}},
      {{{3, 5}}, "mu > 900", {}, {3, 4}},
  };
  gate_.open(1000);
  int batches = 0;
  for (const Case& c : cases) {
    solver_.add(filtered_batch(c.ranges, c.where));
    wait_batches_ended(++batches);
    const auto progress = solver_.collect();
    ASSERT_EQ(progress.size(), 1U);
    EXPECT_TRUE(progress[0].batch_done);
    std::vector<std::uint64_t> solved;
    for (const auto& result : progress[0].results) {
      solved.push_back(result.point());
    }
    EXPECT_EQ(solved, c.solved) << c.where;
    std::vector<std::uint64_t> left_out;
    for (const Batch::Range& range : progress[0].left_out) {
      for (std::uint64_t point = range.begin; point < range.end; ++point) {
        left_out.push_back(point);
      }
    }
    EXPECT_EQ(left_out, c.left_out) << c.where;
  }
}

TEST_F(BatchSolverTest, ResultsOfABatchCanBeCollectedBeforeItEnds) {
  solver_.add(batch(1, 0, 3));
  gate_.open(2);
  gate_.wait_begun(3);
  const auto part = solver_.collect();
  ASSERT_EQ(part.size(), 1U);
  EXPECT_EQ(part[0].results.size(), 2U);
  EXPECT_FALSE(part[0].batch_done);
  EXPECT_TRUE(solver_.is_solving());
  gate_.open(1);
  wait_batches_ended(1);
  const auto rest = solver_.collect();
  ASSERT_EQ(rest.size(), 1U);
  EXPECT_EQ(rest[0].results.size(), 1U);
  EXPECT_TRUE(rest[0].batch_done);
}

TEST_F(BatchSolverTest, ADroppedStudyLeavesNothingAndOthersContinue) {
  solver_.add(batch(1, 0, 3, 7));
  solver_.add(batch(2, 0, 3, 7));
  solver_.add(batch(3, 0, 1, 8));
  gate_.open(1);
  gate_.wait_begun(2);
  solver_.drop_study(7);
  gate_.open(2);
  wait_batches_ended(1);
  const auto progress = solver_.collect();
  ASSERT_EQ(progress.size(), 1U);
  EXPECT_EQ(progress[0].batch, 3U);
}

TEST_F(BatchSolverTest, ADroppedBatchEndsAfterThePresentPoint) {
  solver_.add(batch(1, 0, 1000));
  gate_.wait_begun(1);
  solver_.drop_study(7);
  solver_.add(batch(2, 0, 1, 8));
  gate_.open(1000);
  wait_batches_ended(1);
  EXPECT_EQ(gate_.begun(), 2) << "one point of each batch";
  const auto progress = solver_.collect();
  ASSERT_EQ(progress.size(), 1U);
  EXPECT_EQ(progress[0].batch, 2U);
}

TEST_F(BatchSolverTest, ResultsSolvedBeforeAllIsDroppedCanStillBeCollected) {
  solver_.add(batch(1, 0, 3));
  solver_.add(batch(2, 0, 3));
  gate_.open(1);
  gate_.wait_begun(2);
  solver_.drop_all();
  const auto progress = solver_.collect();
  ASSERT_EQ(progress.size(), 1U);
  EXPECT_EQ(progress[0].results.size(), 1U);
  EXPECT_FALSE(progress[0].batch_done);
  solver_.add(batch(3, 0, 1));
  gate_.open(2);
  wait_batches_ended(1);
  const auto rest = solver_.collect();
  ASSERT_EQ(rest.size(), 2U);
  EXPECT_EQ(rest[0].batch, 1U) << "the point in progress is included";
  EXPECT_EQ(rest[0].results.size(), 1U);
  EXPECT_EQ(rest[1].batch, 3U);
}

TEST_F(BatchSolverTest, APausedSolverFinishesItsPointAndBeginsNoOther) {
  solver_.add(batch(1, 0, 3));
  gate_.wait_begun(1);
  solver_.set_paused(true);
  gate_.open(2);
  std::size_t results = 0;
  while (results == 0) {
    for (const Progress& progress : solver_.collect()) {
      results += progress.results.size();
    }
  }
  EXPECT_EQ(gate_.begun(), 1);
  solver_.set_paused(false);
  gate_.open(1);
  wait_batches_ended(1);
  EXPECT_EQ(solver_.collect().at(0).results.size(), 2U);
}

TEST_F(BatchSolverTest, APausedSolverThatIsDestroyedBeginsNoPoint) {
  std::atomic<int> begun{0};
  {
    BatchSolver paused(
        [&begun](const Batch&, auto& points, const auto& take) {
          fail_all(points, take, [&begun] { ++begun; });
        },
        [] {});
    paused.set_paused(true);
    paused.add(batch(1, 0, 2));
  }
  EXPECT_EQ(begun, 0);
}

TEST_F(BatchSolverTest, SeveralThreadsShareABatch) {
  BatchSolver shared([this](const Batch&, auto& points,
                            const auto& take) { fail_all(points, take, [this] { gate_.pass(); }); },
                     [] {}, 3);
  shared.add(batch(1, 0, 3));
  gate_.wait_begun(3);
  EXPECT_TRUE(shared.collect().empty()) << "all three points have begun and none has ended";
  gate_.open(3);
  std::set<std::uint64_t> points;
  while (points.size() < 3) {
    for (const Progress& progress : shared.collect()) {
      for (const auto& result : progress.results) {
        EXPECT_TRUE(points.insert(result.point()).second) << result.point();
      }
    }
  }
  EXPECT_EQ(points, (std::set<std::uint64_t>{0, 1, 2}));
}

TEST_F(BatchSolverTest, AFreeThreadSkipsADroppedBatchThatAnotherThreadStillSolves) {
  Gate dropped_batch;
  std::atomic<int> taken_up{0};
  std::atomic<bool> next_is_solved{false};
  BatchSolver shared(
      [&](const Batch& at_hand, auto& points, const auto& take) {
        if (at_hand.number() == 1 && ++taken_up > 2) {
          ADD_FAILURE() << "a dropped batch was started";
          std::abort();  // ADD_FAILURE alone would not end this test
        }
        fail_all(points, take, [&] {
          if (at_hand.number() == 1) {
            dropped_batch.pass();
          }
        });
        if (at_hand.number() == 2) {
          next_is_solved = true;
          next_is_solved.notify_all();
        }
      },
      [] {}, 2);
  shared.add(batch(1, 0, 6));
  dropped_batch.wait_begun(2);  // both threads solve the first batch
  shared.drop_batch(1);
  dropped_batch.open(1);  // lets one thread end its point
  shared.add(batch(2, 0, 1));
  next_is_solved.wait(false);
  dropped_batch.open(1000);
}

TEST(BatchSolver, RecordsThePointsThatItSolvesAndTheAttemptOfTheirBatch) {
  std::array<SolvingSlot, 2> slots{};
  const auto recorded = [&](std::uint64_t point) {
    const auto& points = slots[1].points;
    return std::count(std::begin(points), std::end(points), point + 1) == 1;
  };
  std::vector<bool> seen;
  std::promise<void> ended;
  BatchSolver solver(
      [&](const Batch&, solver::PointSource& points, const solver::TakeOutcome& take) {
        const auto first = points.next();
        const auto second = points.next();
        seen = {slots[1].study_id == 7, recorded(40), recorded(41), !recorded(42)};
        take({*first, std::nullopt, "for the test"});
        seen.insert(seen.end(), {!recorded(40), recorded(41)});
        take({*second, std::nullopt, "for the test"});
        fail_all(points, take);
      },
      [&] { ended.set_value(); }, 1, slots);
  solver.add({1, 7, {{40, 43}}, server::table_of(100), 3});
  ended.get_future().wait();
  EXPECT_EQ(seen, std::vector<bool>(6, true));
  EXPECT_EQ(slots[1].solved, 3U);
  EXPECT_TRUE(std::ranges::all_of(slots[1].points, [](std::uint64_t point) { return point == 0; }));
  EXPECT_EQ(solver.collect().at(0).attempt, 3U);
}

TEST(BatchSolver, EveryPointOfManyBatchesIsSolvedOnceByAnyNumberOfThreads) {
  constexpr std::uint64_t kBatches = 40;
  std::mutex mutex;
  std::condition_variable changed;
  std::uint64_t ended = 0;
  BatchSolver solver([](const Batch&, auto& points, const auto& take) { fail_all(points, take); },
                     [&] {
                       const std::lock_guard lock(mutex);
                       ++ended;
                       changed.notify_all();
                     },
                     4);
  std::uint64_t first = 0;
  for (std::uint64_t number = 1; number <= kBatches; ++number) {
    solver.add(batch(number, first, 13 * number));
    first += 13 * number;
  }
  std::vector<int> solved(first, 0);
  std::uint64_t done = 0;
  const auto gather = [&] {
    for (const Progress& progress : solver.collect()) {
      for (const auto& result : progress.results) {
        ++solved.at(result.point());
      }
      done += progress.batch_done ? 1U : 0U;
    }
  };
  {
    std::unique_lock lock(mutex);
    while (
        !changed.wait_for(lock, std::chrono::milliseconds(1), [&] { return ended == kBatches; })) {
      lock.unlock();
      gather();
      lock.lock();
    }
  }
  gather();
  EXPECT_EQ(done, kBatches);
  EXPECT_EQ(solved, std::vector<int>(first, 1));
}

}  // namespace
}  // namespace oblique::worker
