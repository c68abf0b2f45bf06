#include "server/web/answers/column_store.h"

#include "server/web/answers/point_set.h"

#include <random>
#include <set>

#include <gtest/gtest.h>

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
  EXPECT_TRUE(column_source("E_Pa")->is_of_model);
  EXPECT_TRUE(column_source("major_mode")->is_category);
  for (const std::string name : {"", "peaks", "worker_name", "fn_peak", "E", "lengths_m", "p.mu"}) {
    EXPECT_FALSE(column_source(name)) << name;
  }
}

}  // namespace
}  // namespace oblique::server
