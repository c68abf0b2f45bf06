#include "server/study/interval_set.h"

#include <random>
#include <set>

#include <gtest/gtest.h>

namespace oblique::server {
namespace {

TEST(IntervalSetTest, TouchingIntervalsBecomeOne) {
  IntervalSet set;
  set.insert(0, 5);
  set.insert(10, 15);
  EXPECT_EQ(set.intervals(), 2U);
  set.insert(5, 10);
  EXPECT_EQ(set.intervals(), 1U);
  EXPECT_EQ(set.front(), (Interval{0, 15}));
}

TEST(IntervalSetTest, ErasingTheMiddleLeavesBothEnds) {
  IntervalSet set(0, 100);
  set.erase(40, 60);
  EXPECT_EQ(set.size(), 80U);
  EXPECT_TRUE(set.contains(39));
  EXPECT_FALSE(set.contains(40));
  EXPECT_FALSE(set.contains(59));
  EXPECT_TRUE(set.contains(60));
}

TEST(IntervalSetTest, WithinGivesThePartsInsideARange) {
  IntervalSet set(0, 10);
  set.insert(20, 30);
  EXPECT_EQ(set.within(5, 25), (std::vector<Interval>{{5, 10}, {20, 25}}));
  EXPECT_TRUE(set.within(10, 20).empty());
}

TEST(IntervalSetTest, BehavesAsASetOfPointsUnderRandomChanges) {
  std::mt19937 random(7);
  IntervalSet set;
  std::set<std::uint64_t> reference;
  for (int step = 0; step < 2000; ++step) {
    const std::uint64_t begin = random() % 60;
    const std::uint64_t end = begin + random() % 12;
    const bool insert = random() % 2 == 0;
    for (std::uint64_t point = begin; point < end; ++point) {
      insert ? void(reference.insert(point)) : void(reference.erase(point));
    }
    insert ? set.insert(begin, end) : set.erase(begin, end);
    ASSERT_EQ(set.size(), reference.size()) << "step " << step;
    for (std::uint64_t point = 0; point < 75; ++point) {
      ASSERT_EQ(set.contains(point), reference.contains(point)) << "step " << step;
      const auto from = reference.lower_bound(point);
      const auto part = set.first_from(point);
      ASSERT_EQ(part.has_value(), from != reference.end()) << "step " << step;
      ASSERT_TRUE(!part || part->begin == *from) << "step " << step;
      ASSERT_TRUE(!part || !set.contains(part->end)) << "step " << step;
    }
    std::uint64_t last_end = 0;
    bool first = true;
    set.for_each([&](const Interval& interval) {
      ASSERT_LT(interval.begin, interval.end);
      ASSERT_TRUE(first || interval.begin > last_end) << "step " << step;
      first = false;
      last_end = interval.end;
    });
  }
}

}  // namespace
}  // namespace oblique::server
