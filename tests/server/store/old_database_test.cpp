// Databases that earlier versions of the schema left.
#include <fstream>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/care/diagnosis.h"
#include "server/reading/reader.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using testing::IsEmpty;

/// A database as an earlier version of the schema had it.
class OldDatabaseTest : public testing::TestWithParam<int> {
 protected:
  OldDatabaseTest() {
    const std::string version = std::to_string(GetParam());
    std::ifstream schema(OBLIQUE_OLD_SCHEMAS "/schema_" + version + ".sql");
    const std::string sql(std::istreambuf_iterator<char>(schema), {});
    const DatabaseHandle database =
        open_database(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    execute(database.get(), sql);
    execute(database.get(), "PRAGMA application_id = " + std::to_string(kApplicationId));
    execute(database.get(), "PRAGMA user_version = " + version);
    execute(database.get(), "INSERT INTO about (database_id) VALUES ('old')");
    const bool has_share = GetParam() >= 2;
    Statement insert(database.get(),
                     "INSERT INTO studies (study_id, name, recipe, points, state, created_at,"
                     " changed_at" +
                         std::string(has_share ? ", priority, weight" : "") +
                         ") VALUES (3, 'old study', ?, 10, 'cancelled', 'then', 'later'" +
                         (has_share ? ", 0, 1)" : ")"));
    insert.bind_blob(1, table_of(10)->recipe().SerializeAsString());
    insert.run();
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("old.db");
};

TEST_P(OldDatabaseTest, IsBroughtToThePresentSchemaAndKeepsItsStudies) {
  Store store(path_);
  EXPECT_EQ(store.database_id(), "old");
  const auto studies = store.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].name, "old study");
  EXPECT_EQ(studies[0].state, StudyState::kCancelled);
  EXPECT_EQ(studies[0].terms, StudyTerms{});
  store.commit(std::vector<Change>{SetStudyState{3, StudyState::kPaused, "now"}});
  EXPECT_EQ(store.studies()[0].state, StudyState::kPaused);
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_P(OldDatabaseTest, HasTheColumnsAndViewsOfANewOneAfterwards) {
  const std::string fresh = folder_.file("new.db");
  { const Store store(path_); }
  { const Store store(fresh); }
  const auto layout = [](const std::string& path) {
    const DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
    Statement columns(database.get(),
                      "SELECT t.name || ' ' || c.name || ' ' || c.type || c.\"notnull\" || c.pk"
                      " FROM sqlite_schema AS t, pragma_table_info(t.name) AS c"
                      " WHERE t.type IN ('table', 'view') ORDER BY t.name, c.cid");
    std::vector<std::string> found;
    while (columns.step()) {
      found.push_back(columns.text(0));
    }
    return found;
  };
  EXPECT_EQ(layout(path_), layout(fresh));
}

TEST_P(OldDatabaseTest, CanBeReadAsItIs) {
  Reader reader(path_);
  EXPECT_EQ(reader.query("SELECT name FROM studies", kNoLimits).rows_size(), 1);
  EXPECT_EQ(reader.study_status("old study").at(0).weight(), 1.0);
}

INSTANTIATE_TEST_SUITE_P(EveryEarlierSchema, OldDatabaseTest,
                         testing::Range(1, static_cast<int>(kSchemaVersion)));

}  // namespace
}  // namespace oblique::server
