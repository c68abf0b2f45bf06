#include "server/store/completed_ranges.h"

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/store/schema.h"
#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;

class CompletedRangesTest : public StoreFixture {
 protected:
  /// Returns "first+points" for each range of completed points of a study.
  static std::vector<std::string> ranges(sqlite3* database, unsigned study) {
    return rows(database, fmt::format("SELECT first_point || '+' || points FROM completed_ranges"
                                      " WHERE study_id = {} ORDER BY first_point",
                                      study));
  }
  std::vector<std::string> ranges() const {
    return ranges(open_database(path_, SQLITE_OPEN_READONLY).get(), 1);
  }
};

TEST_F(CompletedRangesTest,
       RetriedFailuresAreRemovedFromTheirRangeAndTheStudyStaysMarkedAsCounted) {
  const auto study = study_of(9);
  commit({study, worker(1), solved(study, {0, 1, 2, 6, 7, 8}), failed(study, {3, 4, 5})});
  EXPECT_THAT(ranges(), ElementsAre("0+9"));
  commit({ForgetFailures{1, IntervalSet(4, 7), "now"}});
  EXPECT_THAT(ranges(), ElementsAre("0+4", "6+3")) << "only failures are forgotten";
  // One transaction may store a failure and also delete it.
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
  execute_sql("DELETE FROM results WHERE study_id = 1 AND point = 1");
  commit({ForgetFailures{1, IntervalSet(8, 9), "now"}});
  commit({solved(study, {5})});
  EXPECT_THAT(rows("SELECT counted FROM studies"), ElementsAre("0", "1"));
  close();
  EXPECT_EQ(store().studies().at(0).completed.size(), 4U);
  EXPECT_THAT(ranges(), ElementsAre("0+1", "2+2", "5+1"));
  EXPECT_EQ(store().studies().at(1).completed, IntervalSet(0, 2));
}

/// Adds and removes random points and ranges.
TEST_F(CompletedRangesTest, RandomChangesGiveTheFewestRanges) {
  constexpr std::uint64_t kPoints = 60;
  const DatabaseHandle database = open_database(":memory:", SQLITE_OPEN_READWRITE);
  create_tables(database.get());
  CompletedRanges written(database.get());
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    IntervalSet expected;
    for (int step = 0; step < 100; ++step) {
      const std::uint64_t begin = random() % kPoints;
      const std::uint64_t end = std::min<std::uint64_t>(kPoints, begin + 1 + random() % 12);
      switch (random() % 4) {
        case 0:
          written.add(seed, begin);
          expected.insert(begin);
          break;
        case 1:  // as left-out points
          written.add(seed, Interval{begin, end});
          expected.insert(begin, end);
          break;
        case 2:  // rolled back
          written.add(seed, Interval{begin, end});
          written.forget();
          break;
        default:
          IntervalSet gone(begin, end);
          gone.insert(random() % kPoints);
          written.remove(seed, gone);
          gone.for_each([&](const Interval& part) { expected.erase(part.begin, part.end); });
      }
      written.flush();
      std::vector<std::string> fewest;
      IntervalSet overlapping;
      expected.for_each([&](const Interval& range) {
        fewest.push_back(fmt::format("{}+{}", range.begin, range.end - range.begin));
        if (range.begin < end && range.end > begin) {
          overlapping.insert(range.begin, range.end);
        }
      });
      ASSERT_EQ(ranges(database.get(), seed), fewest) << "seed " << seed << ", step " << step;
      ASSERT_EQ(written.overlapping(seed, {begin, end}), overlapping);
    }
  }
}

TEST_F(CompletedRangesTest, PointsThatAFilterLeavesOutAreExaminedAgainWhenRowsAreCountedAgain) {
  const AddStudy study = study_of(filtered_table("mu > 0.4"));
  AddResults some = solved(study, {4, 5, 8});
  some.left_out.insert(0, 4);
  commit({study, worker(1), some});
  EXPECT_THAT(ranges(), ElementsAre("0+6", "8+1"));
  close();
  EXPECT_EQ(store().studies().at(0).completed.size(), 7U);
  EXPECT_EQ(store().studies().at(0).left_out, 4U);
  close();
  execute_sql("DELETE FROM results WHERE point = 5");
  EXPECT_EQ(store().studies().at(0).left_out, 0U);
  EXPECT_THAT(ranges(), ElementsAre("4+1", "8+1"));
}

TEST_F(CompletedRangesTest, OnlyPointsThatWereOpenAreCountedAsLeftOut) {
  const AddStudy study = study_of(filtered_table("mu < 0.5"));
  AddResults again = solved(study, {4});
  again.left_out.insert(3, 7);
  commit({study, worker(1), solved(study, {3})});
  commit({again});
  EXPECT_EQ(store().studies().at(0).left_out, 2U) << "points 5 and 6 are left out";
  commit({again});
  EXPECT_EQ(store().studies().at(0).left_out, 2U) << "ranges that are reported again count once";
  EXPECT_THAT(ranges(), ElementsAre("3+4"));
}

TEST_F(CompletedRangesTest, AResultCompletesAPointThatAlreadyHasARow) {
  const auto study = study_of(10);
  commit({study, worker(1), solved(study, {3, 4})});
  execute_sql("DELETE FROM completed_ranges");
  commit({solved(study, {4})});
  EXPECT_THAT(ranges(), ElementsAre("4+1"));
}

}  // namespace
}  // namespace oblique::server
