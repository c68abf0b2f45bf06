#include "server/web/answers/column_store.h"

#include "server/web/answers/point_set.h"
#include "server/web/answers/result_sample.h"

#include <atomic>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "server/database/sqlite.h"
#include "tests/support/process.h"

namespace oblique::server {
namespace {

std::vector<PointRun> runs_of(const std::set<std::uint64_t>& points) {
  std::vector<PointRun> runs;
  for (const std::uint64_t point : points) {
    if (!runs.empty() && runs.back().end == point) {
      ++runs.back().end;
    } else {
      runs.push_back({point, point + 1});
    }
  }
  return runs;
}

TEST(SampledRuns, LieEvenlyAmongAllAndAreNoMoreThanAskedFor) {
  std::vector<PointRun> all;
  for (std::uint64_t i = 0; i < 5000; ++i) {
    all.push_back({i * 100'000, i * 100'000 + 1 + (i % 7) * 9'000});
  }
  constexpr std::uint64_t kMost = 1U << 20U;
  const auto taken = sampled_runs(all, kMost);
  EXPECT_TRUE(difference(taken, all).empty()) << "points that there are not";
  std::uint64_t points = 0;
  std::uint64_t lower_half = 0;
  std::uint64_t end = 0;
  for (const PointRun& run : taken) {
    EXPECT_GE(run.begin, end);
    end = run.end;
    points += run.end - run.begin;
    lower_half += run.begin < 250'000'000 ? run.end - run.begin : 0;
  }
  EXPECT_EQ(points, kMost);
  EXPECT_NEAR(static_cast<double>(lower_half) / static_cast<double>(points), 0.5, 0.01);
}

TEST(SampledRuns, OfFewPointsAreAllOfThem) {
  const std::vector<PointRun> few{{3, 5}, {70, 71}};
  EXPECT_EQ(sampled_runs(few, 3), few);
  EXPECT_TRUE(sampled_runs({}, 3).empty());
  EXPECT_EQ(sampled_runs({{0, 10}}, 4).size(), 1U);
}

TEST(Difference, IsThatOfTheSetsOfPoints) {
  std::mt19937 random(3);  // the same sets in every run
  for (int round = 0; round < 2000; ++round) {
    std::set<std::uint64_t> one;
    std::set<std::uint64_t> other;
    std::set<std::uint64_t> left;
    for (std::uint64_t point = 0; point < 14; ++point) {
      const bool is_in_one = random() % 2 == 0;
      const bool is_in_other = random() % 2 == 0;
      if (is_in_one) {
        one.insert(point);
      }
      if (is_in_other) {
        other.insert(point);
      }
      if (is_in_one && !is_in_other) {
        left.insert(point);
      }
    }
    std::set<std::uint64_t> points;
    for (const PointRun& run : difference(runs_of(one), runs_of(other))) {
      for (std::uint64_t point = run.begin; point < run.end; ++point) {
        EXPECT_TRUE(points.insert(point).second) << point << " twice";
      }
    }
    EXPECT_EQ(points, left);
  }
}

TEST(PointSet, HasWhatWasAddedWhateverItIsAskedBefore) {
  std::mt19937 random(5);  // the same sets in every run
  for (int round = 0; round < 200; ++round) {
    PointSet set;
    std::set<std::uint64_t> points;
    for (std::uint64_t point = 0; point < 40; ++point) {
      if (random() % 3 == 0) {
        points.insert(point);
        EXPECT_TRUE(set.add(point));
        EXPECT_FALSE(set.add(point)) << "it is there";
      }
    }
    EXPECT_EQ(set.runs(), runs_of(points).size());
    std::size_t near = 0;
    for (int i = 0; i < 100; ++i) {
      const std::uint64_t point = i < 42 ? static_cast<std::uint64_t>(i) : random() % 42;
      EXPECT_EQ(set.has(point, near), points.contains(point)) << point;
    }
  }
}

TEST(ColumnSource, MarksDifferFromEachOtherAndAreNoNumbers) {
  for (const float mark : {no_result(), failed_point(), left_out(), no_value(), filtered_out()}) {
    EXPECT_TRUE(mark != mark);
    EXPECT_TRUE(is_same_mark(mark, mark));
  }
  EXPECT_FALSE(is_same_mark(no_result(), failed_point()));
  EXPECT_FALSE(is_same_mark(left_out(), no_value()));
  EXPECT_FALSE(is_same_mark(filtered_out(), no_value()));
}

TEST(ColumnSource, ListsAndWordsAboutRowsAreNoPictures) {
  EXPECT_TRUE(column_source("fn_peak_N"));
  EXPECT_TRUE(column_source("major_peak_2_t_s"));
  EXPECT_TRUE(column_source("E_Pa")->is_of_model);
  EXPECT_TRUE(column_source("major_mode")->is_category);
  for (const std::string name : {"", "peaks", "worker_name", "fn_peak", "E", "lengths_m", "p.mu"}) {
    EXPECT_FALSE(column_source(name)) << name;
  }
}

TEST(United, IsThatOfTheSetsOfPoints) {
  std::mt19937 random(7);  // the same sets in every run
  for (int round = 0; round < 2000; ++round) {
    std::set<std::uint64_t> one;
    std::set<std::uint64_t> other;
    for (std::uint64_t point = 0; point < 14; ++point) {
      if (random() % 3 == 0) {
        one.insert(point);
      }
      if (random() % 3 == 0) {
        other.insert(point);
      }
    }
    const auto both = united(runs_of(one), runs_of(other));
    one.insert(other.begin(), other.end());
    EXPECT_EQ(both, runs_of(one));
  }
}

/// A database with one study, as far as columns are read of it, in memory.
class ColumnStoreTest : public testing::Test {
 protected:
  ColumnStoreTest() {
    sqlite3* database = nullptr;
    sqlite3_open(":memory:", &database);
    database_.reset(database);
    run("CREATE TABLE packed_results (study_id, point, error, mu, PRIMARY KEY (study_id, point)) "
        "WITHOUT ROWID");
    run("CREATE INDEX failed_points ON packed_results (study_id, point) WHERE error IS NOT NULL");
    run("CREATE TABLE settled_points (study_id, first_point, points)");
  }
  void run(const std::string& sql) { execute(database_.get(), sql.c_str()); }
  void settle(std::uint64_t begin, std::uint64_t end) {
    run("DELETE FROM settled_points");
    run(fmt::format("DELETE FROM packed_results WHERE point < {} OR point >= {}", begin, end));
    run(fmt::format("INSERT INTO settled_points VALUES (1, {}, {})", begin, end - begin));
    run(
        fmt::format("WITH RECURSIVE p(i) AS (SELECT {} UNION ALL SELECT i + 1 FROM p WHERE i + 1 < "
                    "{}) INSERT OR REPLACE INTO packed_results SELECT 1, i, NULL, i FROM p",
                    begin, end));
  }
  ColumnStore::Shared read() {
    return store_.read(database_.get(), 1, *column_source("mu"), kPoints, [] { return false; });
  }
  /// Ends while rows are read: the only statement that is long. A column that was read just now is
  /// not read again at once.
  void read_in_vain() {
    constexpr int kSteps = 300;
    sqlite3_progress_handler(
        database_.get(), kSteps, [](void* /*nothing*/) { return 1; }, nullptr);
    test::wait_until("the column is read", [this] {
      try {
        read();
        return false;
      } catch (const StorageError&) {
        return true;
      }
    });
    sqlite3_progress_handler(database_.get(), 0, nullptr, nullptr);
  }

  static constexpr std::uint64_t kPoints = 500;
  DatabaseHandle database_;
  ColumnStore store_;
};

TEST_F(ColumnStoreTest, AColumnThatTookTooLongIsReadWhenNobodyWaits) {
  settle(0, kPoints);
  read_in_vain();
  ASSERT_TRUE(store_.has_wishes());
  read_in_vain();  // it is one wish
  store_.fill_one(database_.get(), [] { return false; });
  EXPECT_FALSE(store_.has_wishes());
  const auto column = store_.find(database_.get(), 1, *column_source("mu"), kPoints);
  ASSERT_TRUE(column);
  EXPECT_EQ(column->part(499, 1), std::vector<float>{499.0F});
}

TEST_F(ColumnStoreTest, WhatVanishedWhileReadingFailedIsNotShown) {
  settle(0, 100);
  const auto column = read();
  EXPECT_EQ(column->part(50, 1), std::vector<float>{50.0F});
  settle(0, kPoints);
  read_in_vain();
  settle(60, kPoints);
  test::wait_until("a point has vanished", [&] {
    EXPECT_EQ(read(), column);
    return is_same_mark(column->part(50, 1).at(0), no_result());
  });
  EXPECT_EQ(column->part(60, 1), std::vector<float>{60.0F});
}

TEST_F(ColumnStoreTest, AColumnThatIsInterruptedAgainAndAgainIsReadOn) {
  settle(0, kPoints);
  read_in_vain();
  int times = 0;
  for (; times < 100 && store_.has_wishes(); ++times) {
    int looks = 0;
    constexpr int kSteps = 100;
    sqlite3_progress_handler(
        database_.get(), kSteps,
        [](void* count) { return ++*static_cast<int*>(count) > 5 ? 1 : 0; }, &looks);
    store_.fill_one(database_.get(), [] { return false; });
    sqlite3_progress_handler(database_.get(), 0, nullptr, nullptr);
  }
  EXPECT_GT(times, 1);
  EXPECT_LT(times, 100);
  const auto column = store_.find(database_.get(), 1, *column_source("mu"), kPoints);
  ASSERT_TRUE(column);
  for (std::uint64_t point = 0; point < kPoints; ++point) {
    EXPECT_EQ(column->part(point, 1), std::vector<float>{static_cast<float>(point)});
  }
}

TEST_F(ColumnStoreTest, PointsThatFailedBeyondThoseOfTheColumnAreNoneOfIt) {
  settle(0, kPoints);
  run("UPDATE packed_results SET error = 'no' WHERE point IN (7, 600)");
  run("INSERT INTO packed_results VALUES (1, 600, 'no', NULL)");
  EXPECT_TRUE(is_same_mark(read()->part(7, 1).at(0), failed_point()));
}

TEST_F(ColumnStoreTest, WhoWaitsForAColumnThatAnotherReadsGoesInTime) {
  settle(0, kPoints);
  read();
  std::atomic<bool> is_read = false;
  std::atomic<bool> may_end = false;
  std::thread another([&] {
    settle(0, kPoints);
    struct Both {
      std::atomic<bool>& is_read;
      std::atomic<bool>& may_end;
    } both{is_read, may_end};
    sqlite3_progress_handler(
        database_.get(), 1,
        [](void* given) {
          const Both& flags = *static_cast<Both*>(given);
          flags.is_read = true;
          while (!flags.may_end) {
            std::this_thread::yield();
          }
          return 0;
        },
        &both);
    while (!is_read) {
      read();
    }
  });
  while (!is_read) {
    std::this_thread::yield();
  }
  EXPECT_THROW(store_.read(nullptr, 1, *column_source("mu"), kPoints, [] { return true; }),
               StorageError);
  may_end = true;
  another.join();
}

}  // namespace
}  // namespace oblique::server
