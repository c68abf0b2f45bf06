#include "server/store/known/known_finder.h"

#include <chrono>
#include <map>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "server/store/store.h"
#include "tests/support/hang_limit.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// A finder whose reports are waited for, beside the store of its database.
class KnownFinderTest : public testing::Test {
 protected:
  void add_study(std::uint64_t id, std::uint64_t points, StudyTerms terms = {}) {
    commit({AddStudy{id, "study " + std::to_string(id), table_of(points), "then", terms}});
  }
  void add_results(std::uint64_t id, std::uint64_t points, const IntervalSet& solved,
                   const std::string& version = "1.0", const IntervalSet& failed = {}) {
    const std::uint64_t worker = ++last_worker_;
    commit({AddWorker{worker, "host", 1, version, "avx2", "then"}});
    AddResults change{id, table_of(points),           worker, version, "avx2",
                      1,  "2024-01-01T00:00:01.000Z", {}};
    solved.for_each([&](const Interval& run) {
      for (std::uint64_t point = run.begin; point < run.end; ++point) {
        change.results.push_back(solved_point(point));
      }
    });
    failed.for_each([&](const Interval& run) {
      for (std::uint64_t point = run.begin; point < run.end; ++point) {
        change.results.push_back(protocol::failed_point(point, "it did not end"));
      }
    });
    commit({change});
    finder().note_source(id, table_of(points));
  }
  void commit(const std::vector<Change>& changes) { store_.commit(changes); }

  KnownFinder& finder() {
    if (!finder_) {
      finder_.emplace(settings_, [this](KnownReport report) {
        const std::lock_guard lock(mutex_);
        reports_.push_back(std::move(report));
        wake_.notify_all();
      });
    }
    return *finder_;
  }
  KnownReport next_report() {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(wake_.wait_for(lock, test::kHangLimit, [&] { return !reports_.empty(); }));
    KnownReport report = std::move(reports_.front());
    reports_.pop_front();
    return report;
  }
  bool has_report_within(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return wake_.wait_for(lock, time, [&] { return !reports_.empty(); });
  }
  /// All that is found for the study, with where it comes from, until the end.
  std::vector<std::pair<std::uint64_t, SharedRun>> sought(std::uint64_t id, std::uint64_t points) {
    finder().seek({id, table_of(points)});
    std::vector<std::pair<std::uint64_t, SharedRun>> found;
    while (true) {
      const KnownReport report = next_report();
      if (report.is_end) {
        was_cut_short_ = report.is_cut_short;
        return found;
      }
      for (const SharedRun& run : report.runs) {
        found.emplace_back(report.source_id, run);
      }
      finder().go_on();
    }
  }

  test::TemporaryFolder folder_;
  Store store_{folder_.file("known.db")};
  KnownFinderSettings settings_{folder_.file("known.db"), "1.0"};
  bool was_cut_short_ = false;
  std::uint64_t last_worker_ = 0;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<KnownReport> reports_;
  std::optional<KnownFinder> finder_;  // last: it uses all the others
};

using Found = std::pair<std::uint64_t, SharedRun>;

TEST_F(KnownFinderTest, FindsWhatAnotherStudySolvedAndNotWhatFailedThere) {
  add_study(1, 101);
  add_study(2, 101);
  add_results(1, 101, IntervalSet(0, 40), "1.0", IntervalSet(40, 42));
  EXPECT_THAT(sought(2, 101), ElementsAre(Found{1, {0, 0, 40}}));
}

TEST_F(KnownFinderTest, NothingIsFoundInAnEmptyDatabaseNorInTheStudyItself) {
  add_study(1, 101);
  EXPECT_THAT(sought(1, 101), IsEmpty());
  add_results(1, 101, IntervalSet(0, 40));
  EXPECT_THAT(sought(1, 101), IsEmpty());
  EXPECT_FALSE(was_cut_short_);
}

TEST_F(KnownFinderTest, ResultsOfAnotherSolverVersionAreNotTaken) {
  add_study(1, 101);
  add_study(2, 101);
  add_results(1, 101, IntervalSet(0, 40), "0.9");
  EXPECT_THAT(sought(2, 101), IsEmpty());
}

TEST_F(KnownFinderTest, APointIsSoughtInOneStudyAfterTheOtherUntilItIsFound) {
  add_study(1, 101);
  add_study(2, 101);
  add_study(3, 101);
  add_results(1, 101, IntervalSet(0, 40));
  add_results(2, 101, IntervalSet(30, 50));
  EXPECT_THAT(sought(3, 101), ElementsAre(Found{1, {0, 0, 40}}, Found{2, {40, 40, 10}}));
}

TEST_F(KnownFinderTest, PointsWithARowAreNotSought) {
  add_study(1, 101);
  add_study(2, 101);
  add_results(1, 101, IntervalSet(0, 101));
  add_results(2, 101, IntervalSet(50, 60));
  EXPECT_THAT(sought(2, 101), ElementsAre(Found{1, {0, 0, 50}}, Found{1, {60, 60, 41}}));
}

TEST_F(KnownFinderTest, AStudyThatIsDeletedGivesNothing) {
  add_study(1, 101);
  add_study(2, 101);
  add_results(1, 101, IntervalSet(0, 101));
  finder().drop_source(1);
  EXPECT_THAT(sought(2, 101), IsEmpty());
}

TEST_F(KnownFinderTest, OnlyTwoReportsAreOutAtATime) {
  settings_.chunk_points = 10;
  add_study(1, 101);
  add_study(2, 101);
  add_results(1, 101, IntervalSet(0, 101));
  finder().seek({2, table_of(101)});
  EXPECT_THAT(next_report().runs, ElementsAre(SharedRun{0, 0, 10}));
  EXPECT_THAT(next_report().runs, ElementsAre(SharedRun{10, 10, 10}));
  EXPECT_FALSE(has_report_within(std::chrono::milliseconds(50)));
  finder().go_on();
  EXPECT_THAT(next_report().runs, ElementsAre(SharedRun{20, 20, 10}));
}

TEST_F(KnownFinderTest, WhatNobodyWantsAnyMoreEndsAndTheNextStudyIsServed) {
  settings_.chunk_points = 10;
  for (const std::uint64_t id : {1U, 2U, 3U, 4U}) {
    add_study(id, 101);
  }
  add_results(1, 101, IntervalSet(0, 101));
  finder().seek({2, table_of(101)});
  finder().seek({3, table_of(101)});
  EXPECT_EQ(next_report().study_id, 2U);
  finder().stop_seeking(3);
  finder().stop_seeking(2);
  KnownReport report = next_report();
  while (!report.is_end) {
    report = next_report();
    finder().go_on();
  }
  EXPECT_EQ(report.study_id, 2U);
  report = next_report();
  EXPECT_EQ(report.study_id, 3U);
  EXPECT_TRUE(report.is_end);
}

TEST_F(KnownFinderTest, AStudyOfAHigherPriorityDoesNotWaitForTheRestOfALargerOne) {
  settings_.chunk_points = 10;
  settings_.turn = std::chrono::milliseconds(0);
  add_study(1, 101);
  add_study(2, 101);
  add_study(3, 101);
  add_results(1, 101, IntervalSet(0, 101));
  finder().seek({2, table_of(101), 0});
  EXPECT_EQ(next_report().study_id, 2U);
  EXPECT_EQ(next_report().study_id, 2U);
  finder().seek({3, table_of(101), 1});
  std::vector<std::uint64_t> ends;
  std::map<std::uint64_t, IntervalSet> found;
  found[2] = IntervalSet(0, 20);
  finder().go_on();
  finder().go_on();
  while (ends.size() < 2) {
    const KnownReport report = next_report();
    if (report.is_end) {
      EXPECT_FALSE(report.is_cut_short);
      ends.push_back(report.study_id);
      continue;
    }
    for (const SharedRun& run : report.runs) {
      for (std::uint64_t i = 0; i < run.count; ++i) {
        EXPECT_FALSE(found[report.study_id].contains(run.point + i)) << "handed over once";
        found[report.study_id].insert(run.point + i);
      }
    }
    finder().go_on();
  }
  EXPECT_THAT(ends, ElementsAre(3, 2));
  EXPECT_EQ(found[2].size(), 101U);
  EXPECT_EQ(found[3].size(), 101U);
}

TEST_F(KnownFinderTest, ASmallStudyOfTheSamePriorityDoesNotWaitForTheRestOfALargerOne) {
  settings_.chunk_points = 10;
  settings_.turn = std::chrono::milliseconds(1);
  settings_.most_turns = 30;
  add_study(1, 10'001);
  add_study(2, 10'001);
  add_study(3, 5);
  add_results(1, 10'001, IntervalSet(0, 10'001));
  finder().seek({2, table_of(10'001)});
  EXPECT_EQ(next_report().study_id, 2U);
  finder().seek({3, table_of(5)});
  finder().go_on();
  KnownReport report = next_report();
  for (; !report.is_end; report = next_report()) {
    finder().go_on();
  }
  EXPECT_EQ(report.study_id, 3U);
}

TEST_F(KnownFinderTest, ASearchThatTakesTooManyTurnsOfOthersIsCutShort) {
  settings_.chunk_points = 10;
  settings_.turn = std::chrono::milliseconds(0);
  settings_.most_turns = 1;
  add_study(1, 101);
  add_study(2, 101);
  add_study(3, 101);
  add_results(1, 101, IntervalSet(0, 101));
  finder().seek({2, table_of(101)});
  EXPECT_EQ(next_report().study_id, 2U);
  finder().seek({3, table_of(101)});
  finder().go_on();
  KnownReport report = next_report();
  for (; !report.is_end; report = next_report()) {
    finder().go_on();
  }
  EXPECT_EQ(report.study_id, 2U);
  EXPECT_TRUE(report.is_cut_short);
}

TEST_F(KnownFinderTest, ADatabaseThatCannotBeReadEndsTheSearch) {
  settings_.database = folder_.file("elsewhere.db");
  add_study(2, 101);
  EXPECT_THAT(sought(2, 101), IsEmpty());
  EXPECT_TRUE(was_cut_short_);
}

}  // namespace
}  // namespace oblique::server
