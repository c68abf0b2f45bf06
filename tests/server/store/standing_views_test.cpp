#include "server/store/schema/standing_views.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/recipe/point_table.h"
#include "server/asking/plan.h"
#include "server/care/diagnosis.h"
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

/// A database with three solved points, and what other programs do to it.
class StandingViewsTest : public testing::Test {
 protected:
  StandingViewsTest() {
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
  /// What is said when a server or a run starts on the file.
  std::vector<std::string> start() {
    std::vector<std::string> said;
    const Store store(path_, [&](const std::string& sentence) { said.push_back(sentence); });
    return said;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  std::string standing_sql_ =
      "SELECT type || ' ' || name || ' ' || sql FROM sqlite_schema"
      " WHERE type <> 'table' AND sql IS NOT NULL ORDER BY name";
};

TEST_F(StandingViewsTest, NothingIsSaidOrChangedWhereAllAreThere) {
  const auto before = texts("PRAGMA schema_version");
  EXPECT_THAT(start(), IsEmpty());
  EXPECT_EQ(texts("PRAGMA schema_version"), before);
}

TEST_F(StandingViewsTest, WhicheverIsDroppedIsNamedByACheckAndMadeAgainByAStart) {
  const auto before = texts(standing_sql_);
  ASSERT_EQ(before.size(), 11U);
  for (const std::string dropped :
       {"view runs", "view results", "view peaks", "view phases", "view stick_intervals",
        "view reaction_peaks", "trigger delete_results", "trigger update_results",
        "trigger rows_are_gone", "index failed_points", "index solved_points"}) {
    run("DROP " + dropped);
    EXPECT_THAT(find_faults(path_), Contains(HasSubstr("the " + dropped + " is missing")))
        << dropped;
    EXPECT_THAT(start(), Contains(AllOf(HasSubstr("missing"), HasSubstr(dropped)))) << dropped;
    EXPECT_EQ(texts(standing_sql_), before) << dropped;
    EXPECT_THAT(find_faults(path_), testing::Not(Contains(HasSubstr("missing")))) << dropped;
  }
  EXPECT_THAT(texts("SELECT count(*) FROM runs"), ElementsAre("3"));
}

TEST_F(StandingViewsTest, OneThatSomebodyReplacedIsOursAgain) {
  run("CREATE VIEW large AS SELECT * FROM runs WHERE fn_peak_N > 1e3;");
  EXPECT_THAT(start(), IsEmpty()) << "what has other names is theirs";
  run("DROP VIEW results; CREATE VIEW results AS SELECT study_id, point FROM packed_results;");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("the view results is not ours")));
  EXPECT_THAT(start(),
              Contains(AllOf(HasSubstr("not as this version"), HasSubstr("view results"))));
  EXPECT_THAT(texts("SELECT count(*) FROM large"), ElementsAre("3"));
  run("DELETE FROM results WHERE point = 1");
  EXPECT_THAT(texts("SELECT count(*) FROM runs"), ElementsAre("2"));
}

TEST_F(StandingViewsTest, AFileWithATriggerThatIsNotOursIsRefusedWithItsName) {
  run("CREATE TRIGGER endless AFTER INSERT ON studies BEGIN"
      " SELECT count(*) FROM (WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
      " SELECT i FROM n); END;");
  EXPECT_THAT([this] { start(); },
              testing::ThrowsMessage<StorageError>(
                  AllOf(HasSubstr("triggers that are not ours"), HasSubstr("endless"),
                        testing::Not(HasSubstr("rows_are_gone")))));
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("the trigger endless is not ours")));
  run("DROP TRIGGER endless");
  EXPECT_THAT(start(), IsEmpty());
}

TEST_F(StandingViewsTest, AFileWithAViewInThePlaceOfATableIsRefused) {
  run("DROP TABLE about; CREATE VIEW about AS WITH RECURSIVE n(i) AS"
      " (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS database_id FROM n WHERE i < 0;");
  EXPECT_THAT([this] { start(); },
              testing::ThrowsMessage<StorageError>(HasSubstr("lacks the table about")));
}

TEST_F(StandingViewsTest, ATableThatHasTheNameOfOneStaysAndIsNamed) {
  run("DROP VIEW runs; CREATE TABLE runs (mine)");
  EXPECT_THAT(start(), Contains(HasSubstr("the view runs cannot be there")));
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("the view runs cannot be there")));
  EXPECT_THAT(texts("SELECT type FROM sqlite_schema WHERE name = 'runs'"), ElementsAre("table"));
}

TEST_F(StandingViewsTest, WithoutThemRowsAreCheckedAllTheSame) {
  run("DROP VIEW runs; DROP VIEW results;"
      "UPDATE packed_results SET mu = mu + 1, checksum = NULL WHERE point = 1");
  EXPECT_THAT(find_faults(path_), Contains(AllOf(HasSubstr("point 1"), HasSubstr("mu is"))));
}

TEST_F(StandingViewsTest, RowsThatWereDeletedWhileNothingNotedItAreCountedAgain) {
  run("DROP TRIGGER rows_are_gone; DELETE FROM packed_results WHERE point = 1");
  EXPECT_THAT(texts("SELECT counted FROM studies"), ElementsAre("1"));
  start();
  EXPECT_THAT(texts("SELECT counted FROM studies"), ElementsAre("0"));
}

TEST_F(StandingViewsTest, AQuestionThatNeedsOneSaysWhichIsMissingAndHowItComesBack) {
  run("DROP VIEW runs");
  protocol::StudyQuery question;
  question.set_study("a");
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
  try {
    plan(database.get(), question);
    FAIL() << "it was answered";
  } catch (const solver::InputError& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("the database lacks its view runs"), HasSubstr("makes it again")));
  }
}

}  // namespace
}  // namespace oblique::server
