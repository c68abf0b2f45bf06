#include "server/store/schema/schema_setup.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/point_table.h"
#include "server/maintenance/check.h"
#include "server/query/plan.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// A database with three solved points, and what other programs do to it.
class SchemaSetupTest : public testing::Test {
 protected:
  SchemaSetupTest() {
    Store store(path_);
    store.commit(
        std::vector<Change>{AddStudy{1, "a", table_of(3), "then", {}},
                            AddResults{1,
                                       table_of(3),
                                       0,
                                       "0.1",
                                       "avx2",
                                       1,
                                       "2024-01-01T00:00:01.000Z",
                                       {solved_point(0), solved_point(1), solved_point(2)}}});
  }
  void run(const std::string& sql) {
    execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), sql);
  }
  std::vector<std::string> texts(const std::string& sql) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    Statement statement(database.get(), sql);
    std::vector<std::string> found;
    while (statement.step()) {
      found.push_back(statement.text(0));
    }
    return found;
  }
  void start() { const Store store(path_); }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  std::string schema_sql_ =
      "SELECT type || ' ' || name || ' ' || sql FROM sqlite_schema"
      " WHERE type <> 'table' AND sql IS NOT NULL ORDER BY name";
};

TEST_F(SchemaSetupTest, EachStartCreatesWhatWasDropped) {
  const auto before = texts(schema_sql_);
  ASSERT_EQ(before.size(), 11U);
  for (const std::string dropped :
       {"view runs", "view results", "view peaks", "view phases", "view stick_intervals",
        "view reaction_peaks", "trigger delete_results", "trigger update_results",
        "trigger rows_are_gone", "index failed_points", "index solved_points"}) {
    run("DROP " + dropped);
    if (dropped.starts_with("view")) {
      EXPECT_THAT(find_faults(path_), Contains(HasSubstr("the " + dropped + " is missing")));
    }
    start();
    EXPECT_EQ(texts(schema_sql_), before) << dropped;
    EXPECT_THAT(find_faults(path_), Not(Contains(HasSubstr("missing")))) << dropped;
  }
  EXPECT_THAT(texts("SELECT count(*) FROM runs"), ElementsAre("3"));
}

TEST_F(SchemaSetupTest, AReplacedViewIsOursAgainAndViewsWithOtherNamesStay) {
  run("CREATE VIEW large AS SELECT * FROM runs WHERE fn_peak_N > 1e3;"
      "DROP VIEW results; CREATE VIEW results AS SELECT study_id, point FROM packed_results;");
  start();
  EXPECT_THAT(texts("SELECT count(*) FROM large"), ElementsAre("3"));
  run("DELETE FROM results WHERE point = 1");
  EXPECT_THAT(texts("SELECT count(*) FROM runs"), ElementsAre("2"));
}

TEST_F(SchemaSetupTest, AFileWithATriggerThatIsNotOursIsRefusedWithItsName) {
  run("CREATE TRIGGER endless AFTER INSERT ON studies BEGIN"
      " SELECT count(*) FROM (WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
      " SELECT i FROM n); END;");
  EXPECT_THAT([this] { start(); }, testing::ThrowsMessage<StorageError>(AllOf(
                                       HasSubstr("triggers that are not ours"),
                                       HasSubstr("endless"), Not(HasSubstr("rows_are_gone")))));
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("the trigger endless is not ours")));
  run("DROP TRIGGER endless");
  EXPECT_NO_THROW(start());
}

TEST_F(SchemaSetupTest, ATriggerThatHasOneOfOurNamesIsOursAgain) {
  const auto before = texts(schema_sql_);
  run("DROP TRIGGER rows_are_gone;"
      "CREATE TRIGGER rows_are_gone AFTER INSERT ON packed_results BEGIN SELECT 1; END");
  start();
  EXPECT_EQ(texts(schema_sql_), before);
}

TEST_F(SchemaSetupTest, AFileWithAViewInThePlaceOfATableIsRefused) {
  run("DROP TABLE about; CREATE VIEW about AS WITH RECURSIVE n(i) AS"
      " (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS database_id FROM n WHERE i < 0;");
  EXPECT_THAT([this] { start(); },
              testing::ThrowsMessage<StorageError>(HasSubstr("lacks the table about")));
}

TEST_F(SchemaSetupTest, AFileWithATableInThePlaceOfAViewIsRefusedAndTheTableStays) {
  run("DROP VIEW runs; CREATE TABLE runs (mine)");
  EXPECT_THAT([this] { start(); }, testing::ThrowsMessage<StorageError>(
                                       AllOf(HasSubstr("runs"), HasSubstr("rename the table"))));
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("the view runs is missing")));
  EXPECT_THAT(texts("SELECT type FROM sqlite_schema WHERE name = 'runs'"), ElementsAre("table"));
}

TEST_F(SchemaSetupTest, RowsAreCheckedWithoutTheViewsOfTheFile) {
  run("DROP VIEW runs; DROP VIEW results;"
      "UPDATE packed_results SET mu = mu + 1, checksum = NULL WHERE point = 1");
  EXPECT_THAT(find_faults(path_), Contains(AllOf(HasSubstr("point 1"), HasSubstr("mu is"))));
}

TEST_F(SchemaSetupTest, RowsThatWereDeletedWithoutTheTriggerAreCountedAgain) {
  run("DROP TRIGGER rows_are_gone; DELETE FROM packed_results WHERE point = 1");
  EXPECT_THAT(texts("SELECT counted FROM studies"), ElementsAre("1"));
  start();
  EXPECT_THAT(texts("SELECT counted FROM studies"), ElementsAre("0"));
}

TEST_F(SchemaSetupTest, AQuestionThatNeedsAMissingViewNamesItAndTheRemedy) {
  run("DROP VIEW runs");
  protocol::StudyQuery question;
  question.set_study("a");
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
  EXPECT_THAT([&] { plan(database.get(), question); },
              testing::ThrowsMessage<solver::InputError>(AllOf(
                  HasSubstr("the database lacks its view runs"), HasSubstr("makes it again"))));
}

}  // namespace
}  // namespace oblique::server
