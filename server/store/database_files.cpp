#include "server/store/database_files.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/database/database_in_use.h"

namespace oblique::server {
namespace {

constexpr std::array<const char*, 3> kSuffixes{"", "-wal", "-shm"};

constexpr const char* kNothingStored =
    " while the server worked on it: nothing more is stored, and the server ends. Put the file "
    "back, "
    "or a copy, and start the server again; workers that still run have kept what is not stored";

int open_or_make(const std::string& path, bool& made) {
  int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0 && errno == ENOENT) {
    constexpr mode_t kOwnerOnly = 0600;
    file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kOwnerOnly);
    made = file >= 0;
  }
  return file;
}

}  // namespace

DatabaseFiles::DatabaseFiles(const std::string& path)
    : path_(std::filesystem::absolute(path).string()), file_(open_or_make(path, made_)) {
  if (file_ < 0) {
    throw StorageError("cannot open the database " + path +
                       " for writing: " + std::strerror(errno));
  }
  if (!lock_for_server(file_)) {
    ::close(file_);
    throw StorageError(
        "another server, `oblique run` or `oblique view` already uses the database " + path +
        ": wait for it, or name another database");
  }
}

DatabaseFiles::~DatabaseFiles() {
  ::close(file_);
}

void DatabaseFiles::expect(sqlite3* database, const std::string& database_id) {
  database_ = database;
  database_id_ = database_id;
  struct stat held {};
  if (::fstat(file_, &held) == 0) {
    expected_[0] = Identity{held.st_dev, held.st_ino};
  }
  for (std::size_t i = 1; i < kSuffixes.size(); ++i) {
    expected_.at(i) = identity_of(path_ + kSuffixes.at(i));
  }
  Statement size(database_, "PRAGMA page_size");
  size.step();
  page_size_ = size.integer(0);
  page_ = page_of_identity();
  seen_ = page_has_identity().value_or(false);
}

void DatabaseFiles::check() {
  for (std::size_t i = 0; i < kSuffixes.size(); ++i) {
    if (expected_.at(i)) {
      check_file(path_ + kSuffixes.at(i), *expected_.at(i));
    }
  }
  check_contents();
}

void DatabaseFiles::check_file(const std::string& name, const Identity& expected) const {
  const auto found = identity_of(name);
  if (found == expected) {
    return;
  }
  // Other errors, as of a folder that may not be searched any more, say nothing of the file.
  const bool is_missing = !found && (errno == ENOENT || errno == ENOTDIR || errno == ESTALE);
  if (found || is_missing) {
    throw StorageGone("the file " + name + (found ? " was replaced" : " was deleted or renamed") +
                      kNothingStored);
  }
}

/// Nothing when it cannot be told.
std::optional<DatabaseFiles::Identity> DatabaseFiles::identity_of(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) {
    return std::nullopt;
  }
  return Identity{found.st_dev, found.st_ino};
}

/// A copy over the file leaves it its inode.
void DatabaseFiles::check_contents() {
  const auto has_identity = page_has_identity();
  if (has_identity.value_or(true)) {
    seen_ = seen_ || has_identity.has_value();
    return;
  }
  if (!seen_) {
    return;
  }
  const std::int64_t page = page_of_identity();
  if (page == page_) {
    overwritten_ = true;
    throw StorageGone("the contents of " + path_ + " were replaced" + kNothingStored);
  }
  // Another program has moved the table.
  page_ = page;
  seen_ = page_has_identity().value_or(false);
}

std::int64_t DatabaseFiles::page_of_identity() const {
  try {
    Statement root(database_, "SELECT rootpage FROM sqlite_schema WHERE name = 'about'");
    return root.step() ? root.integer(0) : 0;
  } catch (const StorageError&) {
    return page_;
  }
}

/// Reads the file itself, past SQLite's memory of it. Nothing when it cannot be read.
std::optional<bool> DatabaseFiles::page_has_identity() const {
  sqlite3_file* file = nullptr;
  sqlite3_file_control(database_, "main", SQLITE_FCNTL_FILE_POINTER, &file);
  if (file == nullptr || file->pMethods == nullptr || page_ < 1) {
    return std::nullopt;
  }
  std::vector<char> bytes(static_cast<std::size_t>(page_size_));
  const int code = file->pMethods->xRead(file, bytes.data(), static_cast<int>(page_size_),
                                         (page_ - 1) * page_size_);
  if (code != SQLITE_OK && code != SQLITE_IOERR_SHORT_READ) {
    return std::nullopt;
  }
  return std::search(bytes.begin(), bytes.end(), database_id_.begin(), database_id_.end()) !=
         bytes.end();
}

}  // namespace oblique::server
