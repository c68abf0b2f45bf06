#include "server/store/schema.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// A database with three solved points, and what other programs do to it.
class SchemaTest : public StoreFixture {
 protected:
  SchemaTest() {
    const auto study = study_of(3);
    commit({study, worker(1), solved(study, {0, 1, 2})});
    close();
  }
  std::vector<std::string> objects() const {
    return rows(
        "SELECT type || ' ' || name || ' ' || sql FROM sqlite_schema"
        " WHERE type <> 'table' AND sql IS NOT NULL ORDER BY name");
  }
  template <class Function>
  auto of_file(const Function& function) const {
    return function(open_database(path_, SQLITE_OPEN_READONLY).get());
  }
};

TEST_F(SchemaTest, EachStartCreatesWhatWasDropped) {
  const auto before = objects();
  ASSERT_EQ(before.size(), 8U);
  for (const std::string dropped :
       {"view runs", "view peaks", "view phases", "view stick_intervals", "view reaction_peaks",
        "trigger row_deleted", "index failed_points", "index solved_points"}) {
    by_hand("DROP " + dropped);
    EXPECT_EQ(of_file(missing_views).size(), dropped.starts_with("view") ? 1U : 0U) << dropped;
    EXPECT_EQ(refusal(), "it opened");
    EXPECT_EQ(objects(), before) << dropped;
  }
  EXPECT_THAT(of_file(missing_views), IsEmpty());
  EXPECT_THAT(of_file(missing_tables), IsEmpty());
  EXPECT_THAT(rows("SELECT count(*) FROM runs"), ElementsAre("3"));
}

TEST_F(SchemaTest, AReplacedViewIsOursAgainAndViewsWithOtherNamesStay) {
  by_hand(
      "CREATE VIEW large AS SELECT * FROM runs WHERE fn_peak_N > 1e3;"
      "DROP VIEW peaks; CREATE VIEW peaks AS SELECT 7 AS mine;");
  EXPECT_EQ(refusal(), "it opened");
  EXPECT_THAT(rows("SELECT count(*) FROM large"), ElementsAre("3"));
  EXPECT_THAT(rows("SELECT count(t_s) FROM peaks"), ElementsAre("6"));
}

TEST_F(SchemaTest, AFileWithATriggerThatIsNotOursIsRefusedWithItsName) {
  by_hand(
      "CREATE TRIGGER endless AFTER INSERT ON studies BEGIN"
      " SELECT count(*) FROM (WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
      " SELECT i FROM n); END;");
  EXPECT_THAT(of_file(other_triggers), ElementsAre("endless"));
  EXPECT_THAT(refusal(), AllOf(HasSubstr("triggers that are not ours"), HasSubstr("endless"),
                               Not(HasSubstr("row_deleted"))));
  by_hand("DROP TRIGGER endless");
  EXPECT_EQ(refusal(), "it opened");
}

TEST_F(SchemaTest, NoForeignTriggerRunsAtAStart) {
  const std::string runs = "AFTER UPDATE ON studies BEGIN SELECT RAISE(ABORT, 'it ran'); END";
  by_hand("DROP TRIGGER row_deleted; CREATE TRIGGER foreign_one " + runs);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("triggers that are not ours"), Not(HasSubstr("it ran"))));
  by_hand("DROP TRIGGER foreign_one; CREATE TRIGGER row_deleted " + runs);
  EXPECT_EQ(refusal(), "it opened");
}

TEST_F(SchemaTest, ATriggerWithOurNameAndAnotherTextIsNotOursUntilTheNextStart) {
  const auto before = objects();
  EXPECT_THAT(of_file(other_triggers), IsEmpty());
  for (const char* replacement : {"AFTER DELETE ON results BEGIN SELECT 1; END",
                                  "AFTER INSERT ON studies BEGIN SELECT 1; END"}) {
    by_hand(std::string("DROP TRIGGER row_deleted; CREATE TRIGGER row_deleted ") + replacement);
    EXPECT_THAT(of_file(other_triggers), ElementsAre("row_deleted")) << replacement;
    EXPECT_EQ(refusal(), "it opened");
    EXPECT_EQ(objects(), before) << replacement;
    EXPECT_THAT(of_file(other_triggers), IsEmpty());
  }
}

TEST_F(SchemaTest, RowsThatWereDeletedWithoutOurTriggerAreCountedAgain) {
  for (const char* way : {"DROP TRIGGER row_deleted;",
                          "DROP TRIGGER row_deleted; CREATE TRIGGER row_deleted AFTER DELETE ON"
                          " results BEGIN SELECT 1; END;"}) {
    const auto points = static_cast<std::uint64_t>(number("SELECT count(*) FROM results"));
    by_hand(std::string(way) +
            "DELETE FROM results WHERE point = (SELECT max(point) FROM results)");
    EXPECT_THAT(rows("SELECT counted FROM studies"), ElementsAre("1"));
    EXPECT_EQ(store().studies().at(0).settled, IntervalSet(0, points - 1)) << way;
    close();
  }
}

TEST_F(SchemaTest, AFileWithAViewInThePlaceOfATableIsRefused) {
  by_hand(
      "DROP TABLE about; CREATE VIEW about AS WITH RECURSIVE n(i) AS"
      " (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS database_id FROM n WHERE i < 0;");
  EXPECT_THAT(of_file(missing_tables), ElementsAre("about"));
  EXPECT_THAT(refusal(), HasSubstr("lacks the table about"));
}

TEST_F(SchemaTest, AFileWithATableInThePlaceOfAViewIsRefusedAndTheTableStays) {
  by_hand("DROP VIEW runs; CREATE TABLE runs (mine)");
  EXPECT_THAT(of_file(missing_views), ElementsAre("runs"));
  EXPECT_THAT(refusal(), AllOf(HasSubstr("runs"), HasSubstr("rename the table")));
  EXPECT_THAT(rows("SELECT type FROM sqlite_schema WHERE name = 'runs'"), ElementsAre("table"));
}

TEST_F(SchemaTest, AFileOfAnotherVersionIsRefusedWithBothVersionsAndTheRemedy) {
  for (const int version : {kSchemaVersion - 1, kSchemaVersion + 1}) {
    by_hand(fmt::format("PRAGMA user_version = {}", version));
    EXPECT_THAT(
        refusal(),
        AllOf(HasSubstr(fmt::format("has schema {}, and this version of oblique has schema {}",
                                    version, kSchemaVersion)),
              HasSubstr(version < kSchemaVersion ? "the older version that wrote it"
                                                 : "the newer version that wrote it"),
              HasSubstr("oblique query STUDY --db FILE --format csv")));
  }
}

}  // namespace
}  // namespace oblique::server
