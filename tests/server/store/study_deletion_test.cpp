// Studies that grow, get another name or are deleted, as the database has it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

/// `points` points of a model with this k.
std::shared_ptr<const protocol::PointTable> table_with_k(double k, std::uint64_t points) {
  return std::make_shared<const protocol::PointTable>(protocol::recipe_of(
      {{protocol::listed("k", {k}), protocol::listed("H", {1.0}),
        protocol::range("mu", 0.0, 1.0, points), protocol::listed("e", {1.0})}}));
}

class StudyDeletionTest : public StoreFixture {
 protected:
  void reopen() {
    close();
    store();
  }
  /// A study called by its number, all of whose points are solved by that worker.
  static std::vector<Change> solved_study(std::uint64_t id, const StudyTable& table,
                                          std::uint64_t worker_id) {
    return {AddStudy{id, "study " + std::to_string(id), table, "2024-01-01T00:00:00.000Z", {}},
            worker(worker_id), all_results_of(id, table, worker_id)};
  }
  static AddResults all_results_of(std::uint64_t id, const StudyTable& table,
                                   std::uint64_t worker) {
    AddResults results{id, table.get(), worker, "0.1", "avx2", 1, "2024-01-01T00:00:01.000Z", {}};
    for (std::uint64_t point = 0; point < table.size(); ++point) {
      results.results.push_back(solved_point(point));
    }
    return results;
  }
  std::int64_t rows_of(std::uint64_t id) const {
    return number("SELECT count(*) FROM results WHERE study_id = " + std::to_string(id));
  }
  /// Steps until all is cleared away; how many that took.
  int clear_all(std::size_t most) {
    int steps = 1;
    while (store().clear_away(most) != ClearedAway::kAll) {
      ++steps;
    }
    return steps;
  }
};

/// Three points, and so many further ones.
std::shared_ptr<const protocol::PointTable> grown_table(std::uint64_t further) {
  protocol::Recipe all = table_of(3)->recipe();
  *all.add_blocks() = table_of(further)->recipe().blocks(0);
  return std::make_shared<const protocol::PointTable>(all);
}

TEST_F(StudyDeletionTest, AStudyThatGrowsHasItsRowsAndFurtherPointsAndRuns) {
  commit(solved_study(1, table_of(3), 1));
  commit({SetStudyState{1, StudyState::kDone, "then"}});
  commit({GrowStudy{1, grown_table(2), 2, "now"}});
  reopen();
  const auto study = store().studies().at(0);
  EXPECT_EQ(study.table.size(), 5U);
  EXPECT_EQ(study.state, StudyState::kRunning);
  EXPECT_EQ(study.settled, IntervalSet(0, 3));
  EXPECT_EQ(study.priority, 2);
  EXPECT_EQ(study.created_at, "2024-01-01T00:00:00.000Z");
}

TEST_F(StudyDeletionTest, TheChecksumsOfStudiesThatGrewOrWereRenamedAreRight) {
  commit(solved_study(1, table_of(3), 1));
  commit({GrowStudy{1, grown_table(4), {}, "now"}, RenameStudy{1, "another name"}});
  reopen();
  EXPECT_EQ(store().studies().at(0).name, "another name");
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StudyDeletionTest, ADeletedStudyIsGoneAtOnceAndItsRowsGoAFewAtATime) {
  commit(solved_study(1, table_of(100), 1));
  commit(solved_study(2, table_of(50), 2));
  commit({DeleteStudy{1}});
  EXPECT_THAT(store().studies(), SizeIs(1));
  EXPECT_EQ(number("SELECT count(*) FROM runs"), 50);
  EXPECT_EQ(rows_of(1), 100);
  EXPECT_EQ(store().clear_away(10), ClearedAway::kPart);
  EXPECT_EQ(rows_of(1), 90);
  EXPECT_GT(clear_all(10), 9);
  EXPECT_EQ(rows_of(1), 0);
  EXPECT_EQ(rows_of(2), 50);
  EXPECT_EQ(number("SELECT count(*) FROM completed_ranges WHERE study_id = 1"), 0);
  EXPECT_EQ(store().cleared_rows(), 100U);
  EXPECT_EQ(store().clear_away(10), ClearedAway::kAll);
}

TEST_F(StudyDeletionTest, AfterAKillTheNextProcessContinues) {
  for (int steps = 0; steps < 8; ++steps) {
    const std::uint64_t id = static_cast<std::uint64_t>(2 * steps + 1);
    commit(solved_study(id, table_of(20), id));
    commit(solved_study(id + 1, table_with_k(1e7 + steps, 20), id + 1));
    commit({DeleteStudy{id + 1}});
    for (int step = 0; step < steps; ++step) {
      (void)store().clear_away(4);
    }
    reopen();
    EXPECT_THAT(faults(), IsEmpty()) << "after step " << steps;
    clear_all(4);
    EXPECT_EQ(number("SELECT count(*) FROM results"), 20 * (steps + 1));
    reopen();
    EXPECT_EQ(number("SELECT count(*) FROM models"), 1);
    EXPECT_EQ(number("SELECT count(*) FROM workers"), steps + 1);
    EXPECT_EQ(number("SELECT count(*) FROM deletions"), 0);
    EXPECT_EQ(store().last_study_id(), id + 1);
  }
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StudyDeletionTest, ItsNumberIsNeverGivenAgainAndItsNameIsFreeAtOnce) {
  commit(solved_study(1, table_of(5), 1));
  commit({DeleteStudy{1}, AddStudy{2, "study 1", table_of(4), "now"}});
  EXPECT_EQ(store().studies().at(0).table.size(), 4U);
  commit({DeleteStudy{2}});
  clear_all(100);
  reopen();
  EXPECT_EQ(store().last_study_id(), 2U);
}

TEST_F(StudyDeletionTest, LateResultsOfADeletedStudyAreDropped) {
  commit(solved_study(1, table_of(5), 1));
  commit({DeleteStudy{1}, all_results_of(1, table_of(5), 1)});
  clear_all(100);
  commit({all_results_of(1, table_of(5), 1), SetStudyState{1, StudyState::kDone, "now"}});
  IntervalSet failed(0, 5);
  commit({ForgetFailures{1, failed, "now"}});
  EXPECT_EQ(rows_of(1), 0);
  EXPECT_THAT(store().studies(), IsEmpty());
}

TEST_F(StudyDeletionTest, ADeletionThatIsRolledBackDeletesNothing) {
  commit(solved_study(1, table_of(5), 1));
  EXPECT_THROW(commit({DeleteStudy{1}, AddStudy{2, "b", table_of(1), "now"},
                       AddStudy{3, "b", table_of(1), "now"}}),
               StorageError);
  (void)store().clear_away(100);
  clear_all(100);
  EXPECT_THAT(store().studies(), SizeIs(1));
  EXPECT_EQ(rows_of(1), 5);
  commit({GrowStudy{1, table_of(6), {}, "now"}});
  AddResults late = all_results_of(1, table_of(6), 1);
  commit({late});
  EXPECT_EQ(rows_of(1), 6) << "it is not taken for deleted";
}

TEST_F(StudyDeletionTest, ModelsAndWorkersWithoutRowsGoAtTheNextStartOnceAllRowsAreGone) {
  commit(solved_study(1, table_with_k(1e7, 20), 1));
  commit(solved_study(2, table_with_k(2e7, 20), 2));
  commit(solved_study(3, table_with_k(2e7, 20), 3));
  commit({DeleteStudy{1}, DeleteStudy{2}});
  reopen();
  EXPECT_EQ(number("SELECT count(*) FROM models"), 2) << "rows are left";
  clear_all(7);
  EXPECT_EQ(number("SELECT count(*) FROM models"), 2) << "they may come into use again";
  EXPECT_EQ(number("SELECT count(*) FROM workers"), 3);
  reopen();
  EXPECT_EQ(number("SELECT count(*) FROM models"), 1);
  EXPECT_EQ(number("SELECT count(*) FROM workers"), 1);
  EXPECT_EQ(number("SELECT count(*) FROM results JOIN models USING (model_id)"), 20);
  EXPECT_EQ(number("SELECT has_orphans FROM about"), 0);
  commit(solved_study(4, table_with_k(1e7, 3), 4));
  EXPECT_EQ(number("SELECT count(*) FROM results JOIN models USING (model_id) WHERE k = 1e7"), 3)
      << "a model that was deleted comes again";
}

TEST_F(StudyDeletionTest, AStepDoesNotReadTheStudiesThatEarlierStepsDeleted) {
  for (std::uint64_t id = 1; id <= 5; ++id) {
    commit(solved_study(id, table_of(10), id));
  }
  commit({DeleteStudy{1}, DeleteStudy{2}, DeleteStudy{3}, DeleteStudy{4}, DeleteStudy{5}});
  for (std::int64_t left = 5; left > 0; --left) {
    EXPECT_EQ(number("SELECT count(*) FROM deletions"), left);
    EXPECT_EQ(store().clear_away(100), ClearedAway::kPart);
  }
  EXPECT_EQ(store().clear_away(100), ClearedAway::kAll);
  EXPECT_EQ(number("SELECT count(*) FROM results"), 0);
}

TEST_F(StudyDeletionTest, AModelOfADeletedStudyMayBeUsedBeforeTheNextStart) {
  commit(solved_study(1, table_with_k(1e7, 5), 1));
  commit({DeleteStudy{1}});
  clear_all(100);
  commit(
      {AddStudy{2, "b", table_with_k(1e7, 5), "now"}, all_results_of(2, table_with_k(1e7, 5), 1)});
  reopen();
  EXPECT_EQ(number("SELECT count(*) FROM runs"), 5);
  EXPECT_EQ(number("SELECT count(*) FROM workers"), 1);
}

TEST_F(StudyDeletionTest, WhileAReaderKeepsTheLogLongItWaits) {
  commit(solved_study(1, table_of(2000), 1));
  commit(solved_study(2, table_of(2000), 2));
  store().checkpoint_at(1);
  const DatabaseHandle reader = open_database(path_, SQLITE_OPEN_READONLY);
  execute(reader.get(), "BEGIN");
  Statement first(reader.get(), "SELECT count(*) FROM results");
  ASSERT_TRUE(first.step());
  commit({DeleteStudy{1}});
  ClearedAway cleared = ClearedAway::kPart;
  for (int step = 0; step < 1000 && cleared == ClearedAway::kPart; ++step) {
    cleared = store().clear_away(50);
  }
  EXPECT_EQ(cleared, ClearedAway::kMustWait);
  first.reset();
  execute(reader.get(), "COMMIT");
  clear_all(500);
  EXPECT_EQ(rows_of(1), 0);
}

}  // namespace
}  // namespace oblique::server
