#include "server/database/draft_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "server/database/sqlite.h"

namespace oblique::server {

DraftFile::DraftFile(std::string path) : path_(std::move(path)) {
  remove();
  constexpr mode_t kOwnerOnly = 0600;
  const int file = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerOnly);
  if (file < 0) {
    throw StorageError("cannot write " + path_ + ": " + std::strerror(errno));
  }
  ::close(file);
}

DraftFile::~DraftFile() {
  remove();
}

void DraftFile::keep_as(const std::string& name) {
  const int file = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  const bool flushed = file >= 0 && ::fsync(file) == 0;
  if (file >= 0) {
    ::close(file);
  }
  std::error_code error;
  if (flushed) {
    std::filesystem::rename(path_, name, error);
  }
  if (!flushed || error) {
    throw StorageError("cannot write " + name);
  }
}

void DraftFile::remove() const {
  std::error_code ignored;
  for (const char* suffix : {"", "-journal", "-wal", "-shm"}) {
    std::filesystem::remove(path_ + suffix, ignored);
  }
}

}  // namespace oblique::server
