#include "server/care/diagnosis.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/care/backup.h"
#include "server/store/store.h"
#include "tests/server/care/care_fixture.h"

namespace oblique::server {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(CareTest, ASoundDatabaseHasNoFaults) {
  EXPECT_THAT(find_faults(path_), IsEmpty());
}

TEST_F(CareTest, ADamagedPageIsFoundAndNotCopied) {
  store_.reset();  // all is in the one file now
  {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    const auto size = std::filesystem::file_size(path_);
    const std::string rubbish(4096, '\x5a');
    // Every page but the first, which tells what the file is.
    for (std::uintmax_t at = 4096; at < size; at += 4096) {
      file.seekp(static_cast<std::streamoff>(at));
      file << rubbish;
    }
  }
  bool found = false;
  try {
    found = !find_faults(path_).empty();
  } catch (const StorageError&) {
    found = true;
  }
  EXPECT_TRUE(found);
  EXPECT_THROW(back_up(path_, copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
}

TEST_F(CareTest, EveryColumnOfAResultIsUnderItsChecksum) {
  store_.reset();
  std::vector<std::string> columns;
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement names(
        database.get(),
        "SELECT name FROM pragma_table_info('packed_results') WHERE name <> 'checksum'");
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
      execute(database.get(), "PRAGMA ignore_check_constraints = ON");
      execute(database.get(), "UPDATE packed_results SET " + column + " = CASE typeof(" + column +
                                  ") WHEN 'text' THEN " + column + " || ' ' WHEN 'null' THEN 1" +
                                  " ELSE " + column + " + 1 END WHERE point = 4");
    }
    EXPECT_THAT(find_faults(copy), testing::Contains(HasSubstr("not the one that was stored")))
        << column;
  }
}

TEST_F(CareTest, AStudyThatWasChangedIsFound) {
  store_.reset();
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(), "UPDATE studies SET name = 'b'");
  EXPECT_THAT(find_faults(path_), testing::Contains(HasSubstr("study 1, b")));
}

TEST_F(CareTest, ADamagedDatabaseIsRefusedWithTheWayOut) {
  store_.reset();
  const auto page_of = [&](const std::string& name) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement root(database.get(), "SELECT rootpage FROM sqlite_schema WHERE name = ?");
    root.bind(1, std::string_view(name));
    root.step();
    return root.integer(0);
  };
  const std::int64_t page = page_of("studies");
  {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp((page - 1) * 4096);
    file << std::string(4096, '\x5a');
  }
  try {
    Store store(path_);
    (void)store.studies();
    FAIL() << "a damaged database was opened";
  } catch (const StorageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--salvage"));
  }
}

TEST_F(CareTest, ARowOfAPointThatTheStudyDoesNotHaveIsNamed) {
  store_.reset();
  const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
  execute(database.get(), "UPDATE packed_results SET point = 77 WHERE point = 4");
  EXPECT_THAT(find_faults(path_), testing::Contains(HasSubstr("study a")));
}

TEST_F(CareTest, StartsOfServersAreCountedSoThatNoLeaseNumberComesTwice) {
  EXPECT_EQ(store_->count_start(), 1U);
  store_.reset();
  EXPECT_EQ(Store(path_).count_start(), 2U);
}

TEST_F(CareTest, AStudyThatIsNotFinishedIsNamedThoughTheDatabaseIsSound) {
  const auto found = diagnose(path_);
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.remarks, ElementsAre("study a is running: 5 of 10 points have a result"));
  add_results(*store_, 5, 10, false);
  EXPECT_THAT(diagnose(path_).remarks, IsEmpty());
}

TEST_F(CareTest, EveryTableThatIsMissingIsNamed) {
  store_.reset();
  std::vector<std::string> tables;
  {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement names(database.get(), "SELECT name FROM sqlite_schema WHERE type = 'table'");
    while (names.step()) {
      tables.push_back(names.text(0));
    }
  }
  EXPECT_THAT(tables, Contains("taken_points"));
  for (const std::string& table : tables) {
    const std::string copy = folder_.file("without_" + table + ".db");
    std::filesystem::copy_file(path_, copy);
    execute(open_database(copy, SQLITE_OPEN_READWRITE).get(), "DROP TABLE " + table);
    EXPECT_THAT(find_faults(copy), Contains(HasSubstr("the table " + table + " is missing")));
  }
}

TEST_F(CareTest, AForeignKeyOfAnotherTableThatCannotBeCheckedIsNamedAndTheRestIsChecked) {
  store_.reset();
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "CREATE TABLE notes (study_id, point,"
          " FOREIGN KEY (study_id, point) REFERENCES results (study_id, point));"
          "INSERT INTO notes VALUES (1, 2);");
  const auto found = diagnose(path_);
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.remarks, Contains(HasSubstr("the foreign keys of the table notes")));
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE packed_results SET worker = 99, checksum = NULL WHERE point = 2");
  EXPECT_THAT(find_faults(path_),
              Contains(HasSubstr("table packed_results: refers to a row of workers")));
}

TEST_F(CareTest, RowsWithoutChecksumsAreCounted) {
  execute(open_database(path_, SQLITE_OPEN_READWRITE).get(),
          "UPDATE results SET checksum = NULL WHERE point < 2");
  EXPECT_THAT(diagnose(path_).remarks, Contains(HasSubstr("2 of 5 results have no checksum")));
}

}  // namespace
}  // namespace oblique::server
