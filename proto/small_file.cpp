#include "proto/small_file.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <spdlog/fmt/fmt.h>

#include "proto/system/descriptor.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {

std::string read_small_file(const std::string& path, std::string_view what,
                            std::size_t most_bytes) {
  const auto refuse = [&](const std::string& why) {
    throw solver::InputError(fmt::format("{} {} cannot be read: {}", what, path, why));
  };
  // Without O_NONBLOCK, opening a pipe waits for a writer.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat about {};
  if (!file.is_open() || ::fstat(file.number(), &about) != 0) {
    refuse(std::strerror(errno));
  }
  if (S_ISCHR(about.st_mode) && about.st_rdev == makedev(1, 3)) {
    return {};
  }
  if (!S_ISREG(about.st_mode)) {
    refuse(fmt::format("it is {}, and must be a regular file of at most {} bytes",
                       kind_of_file(about.st_mode), most_bytes));
  }
  if (static_cast<std::size_t>(about.st_size) > most_bytes) {
    refuse(fmt::format("it has {} bytes, and at most {} are allowed", about.st_size, most_bytes));
  }
  std::string text(static_cast<std::size_t>(about.st_size), '\0');
  std::size_t length = 0;
  while (length < text.size()) {
    const ssize_t count = ::read(file.number(), text.data() + length, text.size() - length);
    if (count == 0) {
      break;
    }
    if (count < 0 && errno != EINTR) {
      refuse(std::strerror(errno));
    }
    length += count < 0 ? 0 : static_cast<std::size_t>(count);
  }
  text.resize(length);
  return text;
}

}  // namespace oblique::protocol
