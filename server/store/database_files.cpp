#include "server/store/database_files.h"

#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <unistd.h>

#include "server/database/database_in_use.h"
#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

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
  if (file_ < 0 || ::fstat(file_, &opened_) != 0) {
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

void DatabaseFiles::check() const {
  struct stat found {};
  const bool is_there = ::stat(path_.c_str(), &found) == 0;
  if (is_there && found.st_dev == opened_.st_dev && found.st_ino == opened_.st_ino) {
    return;
  }
  // Other errors, such as a folder without search permission, do not mean that the file is gone.
  if (is_there || errno == ENOENT || errno == ENOTDIR || errno == ESTALE) {
    throw StorageGone("the file " + path_ +
                      (is_there ? " was replaced" : " was deleted or renamed") + kNothingStored);
  }
}

}  // namespace oblique::server
