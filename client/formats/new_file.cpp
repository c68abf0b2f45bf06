#include "client/formats/new_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

namespace fs = std::filesystem;

constexpr mode_t kMode = 0666;

[[noreturn]] void refuse(std::string_view flag, const std::string& path, int error) {
  throw solver::InputError(
      fmt::format("{} {} cannot be written: {}", flag, path, std::strerror(error)));
}

/// The name of a descriptor in the way in which every process finds its own.
std::string name_of(int descriptor) {
  return fmt::format("/proc/self/fd/{}", descriptor);
}

}  // namespace

std::string FilePlace::folder() const {
  return fs::absolute(path).parent_path();
}

FilePlace file_place(const std::string& path, std::string_view flag) {
  constexpr int kMostLinks = 40;  // as the system's own bound
  FilePlace place{path};
  std::error_code ignored;
  for (int links = 0; fs::is_symlink(fs::symlink_status(place.path, ignored)); ++links) {
    if (links == kMostLinks) {
      refuse(flag, path, ELOOP);
    }
    const fs::path link = fs::absolute(place.path);
    // Links of /proc, as behind /dev/stdout, lead to what is open, whatever name they show.
    const std::string folder = fs::weakly_canonical(link.parent_path(), ignored).string();
    if (folder.starts_with("/proc/")) {
      const auto number = solver::number_of(link.filename().string());
      const bool is_ours = folder == fmt::format("/proc/{}/fd", ::getpid()) && number;
      place.open_descriptor = is_ours ? static_cast<int>(*number) : -1;
      place.is_in_place = true;
      return place;
    }
    const fs::path target = fs::read_symlink(link, ignored);
    place.path = target.is_absolute() ? target : link.parent_path() / target;
  }
  struct stat found {};
  if (::stat(place.path.c_str(), &found) == 0) {
    if (S_ISDIR(found.st_mode)) {
      throw solver::InputError(fmt::format("{} {} is a folder", flag, path));
    }
    place.is_in_place = !S_ISREG(found.st_mode);
  }
  return place;
}

NewFile::NewFile(const std::string& path, std::string_view flag)
    : name_(path), place_(file_place(path, flag)) {
  if (place_.open_descriptor >= 0) {
    // Not opened again: what stands in a file already would be written over.
    descriptor_ = ::fcntl(place_.open_descriptor, F_DUPFD_CLOEXEC, 0);
  } else if (place_.is_in_place) {
    descriptor_ = ::open(place_.path.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    open_draft();
  }
  if (descriptor_ < 0) {
    refuse(flag, name_, errno);
  }
}

/// Without a name where that can be: nothing is left then, however the program ends.
void NewFile::open_draft() {
  draft_ = fmt::format("{}.part-{}", place_.path, ::getpid());
  descriptor_ = ::open(place_.folder().c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, kMode);
  if (descriptor_ >= 0 && ::access(name_of(descriptor_).c_str(), F_OK) != 0) {
    ::close(std::exchange(descriptor_, -1));  // without /proc it would never get a name
    errno = EOPNOTSUPP;
  }
  if (descriptor_ < 0 && (errno == EOPNOTSUPP || errno == EISDIR || errno == EINVAL)) {
    descriptor_ = ::open(draft_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
    has_name_ = descriptor_ >= 0;
  }
}

NewFile::~NewFile() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
  if (has_name_) {
    ::unlink(draft_.c_str());
  }
}

void NewFile::write(std::string_view bytes) {
  write_all(descriptor_, bytes, name_);
}

void NewFile::finish() {
  flush();
  // A disk that is full may say so only now.
  bool is_whole = place_.is_in_place || ::fsync(descriptor_) == 0;
  if (is_whole && !place_.is_in_place && !has_name_) {
    has_name_ = ::linkat(AT_FDCWD, name_of(descriptor_).c_str(), AT_FDCWD, draft_.c_str(),
                         AT_SYMLINK_FOLLOW) == 0;
    is_whole = has_name_;
  }
  const int error = is_whole ? 0 : errno;
  is_whole = ::close(std::exchange(descriptor_, -1)) == 0 && is_whole;
  is_whole =
      is_whole && (place_.is_in_place || std::rename(draft_.c_str(), place_.path.c_str()) == 0);
  if (!is_whole) {
    throw std::runtime_error(fmt::format("{} could not be written: {}", name_,
                                         std::strerror(error != 0 ? error : errno)));
  }
  has_name_ = false;
}

}  // namespace oblique::client
