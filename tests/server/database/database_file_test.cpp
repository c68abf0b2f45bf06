#include "server/database/database_file.h"

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/maintenance/backup.h"
#include "server/maintenance/check.h"
#include "server/query/reader.h"
#include "tests/server/store/store_fixture.h"

namespace {

/// Returns the folders that this process has synced.
std::vector<std::string>& synced_folders() {
  static std::vector<std::string> folders;
  return folders;
}

}  // namespace

/// Replaces the function of the C library, so that tests see which folders are synced.
extern "C" int fsync(int descriptor) {
  struct stat about {};
  if (::fstat(descriptor, &about) == 0 && S_ISDIR(about.st_mode)) {
    synced_folders().push_back(
        std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor)).string());
  }
  return static_cast<int>(::syscall(SYS_fsync, descriptor));
}

namespace oblique::server {
namespace {

namespace fs = std::filesystem;

/// Provides two databases in read-only folders. Both database files have two rows. One database
/// also has a third row in its log.
class ReadOnlyFolderTest : public StoreFixture {
 protected:
  ReadOnlyFolderTest() {
    const auto study = study_of(10);
    commit({study, worker(1), solved(study, {0, 1})});
    store().merge_log();
    commit({solved(study, {2})});
    place("", "alone");
    place("", "with_log");
    place("-wal", "with_log");
    ::chmod(folder_.file("").c_str(), 0755);
    fs::create_directory(folder_.file("out"));
    ::chmod(folder_.file("out").c_str(), 0777);
  }
  ~ReadOnlyFolderTest() override {
    for (const char* name : {"alone", "with_log"}) {
      ::chmod(folder_.file(name).c_str(), 0755);
    }
  }

  std::string file_in(const std::string& name) const {
    return folder_.file(name + "/some % results?.db");
  }

  /// Runs `what` as a user who can write only in `out`; root could write everywhere. Then ends the
  /// process, with status 0 if `what` returned true.
  void exit_as_other_user(const std::function<bool()>& what) const {
    constexpr uid_t kNoProcess = 65534;
    if (::geteuid() == 0 && (::setgid(kNoProcess) != 0 || ::setuid(kNoProcess) != 0)) {
      std::_Exit(2);
    }
    try {
      std::_Exit(what() ? 0 : 1);
    } catch (const std::exception& error) {
      std::cerr << error.what() << '\n';
      std::_Exit(3);
    }
  }

 private:
  void place(const std::string& suffix, const std::string& name) {
    fs::create_directories(folder_.file(name));
    fs::copy_file(path_ + suffix, file_in(name) + suffix);
    ::chmod((file_in(name) + suffix).c_str(), 0444);
    if (name == "alone" || suffix == "-wal") {
      ::chmod(folder_.file(name).c_str(), 0555);
    }
  }
};

std::size_t rows_of(const std::string& path) {
  return Reader(path).query("SELECT point FROM results", kNoLimits).rows.size();
}

TEST_F(ReadOnlyFolderTest, RowsOfTheFileAndOfTheLogAreRead) {
  for (const auto& [name, rows] : {std::pair{"alone", 2U}, std::pair{"with_log", 3U}}) {
    const std::string file = file_in(name);
    EXPECT_EXIT(exit_as_other_user([&, expected = rows] { return rows_of(file) == expected; }),
                testing::ExitedWithCode(0), "")
        << name;
  }
}

TEST_F(ReadOnlyFolderTest, StatusCheckBackupAndSalvageWorkInAReadOnlyFolder) {
  const std::string file = file_in("with_log");
  const std::string copy = folder_.file("out/copy.db");
  const std::string saved = folder_.file("out/saved.db");
  EXPECT_EXIT(exit_as_other_user([&] {
                back_up(file, copy);
                return Reader(file).study_status("a").at(0).solved() == 3 &&
                       diagnose(file).faults.empty() && rows_of(copy) == 3 &&
                       salvage(file, saved).results == 3;
              }),
              testing::ExitedWithCode(0), "");
}

TEST_F(ReadOnlyFolderTest, PermissionDeniedIsReportedWithTheRemedy) {
  const std::string file = file_in("alone");
  ::chmod(file.c_str(), ::geteuid() == 0 ? 0600 : 0);
  EXPECT_EXIT(exit_as_other_user([&] { return rows_of(file) == 2; }), testing::ExitedWithCode(3),
              "permission denied. Only its owner can read");
}

TEST_F(ReadOnlyFolderTest, AServerNamesTheFolder) {
  for (const std::string& file : {file_in("alone"), folder_.file("alone/new.db")}) {
    EXPECT_EXIT(exit_as_other_user([&] { return Store(file).is_new(); }),
                testing::ExitedWithCode(3), "the folder .*alone is read-only for this user");
  }
}

TEST_F(StoreFixture, ACompletedCopyIsSyncedWithItsFolder) {
  commit({study_of(3)});
  for (const char* name : {"copies/first.db", "copies/second.db"}) {
    const std::string copy = folder_.file(name);
    const std::string folder = fs::path(copy).parent_path().string();
    fs::create_directory(folder);
    synced_folders().clear();
    name == std::string("copies/first.db") ? static_cast<void>(back_up(path_, copy))
                                           : static_cast<void>(salvage(path_, copy));
    EXPECT_THAT(synced_folders(), testing::Contains(folder)) << name;
  }
}

TEST(FileSystemOf, AMissingPathHasTheFileSystemOfItsParent) {
  EXPECT_EQ(file_system_of("/dev/shm/none/oblique.db"), "tmpfs");
  EXPECT_EQ(file_system_of("/proc/self/oblique.db"), "proc");
  for (const char* type : {"nfs4", "cifs", "lustre", "fuse.sshfs", "fuse.gcsfuse"}) {
    EXPECT_TRUE(is_network_file_system(type)) << type;
  }
  for (const char* type : {"ext4", "tmpfs", "overlay", "fuseblk", "fuse.mergerfs"}) {
    EXPECT_FALSE(is_network_file_system(type)) << type;
  }
  EXPECT_EQ(network_disk_error("/dev/shm/oblique.db"), "") << "a local file has no network error";
}

}  // namespace
}  // namespace oblique::server
