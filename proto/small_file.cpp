#include "proto/small_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/errors.h"

namespace oblique::protocol {

std::string read_small_file(const std::string& path, std::string_view what,
                            std::size_t most_bytes) {
  const auto refuse = [&](const std::string& why) {
    throw solver::InputError(fmt::format("{} {} cannot be read: {}", what, path, why));
  };
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) {
    refuse(std::strerror(errno));
  }
  if (S_ISCHR(about.st_mode) && about.st_rdev == makedev(1, 3)) {
    return {};
  }
  if (!S_ISREG(about.st_mode)) {  // opening a pipe could block
    refuse(fmt::format("it is {}, and must be a regular file of at most {} bytes",
                       kind_of_file(about.st_mode), most_bytes));
  }
  if (static_cast<std::size_t>(about.st_size) > most_bytes) {
    refuse(fmt::format("it has {} bytes, and at most {} are allowed", about.st_size, most_bytes));
  }
  std::ifstream file;
  file.rdbuf()->pubsetbuf(nullptr, 0);  // a buffer could keep a copy of a secret in the file
  file.open(path, std::ios::binary);
  std::string text(static_cast<std::size_t>(about.st_size), '\0');
  if (!file.is_open() || file.read(text.data(), about.st_size).bad()) {
    refuse(std::strerror(errno));
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

Descriptor open_folder_of(const std::string& path) {
  const std::string folder = std::filesystem::absolute(path).parent_path();
  Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!opened.is_open()) {
    throw std::runtime_error(
        fmt::format("cannot open the folder {}: {}", folder, std::strerror(errno)));
  }
  return opened;
}

}  // namespace oblique::protocol
