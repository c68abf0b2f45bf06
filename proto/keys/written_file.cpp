#include "proto/keys/written_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <spdlog/fmt/fmt.h>

namespace oblique::protocol {
namespace {

constexpr mode_t kOwnersAlone = 0600;

[[noreturn]] void fail_to(std::string_view what, const std::string& path) {
  throw std::runtime_error(fmt::format("{} {}: {}", what, path, std::strerror(errno)));
}

void write_whole(const Descriptor& file, std::string_view text, const std::string& path) {
  while (!text.empty()) {
    const ssize_t written = ::write(file.number(), text.data(), text.size());
    if (written < 0 && errno != EINTR) {
      fail_to("cannot write", path);
    }
    text.remove_prefix(written < 0 ? 0 : static_cast<std::size_t>(written));
  }
  if (::fsync(file.number()) != 0) {
    fail_to("cannot write", path);
  }
}

/// A name is on the disk when its folder is.
void flush_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const Descriptor opened(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // Not every file system flushes folders.
  static_cast<void>(::fsync(opened.number()));
}

/// A file beside another one that goes unless it takes that one's place.
class Draft {
 public:
  explicit Draft(const std::string& path) : name_(path + ".XXXXXX") {
    file_ = Descriptor(::mkostemp(name_.data(), O_CLOEXEC));
    if (!file_.is_open()) {
      fail_to("cannot write beside", path);
    }
  }
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;
  ~Draft() {
    if (!name_.empty()) {
      ::unlink(name_.c_str());
    }
  }
  const Descriptor& file() const { return file_; }
  const std::string& name() const { return name_; }
  void replace(const std::string& path) {
    if (::rename(name_.c_str(), path.c_str()) != 0) {
      fail_to("cannot replace", path);
    }
    name_.clear();
  }

 private:
  std::string name_;
  Descriptor file_;
};

/// Of the file that has the name now, which another one may have taken over since it was opened.
bool is_still_called(const Descriptor& file, const std::string& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(file.number(), &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

void write_new_file(const std::string& path, std::string_view text) {
  const Descriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kOwnersAlone));
  if (!file.is_open() && errno == EEXIST) {
    throw std::runtime_error(path + " is there already, and is never overwritten");
  }
  if (!file.is_open()) {
    fail_to("cannot make", path);
  }
  try {
    write_whole(file, text, path);
  } catch (const std::runtime_error&) {
    ::unlink(path.c_str());
    throw;
  }
  flush_folder_of(path);
}

FileTurn::FileTurn(std::string path) : path_(std::move(path)) {
  // Of a link the file that it leads to is replaced: another one may lead there too.
  std::error_code is_new;
  if (auto real = std::filesystem::canonical(path_, is_new); !is_new) {
    path_ = real.string();
  }
  do {
    locked_ = Descriptor(::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kOwnersAlone));
    if (!locked_.is_open()) {
      fail_to("cannot open", path_);
    }
    while (::flock(locked_.number(), LOCK_EX) != 0) {
      if (errno != EINTR) {
        fail_to("cannot lock", path_);
      }
    }
  } while (!is_still_called(locked_, path_));
}

void FileTurn::replace(std::string_view text) const {
  struct stat before {};
  Draft draft(path_);
  if (::fstat(locked_.number(), &before) != 0 ||
      ::fchown(draft.file().number(), before.st_uid, before.st_gid) != 0 ||
      ::fchmod(draft.file().number(), before.st_mode & 07777U) != 0) {
    fail_to("cannot keep owner and mode of", path_);
  }
  write_whole(draft.file(), text, path_);
  draft.replace(path_);
  flush_folder_of(path_);
}

}  // namespace oblique::protocol
