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

TEST_F(SchemaTest, EachStartCreatesWhatWasDroppedOrReplacedAndOtherViewsStay) {
  by_hand("CREATE VIEW large AS SELECT * FROM runs WHERE fn_peak_N > 1e3");
  const auto before = objects();
  ASSERT_EQ(before.size(), 9U);
  for (const std::string change :
       {"DROP VIEW runs", "DROP VIEW peaks", "DROP VIEW phases", "DROP VIEW stick_intervals",
        "DROP VIEW reaction_peaks", "DROP VIEW peaks; CREATE VIEW peaks AS SELECT 7 AS mine",
        "DROP TRIGGER row_deleted", "DROP INDEX failed_points", "DROP INDEX solved_points"}) {
    by_hand(change);
    EXPECT_EQ(refusal(), "it opened");
    EXPECT_EQ(objects(), before) << change;
  }
  EXPECT_THAT(of_file(differing_tables), IsEmpty());
  EXPECT_THAT(rows("SELECT count(*) FROM large"), ElementsAre("3"));
}

TEST_F(SchemaTest, TriggersOfTheFileDoNotRunWithTheChangesOfAServer) {
  by_hand("CREATE TRIGGER other AFTER UPDATE ON studies BEGIN SELECT RAISE(ABORT, 'it ran'); END");
  EXPECT_THROW(by_hand("UPDATE studies SET priority = 1"), StorageError);
  commit({SetPriority{1, 7}});
  EXPECT_THAT(rows("SELECT priority FROM studies"), ElementsAre("7"));
}

TEST_F(SchemaTest, AFileWithAViewInThePlaceOfATableIsRefused) {
  by_hand(
      "DROP TABLE about; CREATE VIEW about AS WITH RECURSIVE n(i) AS"
      " (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS database_id FROM n WHERE i < 0;");
  EXPECT_THAT(of_file(differing_tables), ElementsAre("about"));
  EXPECT_THAT(refusal(), HasSubstr("lacks the table about"));
}

TEST_F(SchemaTest, AFileWithATableInThePlaceOfAViewIsRefusedAndTheTableStays) {
  by_hand("DROP VIEW runs; CREATE TABLE runs (mine)");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("runs"), HasSubstr("rename the table")));
  EXPECT_THAT(rows("SELECT type FROM sqlite_schema WHERE name = 'runs'"), ElementsAre("table"));
}

}  // namespace
}  // namespace oblique::server
