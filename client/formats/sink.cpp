#include "client/formats/sink.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

std::string reason_of(int error) {
  return std::strerror(error);
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
      throw std::runtime_error(fmt::format("{} could not be written: {}", name, reason_of(errno)));
    }
  }
}

void Sink::flush() {
  // What cannot be written is not tried again.
  const std::string bytes = std::exchange(held_, {});
  write(bytes);
  held_ = bytes;
  held_.clear();
}

StandardOutput::StandardOutput() : is_terminal_(isatty(STDOUT_FILENO) == 1) {
  std::cout.flush();
}

void StandardOutput::write(std::string_view bytes) {
  constexpr const char* kName = "standard output";
  if (is_terminal_) {
    write_all(STDOUT_FILENO, protocol::visible_lines(std::string(bytes)), kName);
  } else {
    write_all(STDOUT_FILENO, bytes, kName);
  }
}

NewFile::NewFile(std::string path, std::string_view flag) : path_(std::move(path)) {
  struct stat found {};
  const bool is_there = ::stat(path_.c_str(), &found) == 0;
  if (is_there && S_ISDIR(found.st_mode)) {
    throw solver::InputError(fmt::format("{} {} is a folder", flag, path_));
  }
  constexpr mode_t kMode = 0666;
  if (is_there && !S_ISREG(found.st_mode)) {
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    draft_ = fmt::format("{}.part-{}", path_, ::getpid());
    descriptor_ = ::open(draft_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
  }
  if (descriptor_ < 0) {
    throw solver::InputError(
        fmt::format("{} {} cannot be written: {}", flag, path_, reason_of(errno)));
  }
}

NewFile::~NewFile() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
    if (!draft_.empty()) {
      ::unlink(draft_.c_str());
    }
  }
}

void NewFile::write(std::string_view bytes) {
  write_all(descriptor_, bytes, path_);
}

void NewFile::finish() {
  flush();
  // A disk that is full may say so only now.
  bool is_whole = draft_.empty() || ::fsync(descriptor_) == 0;
  is_whole = ::close(std::exchange(descriptor_, -1)) == 0 && is_whole;
  if (is_whole && (draft_.empty() || std::rename(draft_.c_str(), path_.c_str()) == 0)) {
    return;
  }
  const int error = errno;
  if (!draft_.empty()) {
    ::unlink(draft_.c_str());
  }
  throw std::runtime_error(fmt::format("{} could not be written: {}", path_, reason_of(error)));
}

}  // namespace oblique::client
