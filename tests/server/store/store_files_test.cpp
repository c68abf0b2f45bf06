// The database's files: what happens when they are taken away, and what one of them alone holds.
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/store/store_fixture.h"

namespace oblique::server {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

class StoreFilesTest : public StoreFixture {
 protected:
  StoreFilesTest() {
    fs::create_directory(folder_.file("lab"));
    path_ = folder_.file("lab/studies.db");
    make_databases();
  }
  void make_databases() {
    commit({study_});
    Store other(other_);
    other.commit(std::vector<Change>{study_of(10, 1, "other")});
  }
  void add_result(std::uint64_t point) {
    AddResults change = solved(study_, {point});
    change.worker_id = 0;
    commit({change});
  }
  static std::int64_t rows_of(const std::string& path) {
    const DatabaseHandle database = open_database(path, SQLITE_OPEN_READONLY);
    Statement count(database.get(), "SELECT count(*) FROM results");
    count.step();
    return count.integer(0);
  }
  /// Rows that stand in the one file, whatever is beside it.
  std::int64_t rows_of_copy(const std::string& name) {
    const std::string copy = folder_.file(name);
    fs::copy_file(path_, copy);
    return rows_of(copy);
  }

  /// A program that has read the database and waits with it open.
  DatabaseHandle waiting_reader() const {
    DatabaseHandle database = open_database(path_, SQLITE_OPEN_READONLY);
    Statement count(database.get(), "SELECT count(*) FROM results");
    EXPECT_TRUE(count.step());
    return database;
  }

  const AddStudy study_ = study_of(10);
  std::string other_ = folder_.file("other.db");
};

TEST_F(StoreFilesTest, ACommitDuringWhichTheFileIsDeletedIsNotAcknowledged) {
  sqlite3_commit_hook(
      store().connection(),
      [](void* path) {
        fs::remove(*static_cast<const std::string*>(path));
        return 0;
      },
      &path_);
  EXPECT_THROW(add_result(0), StorageGone);
}

TEST_F(StoreFilesTest, NothingIsAcknowledgedOnceAFileIsDeletedRenamedOrReplaced) {
  const std::map<std::string, std::function<void()>> blows{
      {"the database is deleted", [&] { fs::remove(path_); }},
      {"it is renamed", [&] { fs::rename(path_, folder_.file("elsewhere.db")); }},
      {"its folder is renamed",
       [&] { fs::rename(folder_.file("lab"), folder_.file("laboratory")); }},
      {"another database takes its name", [&] { fs::rename(other_, path_); }}};
  for (const auto& [what, blow] : blows) {
    close();
    for (const char* name : {"lab", "laboratory", "other.db", "elsewhere.db"}) {
      fs::remove_all(folder_.file(name));
    }
    fs::create_directory(folder_.file("lab"));
    make_databases();
    add_result(0);
    EXPECT_NO_THROW(store().check()) << what;
    blow();
    EXPECT_THROW(store().check(), StorageGone) << what;
    EXPECT_THROW(add_result(1), StorageGone) << what;
    EXPECT_THROW(store().merge_log(), StorageGone) << what;
  }
}

TEST_F(StoreFilesTest, ARenamedDatabaseGetsWhatWasAcknowledgedWhenItsServerEnds) {
  add_result(0);
  add_result(1);
  const std::string elsewhere = folder_.file("elsewhere.db");
  fs::rename(path_, elsewhere);
  EXPECT_THROW(add_result(2), StorageGone);
  close();
  EXPECT_GE(rows_of(elsewhere), 2);
  path_ = elsewhere;
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StoreFilesTest, AReaderInTheMiddleOfAQueryKeepsTheLogAndOneThatOnlyWaitsDoesNot) {
  add_result(0);
  EXPECT_EQ(rows_of_copy("before.db"), 0) << "it is in the log";
  const DatabaseHandle waits = waiting_reader();
  const DatabaseHandle reads = open_database(path_, SQLITE_OPEN_READONLY);
  {
    Statement rows(reads.get(), "SELECT point FROM results");
    ASSERT_TRUE(rows.step());
    add_result(1);
    EXPECT_FALSE(store().merge_log());
    EXPECT_GT(fs::file_size(path_ + "-wal"), 0U);
    add_result(2);  // and it goes on
  }
  EXPECT_TRUE(store().merge_log());
  EXPECT_EQ(fs::file_size(path_ + "-wal"), 0U);
  EXPECT_EQ(rows_of_copy("after.db"), 3);
}

TEST_F(StoreFilesTest, ANewDatabaseIsForItsOwnerAloneAndAnOldOneKeepsItsMode) {
  const auto mode_of = [](const std::string& path) {
    struct stat found {};
    EXPECT_EQ(::stat(path.c_str(), &found), 0) << path;
    return found.st_mode & 0777U;
  };
  const mode_t before = ::umask(0);
  const std::string path = folder_.file("private.db");
  { const Store store(path); }
  EXPECT_EQ(mode_of(path), 0600U);
  ASSERT_EQ(::chmod(path.c_str(), 0640), 0);
  {
    const Store store(path);
    EXPECT_EQ(mode_of(path + "-wal"), 0640U);
  }
  EXPECT_EQ(mode_of(path), 0640U);
  ::umask(before);
}

}  // namespace
}  // namespace oblique::server
