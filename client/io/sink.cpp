#include "client/io/sink.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <system_error>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/io/console.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "standard output";

/// Empty: no pager is wanted.
std::string pager_command() {
  for (const char* name : {"OBLIQUE_PAGER", "PAGER"}) {
    if (const auto command = environment_variable(name)) {
      return *command == "cat" ? std::string() : *command;
    }
  }
  return "less -FRSX";
}

constexpr mode_t kMode = 0666;

[[noreturn]] void refuse(std::string_view flag, const std::string& path, int error) {
  throw solver::InputError(
      fmt::format("{} {} cannot be written: {}", flag, path, std::strerror(error)));
}

std::string name_of(int descriptor) {
  return fmt::format("/proc/self/fd/{}", descriptor);
}

/// Where bytes for the name `path` go, which may be a link.
struct FilePlace {
  std::string path;          // behind the links, as far as they lead to names
  bool is_in_place = false;  // opened and written as it is: a device, a pipe, /dev/stdout
  int open_descriptor = -1;  // in place: what this process already has open there; or -1
};

FilePlace file_place(const std::string& path, std::string_view flag) {
  constexpr int kMostLinks = 40;  // as Linux itself
  FilePlace place{path};
  std::error_code ignored;
  for (int links = 0; fs::is_symlink(fs::symlink_status(place.path, ignored)); ++links) {
    if (links == kMostLinks) {
      refuse(flag, path, ELOOP);
    }
    const fs::path link = fs::absolute(place.path);
    // Links of /proc, as behind /dev/stdout, lead to an open file, whatever name they show.
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

}  // namespace

void write_all(int descriptor, std::string_view bytes, const std::string& name) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EPIPE) {
      throw ClosedPipe();
    } else if (errno != EINTR) {
      throw std::runtime_error(
          fmt::format("{} could not be written: {}", name, std::strerror(errno)));
    }
  }
}

StandardOutput::StandardOutput(bool may_page)
    : is_terminal_(isatty(STDOUT_FILENO) == 1),
      pager_command_(may_page && is_terminal_ ? pager_command() : std::string()) {
  std::cout.flush();
}

StandardOutput::~StandardOutput() {
  wait_for_pager();
}

void StandardOutput::append(std::string_view bytes) {
  if (!is_terminal_) {
    write_all(STDOUT_FILENO, bytes, kName);
    return;
  }
  const std::string text = protocol::visible_lines(bytes);
  if (pager_command_.empty() || pager_ != nullptr) {
    write_all(pager_ == nullptr ? STDOUT_FILENO : to_pager_.number(), text, kName);
    return;
  }
  first_screen_ += text;
  const auto lines = std::count(first_screen_.begin(), first_screen_.end(), '\n');
  if (static_cast<std::size_t>(lines) + 1 >= terminal_size(STDOUT_FILENO).lines) {
    start_pager();
    write_all(to_pager_.number(), std::exchange(first_screen_, {}), kName);
  }
}

void StandardOutput::start_pager() {
  Pipe pipe;
  pager_ = std::make_unique<ChildProcess>(ChildSettings{
      .program = "sh",
      // A program that is not installed does not page: its text is printed.
      .arguments = {"-c", "command -v ${0%% *} >/dev/null 2>&1 || exec cat; eval \"$0\"",
                    pager_command_},
      .show_errors = true,
      .stays_in_our_group = true,
      .input_from = pipe.read.number(),
      .show_output = true});
  to_pager_ = std::move(pipe.write);
  // Writing fails once the user has left the pager. Ctrl-C belongs to the pager.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGINT, SIG_IGN);
}

void StandardOutput::finish() {
  write_all(STDOUT_FILENO, std::exchange(first_screen_, {}), kName);
  wait_for_pager();
}

void StandardOutput::wait_for_pager() {
  if (to_pager_.is_open()) {
    to_pager_.close();
    pager_->wait();
    std::signal(SIGINT, SIG_DFL);
  }
}

bool is_written_in_place(const std::string& path) {
  return file_place(path, "--out").is_in_place;
}

AtomicFile::AtomicFile(const std::string& path, std::string_view flag) : name_(path) {
  const FilePlace place = file_place(path, flag);
  path_ = place.path;
  is_in_place_ = place.is_in_place;
  if (place.open_descriptor >= 0) {
    // Opening it again would overwrite the file behind it from its beginning.
    descriptor_ = Descriptor(::fcntl(place.open_descriptor, F_DUPFD_CLOEXEC, 0));
  } else if (is_in_place_) {
    descriptor_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_CLOEXEC));
  } else {
    open_draft();
  }
  if (!descriptor_.is_open()) {
    refuse(flag, name_, errno);
  }
}

/// Nameless where possible: then nothing is left, however the program ends.
void AtomicFile::open_draft() {
  draft_ = fmt::format("{}.part-{}", path_, ::getpid());
  descriptor_ = Descriptor(
      ::open(fs::absolute(path_).parent_path().c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, kMode));
  if (descriptor_.is_open() && ::access(name_of(descriptor_.number()).c_str(), F_OK) != 0) {
    descriptor_.close();  // without /proc it could not get a name
    errno = EOPNOTSUPP;
  }
  if (!descriptor_.is_open() && (errno == EOPNOTSUPP || errno == EISDIR || errno == EINVAL)) {
    descriptor_ =
        Descriptor(::open(draft_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode));
    has_name_ = descriptor_.is_open();
  }
}

AtomicFile::~AtomicFile() {
  if (has_name_) {
    ::unlink(draft_.c_str());
  }
}

void AtomicFile::append(std::string_view bytes) {
  write_all(descriptor_.number(), bytes, name_);
}

void AtomicFile::finish() {
  const auto require = [this](bool succeeded) {
    if (!succeeded) {
      throw std::runtime_error(
          fmt::format("{} could not be written: {}", name_, std::strerror(errno)));
    }
  };
  if (is_in_place_) {
    require(::close(descriptor_.release()) == 0);
    return;
  }
  // A full disk may show only here.
  require(::fsync(descriptor_.number()) == 0);
  if (!has_name_) {
    require(::linkat(AT_FDCWD, name_of(descriptor_.number()).c_str(), AT_FDCWD, draft_.c_str(),
                     AT_SYMLINK_FOLLOW) == 0);
    has_name_ = true;
  }
  require(::close(descriptor_.release()) == 0);
  require(std::rename(draft_.c_str(), path_.c_str()) == 0);
  has_name_ = false;
}

}  // namespace oblique::client
