#include "server/maintenance/check.h"

#include <cmath>
#include <filesystem>
#include <fstream>
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

TEST_F(MaintenanceTest, ASoundDatabaseHasNoFaults) {
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

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

TEST_F(MaintenanceTest, AStudyThatWasChangedIsFound) {
  store_.reset();
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), "UPDATE studies SET name = 'b'");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("study 1, b")));
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

TEST_F(MaintenanceTest, ARowOfAPointThatTheStudyDoesNotHaveIsNamed) {
  store_.reset();
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
  execute(database.get(), "UPDATE results SET point = 77, checksum = NULL WHERE point = 4");
  EXPECT_THAT(find_faults(path_),
              Contains(HasSubstr("study a, point 77: the study has no such point")));
}

TEST_F(MaintenanceTest, StartsOfServersAreCountedSoThatNoLeaseNumberComesTwice) {
  EXPECT_EQ(store_->count_start(), 1U);
  store_.reset();
  EXPECT_EQ(Store(path_).count_start(), 2U);
}

TEST_F(MaintenanceTest, AStudyThatIsNotFinishedIsNamedThoughTheDatabaseIsSound) {
  const auto found = diagnose(path_);
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.remarks, ElementsAre("study a is running: 5 of 10 points have a result"));
  add_results(*store_, 5, 10, false);
  EXPECT_THAT(diagnose(path_).remarks, IsEmpty());
}

TEST_F(MaintenanceTest, EveryTableThatIsMissingIsNamed) {
  store_.reset();
  std::vector<std::string> tables;
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement names(database.get(), "SELECT name FROM sqlite_schema WHERE type = 'table'");
    while (names.step()) {
      tables.push_back(names.text(0));
    }
  }
  EXPECT_THAT(tables, Contains("reused_points"));
  for (const std::string& table : tables) {
    const std::string copy = folder_.file("without_" + table + ".db");
    std::filesystem::copy_file(path_, copy);
    execute(open_database(copy, SQLITE_OPEN_READWRITE).get(), "DROP TABLE " + table);
    EXPECT_THAT(find_faults(copy), Contains(HasSubstr("the table " + table + " is missing")));
  }
}

TEST_F(MaintenanceTest, ARowOfAWorkerOrStudyThatDoesNotExistIsNamed) {
  store_.reset();
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
  execute(database.get(), "UPDATE results SET worker_id = 99, checksum = NULL WHERE point = 2");
  EXPECT_THAT(find_faults(path_), ElementsAre("study a, point 2: its worker does not exist"));
  execute(database.get(), "INSERT INTO reused_points VALUES (7, 'b', 1)");
  EXPECT_THAT(find_faults(path_),
              Contains("table reused_points: refers to study number 7, which does not exist"));
}

TEST_F(MaintenanceTest, ATableThatIsNotAsServersMakeItIsNamed) {
  store_.reset();
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "ALTER TABLE results ADD COLUMN note BLOB AS (zeroblob(1000000))");
  EXPECT_THAT(find_faults(path_), ElementsAre(HasSubstr("results is not as servers make it")));
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
  execute(database.get(), "UPDATE studies SET counted = 0, state = 'done'");
  EXPECT_THAT(find_faults(path_), ElementsAre("study a is done: 5 of 10 points have a result"));
}

TEST_F(MaintenanceTest, RowsWithoutChecksumsAreCounted) {
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE results SET checksum = NULL WHERE point < 2");
  EXPECT_THAT(diagnose(path_).remarks, Contains(HasSubstr("2 of 5 results have no checksum")));
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

TEST_F(RowFaultsTest, RowsThatAgreeWithThemselvesAndTheRecipeHaveNone) {
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_F(RowFaultsTest, ARowWithoutAChecksumThatDisagreesWithTheRecipeOrIsNoResultIsNamed) {
  const std::vector<std::pair<std::string, std::string>> damages{
      {"H = 1.000000000002", "H is 1.000000000002"},
      {"mu = mu + 0.125", "mu is"},
      {"e = 0.5", "e is"},
      {"peaks = replace(peaks, ']', '')", "one of its lists cannot be read"},
      {"phases = '[inf]'", "one of its lists cannot be read"},
      {"impulse_n_Ns = NULL", "outputs are missing"},
      {"error = 'none'", "it is failed, and has outputs"}};
  const std::string columns = fmt::format("{}", fmt::join(result_columns(), ", "));
  for (const auto& [change, said] : damages) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    execute(database.get(),
            "CREATE TEMP TABLE before AS SELECT " + columns + " FROM results WHERE point = 1");
    execute(database.get(), "UPDATE results SET " + change + " WHERE point = 1");
    EXPECT_THAT(find_faults(path_), Contains(testing::AllOf(HasSubstr("point 1"), HasSubstr(said))))
        << change;
    execute(database.get(), "DELETE FROM results WHERE point = 1");
    execute(database.get(), "INSERT INTO results (" + columns + ") SELECT * FROM before");
    EXPECT_THAT(find_faults(path_), IsEmpty()) << "after " << change;
  }
}

TEST_F(RowFaultsTest, AFailedPointWithOutputsIsNamed) {
  run("UPDATE results SET fn_peak_N = 1 WHERE point = 2");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("point 2: it is failed, and has outputs")));
}

TEST_F(RowFaultsTest, AModelThatIsNotThatOfItsDefinitionOrOfTheRecipeIsNamed) {
  run("UPDATE models SET E = E + 1");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("model 1: E is not")));
  run("UPDATE models SET E = E - 1, lengths_m = '[1.0]'");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("model 1: lengths_m is not")));
  solver::ModelParameters other = solver::preset("paper");
  other.E_Pa += 1.0;
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    Statement update(database.get(), "UPDATE models SET E = E + 1, definition = ?");
    update.bind(1, std::string_view(protocol::canonical_model(other)));
    update.run();
  }
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("point 0: its model is not")));
}

TEST_F(RowFaultsTest, ARecipeThatCannotBeReadOrHasOtherPointsIsNamed) {
  run("UPDATE studies SET points = 6");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("it has 5 points, and the study 6")));
  run("UPDATE studies SET points = 5, recipe = x'ff'");
  EXPECT_THAT(find_faults(path_), Contains(HasSubstr("its recipe cannot be read")));
}

}  // namespace
}  // namespace oblique::server
