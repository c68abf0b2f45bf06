#include "server/maintenance/backup.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "server/store/store.h"
#include "tests/server/maintenance/maintenance_fixture.h"

namespace oblique::server {
namespace {

TEST_F(MaintenanceTest, ACopyMadeWhileTheDatabaseIsOpenHasAllThatWasCommitted) {
  back_up(path_, copy_);
  add_results(*store_, 5, 10, false);
  Store copy(copy_);
  const auto studies = copy.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].settled, IntervalSet(0, 5));
  EXPECT_EQ(copy.database_id(), store_->database_id());
}

TEST_F(MaintenanceTest, ACopyNeverReplacesAFile) {
  std::ofstream(copy_) << "mine";
  EXPECT_THROW(back_up(path_, copy_), StorageError);
  std::ifstream file(copy_);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "mine");
}

TEST_F(MaintenanceTest, OnlyADatabaseOfOursIsCopied) {
  const std::string other = folder_.file("notes.txt");
  std::ofstream(other) << "not a database, and long enough to be sure of it";
  EXPECT_THROW(back_up(other, copy_), StorageError);
  EXPECT_THROW(back_up(folder_.file("nowhere.db"), copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
}

}  // namespace
}  // namespace oblique::server
