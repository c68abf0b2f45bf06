#include "server/care/backup.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "server/store/store.h"
#include "tests/server/care/care_fixture.h"

namespace oblique::server {
namespace {

TEST_F(CareTest, ACopyMadeWhileTheDatabaseIsOpenHasAllThatWasCommitted) {
  back_up(path_, copy_);
  add_results(*store_, 5, 10, false);
  Store copy(copy_);
  const auto studies = copy.studies();
  ASSERT_EQ(studies.size(), 1U);
  EXPECT_EQ(studies[0].settled, IntervalSet(0, 5));
  EXPECT_EQ(copy.database_id(), store_->database_id());
}

TEST_F(CareTest, ACopyNeverReplacesAFile) {
  std::ofstream(copy_) << "mine";
  EXPECT_THROW(back_up(path_, copy_), StorageError);
  std::ifstream file(copy_);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "mine");
}

TEST_F(CareTest, OnlyADatabaseOfOursIsCopied) {
  const std::string other = folder_.file("notes.txt");
  std::ofstream(other) << "not a database, and long enough to be sure of it";
  EXPECT_THROW(back_up(other, copy_), StorageError);
  EXPECT_THROW(back_up(folder_.file("nowhere.db"), copy_), StorageError);
  EXPECT_FALSE(std::filesystem::exists(copy_));
}

}  // namespace
}  // namespace oblique::server
