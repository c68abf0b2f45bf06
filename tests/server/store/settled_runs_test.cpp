#include "server/store/rows/settled_runs.h"

#include <algorithm>
#include <numeric>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "server/maintenance/check.h"
#include "server/reading/reader.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class SettledRunsTest : public testing::Test {
 protected:
  AddStudy study_of(std::uint64_t points, std::uint64_t id = 1, const std::string& name = "a") {
    return {id, name, table_of(points), "2024-01-01T00:00:00.000Z", {}};
  }
  AddResults results_of(const AddStudy& study, const std::vector<std::uint64_t>& points,
                        bool failed = false) {
    AddResults change{
        study.study_id, study.table.get(), 1, "0.1", "avx2", 1, "2024-01-01T00:00:01.000Z", {}};
    for (const std::uint64_t point : points) {
      change.results.push_back(failed ? protocol::failed_point(point, "it did not end")
                                      : solved_point(point));
    }
    return change;
  }
  void commit(Store& store, const std::vector<Change>& changes) { store.commit(changes); }

  /// "first+points" of each run of study 1.
  std::vector<std::string> runs() {
    std::vector<std::string> found;
    const auto reply = Reader(path_).query(
        "SELECT first_point || '+' || points FROM settled_points WHERE study_id = 1"
        " ORDER BY first_point",
        kNoLimits);
    for (const auto& row : reply.rows()) {
      found.push_back(row.values(0).text());
    }
    return found;
  }
  void by_hand(const std::string& sql) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    execute(database.get(), sql);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  const AddWorker worker_{1, "host", 2, "0.1", "avx2", "now"};
};

TEST_F(SettledRunsTest, NeighboursAreOneRunWhicheverCameFirst) {
  Store store(path_);
  const auto study = study_of(20);
  commit(store, {study, worker_, results_of(study, {3, 4, 9})});
  EXPECT_THAT(runs(), ElementsAre("3+2", "9+1"));
  commit(store, {results_of(study, {8, 10}), results_of(study, {2})});
  EXPECT_THAT(runs(), ElementsAre("2+3", "8+3"));
  commit(store, {results_of(study, {5, 6, 7})});
  EXPECT_THAT(runs(), ElementsAre("2+9"));
  commit(store, {results_of(study, {0, 1, 2, 3, 11, 19})});  // some again
  EXPECT_THAT(runs(), ElementsAre("0+12", "19+1"));
}

TEST_F(SettledRunsTest, PointsInNoOrderMakeOneRunInTheEnd) {
  Store store(path_);
  const auto study = study_of(500);
  commit(store, {study, worker_});
  std::vector<std::uint64_t> points(500);
  std::iota(points.begin(), points.end(), 0U);
  std::shuffle(points.begin(), points.end(), std::mt19937(7));
  for (std::size_t i = 0; i < points.size(); i += 25) {
    commit(store, {results_of(study, {points.begin() + static_cast<std::ptrdiff_t>(i),
                                      points.begin() + static_cast<std::ptrdiff_t>(i) + 25})});
  }
  EXPECT_THAT(runs(), ElementsAre("0+500"));
}

TEST_F(SettledRunsTest, ATransactionThatFailsSettlesNothing) {
  Store store(path_);
  const auto study = study_of(9);
  commit(store, {study, worker_});
  EXPECT_THROW(commit(store, {results_of(study, {1, 2}), study_of(3, 2, "a")}), StorageError);
  EXPECT_THAT(runs(), ElementsAre());
  commit(store, {results_of(study, {5})});
  EXPECT_THAT(runs(), ElementsAre("5+1"));
}

TEST_F(SettledRunsTest, FailuresThatAreForgottenLeaveTheirRun) {
  Store store(path_);
  const auto study = study_of(9);
  commit(store, {study, worker_, results_of(study, {0, 1, 2, 6, 7, 8}),
                 results_of(study, {3, 4, 5}, true)});
  EXPECT_THAT(runs(), ElementsAre("0+9"));
  IntervalSet failed(4, 6);
  commit(store, {ForgetFailures{1, failed, "now"}});
  EXPECT_THAT(runs(), ElementsAre("0+4", "6+3"));
  // In one transaction, too: what fails there is forgotten there.
  commit(store, {results_of(study, {4}, true), ForgetFailures{1, IntervalSet(4, 5), "now"}});
  EXPECT_THAT(runs(), ElementsAre("0+4", "6+3"));
}

TEST_F(SettledRunsTest, RowsDeletedByHandAreMissedByTheNextStart) {
  {
    Store store(path_);
    const auto study = study_of(9);
    commit(store, {study, worker_, results_of(study, {0, 1, 2, 3, 4, 5, 6, 7, 8}),
                   SetStudyState{1, StudyState::kDone, "now"}});
  }
  by_hand("DELETE FROM results WHERE point IN (3, 4)");
  const auto status = Reader(path_).study_status("a");
  EXPECT_EQ(status.at(0).solved(), 7U);
  EXPECT_EQ(find_faults(path_).size(), 1U);  // done, with 7 of 9
  Store store(path_);
  const auto studies = store.studies();
  EXPECT_EQ(studies.at(0).settled.size(), 7U);
  EXPECT_FALSE(studies.at(0).settled.contains(4));
  EXPECT_THAT(runs(), ElementsAre("0+3", "5+4"));
}

TEST_F(SettledRunsTest, WhatIsDeletedWhileAServerRunsStaysInDoubtBesideItsOwnDeletions) {
  Store store(path_);
  const auto study = study_of(9);
  commit(store, {study, worker_, results_of(study, {0, 1, 2, 3}), results_of(study, {8}, true)});
  by_hand("DELETE FROM results WHERE point = 1");
  commit(store, {ForgetFailures{1, IntervalSet(8, 9), "now"}});
  commit(store, {results_of(study, {5})});
  EXPECT_EQ(store.studies().at(0).settled.size(), 4U);
  EXPECT_THAT(runs(), ElementsAre("0+1", "2+2", "5+1"));
}

TEST_F(SettledRunsTest, PointsThatAFilterLeavesOutAreSettledWithoutARowUntilRowsAreCountedAgain) {
  AddStudy study = study_of(10);
  protocol::Recipe recipe = study.table->recipe();
  recipe.mutable_blocks(0)->set_where("mu > 0.4");
  study.table = std::make_shared<const protocol::PointTable>(recipe);
  {
    Store store(path_);
    AddResults change = results_of(study, {4, 5, 8});
    change.left_out.insert(0, 3);
    commit(store, {study, worker_, change});
    AddResults only_ranges = results_of(study, {});
    only_ranges.left_out.insert(3);
    commit(store, {only_ranges});
  }
  EXPECT_THAT(runs(), ElementsAre("0+6", "8+1"));
  EXPECT_THAT(find_faults(path_), ElementsAre());
  EXPECT_EQ(Reader(path_).study_status("a").at(0).left_out(), 4U);
  EXPECT_EQ(Reader(path_).study_status("a").at(0).solved(), 3U);
  {
    const auto found = Store(path_).studies().at(0);
    EXPECT_EQ(found.settled.size(), 7U);
    EXPECT_EQ(found.left_out, 4U);
  }
  by_hand("UPDATE studies SET left_out = 3");
  EXPECT_THAT(find_faults(path_), ElementsAre(HasSubstr("they are not the same")));
  by_hand("DELETE FROM results WHERE point = 5");
  const auto found = Store(path_).studies().at(0);
  EXPECT_EQ(found.settled.size(), 2U) << "workers name them again";
  EXPECT_EQ(found.left_out, 0U);
  EXPECT_THAT(find_faults(path_), ElementsAre());
}

TEST_F(SettledRunsTest, CheckNamesRunsThatAreNotTheRows) {
  {
    Store store(path_);
    const auto study = study_of(9);
    commit(store, {study, worker_, results_of(study, {0, 1, 2, 5})});
  }
  EXPECT_THAT(find_faults(path_), ElementsAre());
  by_hand("UPDATE settled_points SET points = 4 WHERE first_point = 0");
  EXPECT_THAT(find_faults(path_),
              ElementsAre(testing::AllOf(HasSubstr("study a: settled_points has 5 points and"),
                                         HasSubstr("results 4, and they are not the same"))));
  by_hand("UPDATE studies SET counted = 0");
  { EXPECT_EQ(Store(path_).studies().at(0).settled.size(), 4U); }
  EXPECT_THAT(find_faults(path_), ElementsAre());
}

}  // namespace
}  // namespace oblique::server
