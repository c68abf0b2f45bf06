#include "server/store/completed_ranges.h"

#include <random>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/store/schema.h"
#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;

class CompletedRangesTest : public StoreFixture {
 protected:
  /// "first+points" of each range of study 1.
  std::vector<std::string> ranges() const {
    return rows(
        "SELECT first_point || '+' || points FROM completed_ranges WHERE study_id = 1"
        " ORDER BY first_point");
  }
};

TEST_F(CompletedRangesTest, RetriedFailuresLeaveTheirRangeAndTheStudyStaysCounted) {
  const auto study = study_of(9);
  commit({study, worker(1), solved(study, {0, 1, 2, 6, 7, 8}), failed(study, {3, 4, 5})});
  EXPECT_THAT(ranges(), ElementsAre("0+9"));
  commit({ForgetFailures{1, IntervalSet(4, 7), "now"}});
  EXPECT_THAT(ranges(), ElementsAre("0+4", "6+3")) << "only failures are forgotten";
  // What fails in a transaction can be forgotten in it.
  commit({failed(study, {4}), ForgetFailures{1, IntervalSet(4, 5), "now"}});
  EXPECT_THAT(ranges(), ElementsAre("0+4", "6+3"));
  EXPECT_THAT(rows("SELECT counted FROM studies"), ElementsAre("1"));
  close();
  EXPECT_EQ(store().studies().at(0).failures, IntervalSet(3, 4));
}

TEST_F(CompletedRangesTest, RowsDeletedByHandWhileAServerRunsAreOpenAfterTheNextStart) {
  const auto study = study_of(9);
  const auto other = study_of(9, 2, "b");
  commit({study, other, worker(1), solved(study, {0, 1, 2, 3}), failed(study, {8}),
          solved(other, {0, 1})});
  by_hand("DELETE FROM results WHERE study_id = 1 AND point = 1");
  commit({ForgetFailures{1, IntervalSet(8, 9), "now"}});
  commit({solved(study, {5})});
  EXPECT_THAT(rows("SELECT counted FROM studies"), ElementsAre("0", "1"));
  close();
  EXPECT_EQ(store().studies().at(0).completed.size(), 4U);
  EXPECT_THAT(ranges(), ElementsAre("0+1", "2+2", "5+1"));
  EXPECT_EQ(store().studies().at(1).completed, IntervalSet(0, 2));
}

/// The ranges of a study in an open database.
IntervalSet written_ranges(sqlite3* database, std::uint64_t study, std::size_t& count) {
  Statement row(database, "SELECT first_point, points FROM completed_ranges WHERE study_id = ?");
  row.bind(1, study);
  IntervalSet points;
  for (count = 0; row.step(); ++count) {
    const auto begin = static_cast<std::uint64_t>(row.integer(0));
    points.insert(begin, begin + static_cast<std::uint64_t>(row.integer(1)));
  }
  return points;
}

/// Random additions and removals of points and ranges, against a set of points.
TEST(CompletedRanges, RandomChangesLeaveThePointsOfASetInTheFewestRanges) {
  constexpr std::uint64_t kPoints = 60;
  const DatabaseHandle database = open_database(":memory:", SQLITE_OPEN_READWRITE);
  create_tables(database.get());
  CompletedRanges ranges(database.get());
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    std::set<std::uint64_t> expected;
    for (int step = 0; step < 100; ++step) {
      const std::uint64_t begin = random() % kPoints;
      const std::uint64_t end = std::min<std::uint64_t>(kPoints, begin + 1 + random() % 12);
      switch (random() % 4) {
        case 0:
          ranges.add(seed, begin);
          expected.insert(begin);
          break;
        case 1:  // as points that a condition leaves out
          ranges.add(seed, Interval{begin, end});
          for (std::uint64_t point = begin; point < end; ++point) {
            expected.insert(point);
          }
          break;
        case 2:  // rolled back
          ranges.add(seed, Interval{begin, end});
          ranges.forget();
          break;
        default:
          IntervalSet gone(begin, end);
          gone.insert(random() % kPoints);
          ranges.remove(seed, gone);
          gone.for_each([&](const Interval& interval) {
            expected.erase(expected.lower_bound(interval.begin),
                           expected.lower_bound(interval.end));
          });
      }
      ranges.flush();
      IntervalSet points;
      for (const std::uint64_t point : expected) {
        points.insert(point);
      }
      std::size_t count = 0;
      ASSERT_EQ(written_ranges(database.get(), seed, count), points)
          << "seed " << seed << ", step " << step;
      ASSERT_EQ(count, points.intervals()) << "seed " << seed << ", step " << step;
      IntervalSet overlapping;
      points.for_each([&](const Interval& range) {
        if (range.begin < end && range.end > begin) {
          overlapping.insert(range.begin, range.end);
        }
      });
      ASSERT_EQ(ranges.overlapping(seed, {begin, end}), overlapping);
    }
  }
}

TEST_F(CompletedRangesTest, PointsThatAFilterLeavesOutAreExaminedAgainWhenRowsAreCountedAgain) {
  AddStudy study = study_of(10);
  protocol::Recipe recipe = study.table->recipe();
  recipe.mutable_blocks(0)->set_where("mu > 0.4");
  study.table = std::make_shared<const protocol::PointTable>(recipe);
  AddResults some = solved(study, {4, 5, 8});
  some.left_out.insert(0, 4);
  commit({study, worker(1), some});
  EXPECT_THAT(ranges(), ElementsAre("0+6", "8+1"));
  close();
  EXPECT_EQ(store().studies().at(0).completed.size(), 7U);
  EXPECT_EQ(store().studies().at(0).left_out, 4U);
  close();
  by_hand("DELETE FROM results WHERE point = 5");
  EXPECT_EQ(store().studies().at(0).left_out, 0U);
  EXPECT_THAT(ranges(), ElementsAre("4+1", "8+1"));
}

TEST_F(CompletedRangesTest, OnlyPointsThatWereOpenAreCountedAsLeftOut) {
  AddStudy study = study_of(10);
  protocol::Recipe recipe = study.table->recipe();
  recipe.mutable_blocks(0)->set_where("mu < 0.5");
  study.table = std::make_shared<const protocol::PointTable>(recipe);
  AddResults again = solved(study, {4});
  again.left_out.insert(3, 7);
  commit({study, worker(1), solved(study, {3})});
  commit({again});
  EXPECT_EQ(store().studies().at(0).left_out, 2U) << "points 5 and 6";
  commit({again});
  EXPECT_EQ(store().studies().at(0).left_out, 2U) << "they come again";
  EXPECT_THAT(ranges(), ElementsAre("3+4"));
}

TEST_F(CompletedRangesTest, APointThatHadARowAlreadyIsCompletedByItsResult) {
  const auto study = study_of(10);
  commit({study, worker(1), solved(study, {3, 4})});
  by_hand("DELETE FROM completed_ranges");
  commit({solved(study, {4})});
  EXPECT_THAT(ranges(), ElementsAre("4+1"));
}

}  // namespace
}  // namespace oblique::server
