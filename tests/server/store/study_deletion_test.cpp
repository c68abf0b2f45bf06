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
  static AddResults all_results_of(std::uint64_t id, const StudyTable& table,
                                   std::uint64_t worker_id) {
    AddResults results{id, table.get(), worker_id, "0.1", "avx2", 1, "then", {}};
    for (std::uint64_t point = 0; point < table.size(); ++point) {
      results.results.push_back(solved_point(point));
    }
    return results;
  }
  /// A study called by its number, all of whose points are solved by the worker of that number.
  void add_solved(std::uint64_t id, const StudyTable& table) {
    commit({AddStudy{id, "study " + std::to_string(id), table, "created"}, worker(id),
            all_results_of(id, table, id)});
  }
  std::int64_t rows_in(const std::string& from) const {
    return number("SELECT count(*) FROM " + from);
  }
  /// Number of steps until all is cleared away.
  int clear_all(std::size_t most) {
    int steps = 1;
    while (store().clear_away(most) != ClearedAway::kAll) {
      ++steps;
    }
    return steps;
  }
};

TEST_F(StudyDeletionTest, AStudyThatGrowsOrIsRenamedKeepsItsRowsAndARightChecksum) {
  add_solved(1, table_of(3));
  protocol::Recipe grown = table_of(3)->recipe();
  *grown.add_blocks() = table_of(2)->recipe().blocks(0);
  commit({SetStudyState{1, StudyState::kDone, "then"}});
  commit({GrowStudy{1, std::make_shared<const protocol::PointTable>(grown), 2, "now"},
          RenameStudy{1, "another name"}});
  reopen();
  const auto study = store().studies().at(0);
  EXPECT_EQ(study.name, "another name");
  EXPECT_EQ(study.table.size(), 5U);
  EXPECT_EQ(study.state, StudyState::kRunning);
  EXPECT_EQ(study.completed, IntervalSet(0, 3));
  EXPECT_EQ(study.priority, 2);
  EXPECT_EQ(study.created_at, "created");
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StudyDeletionTest, ADeletedStudyIsGoneAtOnceAndItsRowsGoAFewAtATime) {
  add_solved(1, table_of(100));
  add_solved(2, table_of(50));
  commit({DeleteStudy{1}});
  EXPECT_THAT(store().studies(), SizeIs(1));
  EXPECT_EQ(rows_in("runs"), 50);
  commit({AddStudy{3, "study 1", table_of(4), "now"}});  // the name is free
  EXPECT_EQ(store().clear_away(10), ClearedAway::kPart);
  EXPECT_EQ(rows_in("results WHERE study_id = 1"), 90);
  EXPECT_GT(clear_all(10), 9);
  EXPECT_EQ(rows_in("results WHERE study_id = 1"), 0);
  EXPECT_EQ(rows_in("results WHERE study_id = 2"), 50);
  EXPECT_EQ(rows_in("completed_ranges WHERE study_id = 1"), 0);
  EXPECT_EQ(store().cleared_rows(), 100U);
  EXPECT_EQ(store().clear_away(10), ClearedAway::kAll);
}

TEST_F(StudyDeletionTest, AfterAKillTheNextProcessContinues) {
  for (int steps = 0; steps < 8; ++steps) {
    const std::uint64_t id = static_cast<std::uint64_t>(2 * steps + 1);
    add_solved(id, table_of(20));
    add_solved(id + 1, table_with_k(1e7 + steps, 20));
    commit({DeleteStudy{id + 1}});
    for (int step = 0; step < steps; ++step) {
      (void)store().clear_away(4);
    }
    reopen();
    EXPECT_THAT(faults(), IsEmpty()) << "after step " << steps;
    clear_all(4);
    EXPECT_EQ(rows_in("results"), 20 * (steps + 1));
    reopen();
    EXPECT_EQ(rows_in("models"), 1);
    EXPECT_EQ(rows_in("workers"), steps + 1);
    EXPECT_EQ(rows_in("deletions"), 0);
    EXPECT_EQ(store().last_study_id(), id + 1);
  }
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StudyDeletionTest, LateChangesOfADeletedStudyAreDropped) {
  add_solved(1, table_of(5));
  commit({DeleteStudy{1}, all_results_of(1, table_of(5), 1)});
  clear_all(100);
  commit({all_results_of(1, table_of(5), 1), SetStudyState{1, StudyState::kDone, "now"},
          ForgetFailures{1, IntervalSet(0, 5), "now"}});
  EXPECT_EQ(rows_in("results"), 0);
  EXPECT_THAT(store().studies(), IsEmpty());
}

TEST_F(StudyDeletionTest, ADeletionThatIsRolledBackDeletesNothing) {
  add_solved(1, table_of(5));
  EXPECT_THROW(commit({DeleteStudy{1}, AddStudy{2, "b", table_of(1), "now"},
                       AddStudy{3, "b", table_of(1), "now"}}),
               StorageError);
  clear_all(100);
  EXPECT_THAT(store().studies(), SizeIs(1));
  commit({GrowStudy{1, table_of(6), {}, "now"}, all_results_of(1, table_of(6), 1)});
  EXPECT_EQ(rows_in("results"), 6) << "later results are stored";
}

TEST_F(StudyDeletionTest, ModelsAndWorkersWithoutRowsGoAtTheNextStartOnceAllRowsAreGone) {
  add_solved(1, table_with_k(1e7, 20));
  add_solved(2, table_with_k(2e7, 20));
  add_solved(3, table_with_k(2e7, 20));
  commit({DeleteStudy{1}, DeleteStudy{2}});
  reopen();
  EXPECT_EQ(rows_in("models"), 2) << "rows are left";
  clear_all(7);
  EXPECT_EQ(rows_in("models"), 2) << "they may come into use again";
  reopen();
  EXPECT_EQ(rows_in("models"), 1);
  EXPECT_EQ(rows_in("workers"), 1);
  EXPECT_EQ(rows_in("results JOIN models USING (model_id)"), 20);
  EXPECT_EQ(number("SELECT has_orphans FROM about"), 0);
  add_solved(4, table_with_k(1e7, 3));
  EXPECT_EQ(rows_in("results JOIN models USING (model_id) WHERE k = 1e7"), 3)
      << "a model that was deleted comes again";
}

TEST_F(StudyDeletionTest, WhileAReaderKeepsTheLogLongItWaits) {
  add_solved(1, table_of(2000));
  add_solved(2, table_of(2000));
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
  EXPECT_EQ(rows_in("results WHERE study_id = 1"), 0);
}

}  // namespace
}  // namespace oblique::server
