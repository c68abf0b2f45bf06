// The database's files: what happens when they are taken away, and what one of them alone holds.
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/maintenance/backup.h"
#include "server/maintenance/check.h"
#include "server/query/reader.h"
#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

/// A file that goes at the instant of a commit, on connections opened while this lives.
class DoomedFile {
 public:
  DoomedFile() { sqlite3_auto_extension(reinterpret_cast<void (*)()>(&watch)); }
  ~DoomedFile() {
    sqlite3_cancel_auto_extension(reinterpret_cast<void (*)()>(&watch));
    path().clear();
  }
  DoomedFile(const DoomedFile&) = delete;
  DoomedFile& operator=(const DoomedFile&) = delete;

  static void name(const std::string& file) { path() = file; }

 private:
  static std::string& path() {
    static std::string named;
    return named;
  }
  static int watch(sqlite3* database, const char**, const void*) {
    sqlite3_commit_hook(
        database,
        [](void*) {
          std::error_code ignored;
          fs::remove(path(), ignored);
          return 0;
        },
        nullptr);
    return SQLITE_OK;
  }
};

class StoreFilesTest : public testing::Test {
 protected:
  StoreFilesTest() {
    fs::create_directory(folder_.file("lab"));
    store_.emplace(path_);
    store_->commit(std::vector<Change>{AddStudy{1, "a", table_, "now", {}}});
    {
      Store other(other_);
      other.commit(std::vector<Change>{AddStudy{1, "other", table_, "now", {}}});
    }
  }
  void add_result(std::uint64_t point) {
    store_->commit(std::vector<Change>{
        AddResults{1, table_, 0, "0.1", "avx2", 1, "now", {solved_point(point)}}});
  }
  static int rows_of(const std::string& path) {
    return Reader(path).query("SELECT point FROM results", kNoLimits).rows_size();
  }
  /// Rows that stand in the one file, whatever is beside it.
  int rows_of_copy(const std::string& name) {
    const std::string copy = folder_.file(name);
    fs::copy_file(path_, copy);
    return rows_of(copy);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("lab/studies.db");
  std::string other_ = folder_.file("other.db");
  std::shared_ptr<const protocol::PointTable> table_ = table_of(10);
  std::optional<Store> store_;
};

TEST_F(StoreFilesTest, ACommitInWhichTheFileGoesIsNotAcknowledged) {
  const DoomedFile doomed;
  const std::string late = folder_.file("late.db");
  Store store(late);
  DoomedFile::name(late);
  EXPECT_THROW(store.commit(std::vector<Change>{AddStudy{1, "a", table_, "now", {}}}), StorageGone);
}

TEST_F(StoreFilesTest, NothingIsAcknowledgedOnceAFileIsDeletedRenamedOrReplaced) {
  const std::map<std::string, std::function<void()>> blows{
      {"the database is deleted", [&] { fs::remove(path_); }},
      {"it is renamed", [&] { fs::rename(path_, folder_.file("elsewhere.db")); }},
      {"its folder is renamed",
       [&] { fs::rename(folder_.file("lab"), folder_.file("laboratory")); }},
      {"another database takes its name", [&] { fs::rename(other_, path_); }}};
  for (const auto& [what, blow] : blows) {
    store_.reset();
    for (const char* name : {"lab", "laboratory", "other.db", "elsewhere.db"}) {
      fs::remove_all(folder_.file(name));
    }
    fs::create_directory(folder_.file("lab"));
    { Store(other_).commit(std::vector<Change>{AddStudy{1, "other", table_, "now", {}}}); }
    store_.emplace(path_);
    store_->commit(std::vector<Change>{AddStudy{1, "a", table_, "now", {}}});
    add_result(0);
    EXPECT_NO_THROW(store_->check()) << what;
    blow();
    EXPECT_THROW(store_->check(), StorageGone) << what;
    EXPECT_THROW(add_result(1), StorageGone) << what;
    EXPECT_THROW(store_->merge_log(), StorageGone) << what;
  }
}

TEST_F(StoreFilesTest, ARenamedDatabaseGetsWhatWasAcknowledgedWhenItsServerEnds) {
  add_result(0);
  add_result(1);
  const std::string elsewhere = folder_.file("elsewhere.db");
  fs::rename(path_, elsewhere);
  EXPECT_THROW(add_result(2), StorageGone);
  store_.reset();
  EXPECT_GE(rows_of(elsewhere), 2);
  EXPECT_THAT(find_faults(elsewhere), IsEmpty());
}

TEST_F(StoreFilesTest, ADatabaseThatTookTheNameOfAnotherIsNotDamagedByIt) {
  add_result(0);
  fs::rename(other_, path_);
  EXPECT_THROW(add_result(1), StorageGone);
  store_.reset();
  EXPECT_THAT(find_faults(path_), IsEmpty());
  EXPECT_EQ(Reader(path_).study_status().at(0).name(), "other");
}

TEST_F(StoreFilesTest, AMergedLogLeavesAllInTheOneFile) {
  add_result(0);
  EXPECT_EQ(rows_of_copy("before.db"), 0) << "it is in the log";
  EXPECT_TRUE(store_->merge_log());
  EXPECT_EQ(fs::file_size(path_ + "-wal"), 0U);
  EXPECT_EQ(rows_of_copy("after.db"), 1);
}

TEST_F(StoreFilesTest, AReaderInTheMiddleOfAQueryKeepsTheLogAndOneThatOnlyWaitsDoesNot) {
  add_result(0);
  Reader waits(path_);
  EXPECT_EQ(waits.query("SELECT point FROM results", kNoLimits).rows_size(), 1);
  const DatabaseHandle reads = open_database(path_, SQLITE_OPEN_READONLY);
  {
    Statement rows(reads.get(), "SELECT point FROM results");
    ASSERT_TRUE(rows.step());
    add_result(1);
    EXPECT_FALSE(store_->merge_log());
    EXPECT_GT(fs::file_size(path_ + "-wal"), 0U);
    add_result(2);  // and it goes on
  }
  EXPECT_TRUE(store_->merge_log());
  EXPECT_EQ(rows_of_copy("after.db"), 3);
}

TEST_F(StoreFilesTest, ADatabaseClosedUnderAReaderHasAllInTheOneFile) {
  add_result(0);
  Reader reader(path_);
  EXPECT_EQ(reader.query("SELECT point FROM results", kNoLimits).rows_size(), 1);
  EXPECT_TRUE(store_->merge_log());
  store_.reset();
  EXPECT_EQ(rows_of_copy("copy.db"), 1);
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
  back_up(path, folder_.file("copy.db"));
  EXPECT_EQ(mode_of(path), 0600U);
  EXPECT_EQ(mode_of(folder_.file("copy.db")), 0600U);
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
