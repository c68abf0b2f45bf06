#include "server/maintenance/check.h"

#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "server/maintenance/backup.h"
#include "server/store/result_rows.h"
#include "server/store/store.h"
#include "tests/server/maintenance/maintenance_fixture.h"

namespace oblique::server {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(MaintenanceTest, RowsWithTheLastBitsOfAnotherMachineAreSound) {
  protocol::PointResult result = solved_point(5, *table_);
  result.set_mu(std::nextafter(result.mu(), 1.0));
  store_->commit(std::vector<Change>{AddResults{1, table_, 1, "0.1", "avx2", 1, "now", {result}}});
  EXPECT_THAT(find_faults(path_), IsEmpty());
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
  Statement row(database.get(), "SELECT mu FROM results WHERE point = 5");
  ASSERT_TRUE(row.step());
  EXPECT_EQ(row.real(0), result.mu()) << "as it was solved";
}

TEST_F(MaintenanceTest, ADamagedPageIsFoundAndNotCopied) {
  store_.reset();  // all is in the one file now
  overwrite_page(path_, page_of(path_, "results"));
  EXPECT_FALSE(find_faults(path_).empty());
  EXPECT_THROW(back_up(path_, copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
}

TEST_F(MaintenanceTest, EveryColumnOfAResultIsUnderItsChecksum) {
  store_.reset();
  std::vector<std::string> columns;
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement names(database.get(),
                    "SELECT name FROM pragma_table_info('results') WHERE name <> 'checksum'");
    while (names.step()) {
      columns.push_back(names.text(0));
    }
  }
  EXPECT_GT(columns.size(), 40U);
  for (const std::string& column : columns) {
    const std::string copy = folder_.file(column + ".db");
    std::filesystem::copy_file(path_, copy);
    {
      const DatabaseHandle database = open_database(copy, SQLITE_OPEN_READWRITE);
      execute(database.get(), "UPDATE results SET " + column + " = CASE typeof(" + column +
                                  ") WHEN 'text' THEN " + column + " || ' ' WHEN 'null' THEN 1" +
                                  " ELSE " + column + " + 1 END WHERE point = 4");
    }
    EXPECT_THAT(find_faults(copy),
                Contains(HasSubstr(column == "study_id" ? "refers to study number 2"
                                                        : "not the one that was stored")))
        << column;
  }
}

TEST_F(MaintenanceTest, AStudyOrModelThatWasChangedAndAReferenceToNoStudyAreFound) {
  store_.reset();
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
  execute(database.get(),
          "UPDATE studies SET created_at = 'b'; UPDATE models SET E = E + 1;"
          "INSERT INTO reused_points VALUES (7, 'b', 1)");
  EXPECT_THAT(find_faults(path_),
              ElementsAre("table reused_points: refers to study number 7, which does not exist",
                          "model 1: it is not the one that was stored", HasSubstr("study 1, a")));
}

TEST_F(MaintenanceTest, ADamagedDatabaseIsRefusedWithTheWayOut) {
  store_.reset();
  overwrite_page(path_, page_of(path_, "studies"));
  try {
    Store store(path_);
    (void)store.studies();
    FAIL() << "a damaged database was opened";
  } catch (const StorageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--salvage"));
  }
}

TEST_F(MaintenanceTest, AStudyThatIsNotFinishedIsNamedThoughTheDatabaseIsSound) {
  const auto found = diagnose(path_);
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.remarks, ElementsAre("study a is running: 5 of 10 points have a result"));
  add_results(*store_, 5, 10, false);
  EXPECT_THAT(diagnose(path_).remarks, IsEmpty());
}

TEST_F(MaintenanceTest, EveryTableThatIsMissingOrHasOtherColumnsIsNamed) {
  store_.reset();
  for (const std::string table : {"about", "studies", "models", "workers", "results",
                                  "completed_ranges", "reused_points", "deletions"}) {
    for (const std::string change : {"DROP TABLE ", "ALTER TABLE "}) {
      const std::string copy = folder_.file("changed_" + table + ".db");
      std::filesystem::copy_file(path_, copy, std::filesystem::copy_options::overwrite_existing);
      execute(
          open_database(copy, SQLITE_OPEN_READWRITE).get(),
          change + table +
              (change.starts_with("ALTER") ? " ADD COLUMN note BLOB AS (zeroblob(1000000))" : ""));
      EXPECT_THAT(find_faults(copy), ElementsAre(HasSubstr("the table " + table + " is")));
      EXPECT_THROW(Store{copy}, StorageError);
    }
  }
}

TEST_F(MaintenanceTest, CompletedPointsThatDifferFromTheRowsAreNamedWithTheRemedy) {
  store_.reset();
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
  for (const char* change :
       {"UPDATE completed_ranges SET points = 6", "UPDATE completed_ranges SET points = 4",
        "UPDATE completed_ranges SET first_point = 1"}) {
    execute(database.get(), change);
    EXPECT_THAT(find_faults(path_), Contains(HasSubstr("UPDATE studies SET counted = 0")))
        << change;
  }
  execute(database.get(), "UPDATE completed_ranges SET first_point = 0, points = 5");
  execute(database.get(), "UPDATE studies SET state = 'done'");
  EXPECT_THAT(find_faults(path_), ElementsAre("study a is done: 5 of 10 points have a result"));
}

TEST_F(MaintenanceTest, ADoneStudyOfWhichRowsWereDeletedByHandIsSound) {
  add_results(*store_, 5, 10, false);
  store_.reset();
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE studies SET state = 'done'; DELETE FROM results WHERE point > 6");
  EXPECT_THAT(find_faults(path_), IsEmpty());
  EXPECT_THAT(diagnose(path_).remarks, Contains("study a is done: 7 of 10 points have a result"));
}

/// Three points, the last of them failed; their rows have no checksums.
class RowFaultsTest : public testing::Test {
 protected:
  RowFaultsTest() {
    Store store(path_);
    store.commit(std::vector<Change>{
        AddStudy{1, "a", table_, "now", {}},
        AddResults{1,
                   table_,
                   0,
                   "0.1",
                   "avx2",
                   1,
                   "now",
                   {solved_point(0), solved_point(1), protocol::failed_point(2, "why")}}});
    run("UPDATE results SET checksum = NULL");
    run("UPDATE studies SET checksum = NULL");
  }
  void run(const std::string& sql) {
    execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), sql);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  std::shared_ptr<const protocol::PointTable> table_ = table_of(5);
};

TEST_F(RowFaultsTest, ARowWithoutAChecksumThatDisagreesWithTheRecipeOrIsNoResultIsNamed) {
  const std::vector<std::pair<std::string, std::string>> damages{
      {"point = 77", "point 77: the study has no such point"},
      {"H = 1.000000000002", "H is 1.000000000002"},
      {"mu = mu + 0.125", "mu is"},
      {"e = 0.5", "e is"},
      {"peaks = replace(peaks, ']', '')", "one of its lists cannot be read"},
      {"phases = '[inf]'", "one of its lists cannot be read"},
      {"impulse_n_Ns = NULL", "outputs are missing"},
      {"error = 'none'", "point 1: it is failed, and has outputs"},
      {"model_id = 7", "point 1: its model does not exist"},
      {"worker_id = 7", "point 1: its worker does not exist"}};
  const std::string columns = fmt::format("{}", fmt::join(result_columns(), ", "));
  EXPECT_THAT(find_faults(path_), IsEmpty());
  EXPECT_THAT(diagnose(path_).remarks, Contains(HasSubstr("3 of 3 results have no checksum")));
  for (const auto& [change, said] : damages) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    execute(database.get(),
            "CREATE TEMP TABLE before AS SELECT " + columns + " FROM results WHERE point = 1");
    execute(database.get(), "UPDATE results SET " + change + " WHERE point = 1");
    EXPECT_THAT(find_faults(path_), Contains(HasSubstr(said))) << change;
    execute(database.get(), "DELETE FROM results WHERE point IN (1, 77)");
    execute(database.get(), "INSERT INTO results (" + columns + ") SELECT * FROM before");
    EXPECT_THAT(find_faults(path_), IsEmpty()) << "after " << change;
  }
}

TEST_F(RowFaultsTest, AModelThatIsNotThatOfTheRecipeIsNamed) {
  solver::ModelParameters other = solver::preset("paper");
  other.E_Pa += 1.0;
  execute_with(open_database(path_, SQLITE_OPEN_READWRITE).get(),
               "UPDATE models SET definition = ?, checksum = NULL",
               protocol::canonical_model(other));
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("point 0: its model is not")));
}

TEST_F(RowFaultsTest, ARecipeThatCannotBeReadOrHasOtherPointsIsNamed) {
  run("UPDATE studies SET points = 6");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("it has 5 points, and the study 6")));
  run("UPDATE studies SET points = 5, recipe = x'ff'");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("its recipe cannot be read")));
}

TEST_F(RowFaultsTest, AStudyThatWouldKeepAServerFromStartingIsNamed) {
  run("CREATE TABLE before AS SELECT * FROM studies");
  for (const char* change : {"points = 1000000000000000000", "points = -1",
                             "priority = 9223372036854775807", "name = ''", "name = char(27)",
                             "name = hex(zeroblob(1000))", "created_at = hex(zeroblob(1000))"}) {
    run(std::string("PRAGMA ignore_check_constraints = ON; UPDATE studies SET ") + change);
    EXPECT_THAT(find_faults(path_), Contains(HasSubstr("study 1, "))) << change;
    run("DELETE FROM studies; INSERT INTO studies SELECT * FROM before");
  }
}

}  // namespace
}  // namespace oblique::server
