#include "client/service/keys_for_a_run.h"

#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "proto/keys/key_file.h"

namespace oblique::client {
namespace {

/// A new folder of mode 0700.
std::string made_folder() {
  std::string name = (std::filesystem::temp_directory_path() / "oblique-run-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) {
    throw std::runtime_error(
        fmt::format("cannot make a folder for keys, {}: {}", name, std::strerror(errno)));
  }
  return name;
}

}  // namespace

KeysForARun::KeysForARun() : folder_(made_folder()) {
  try {
    protocol::make_key_folder(folder_);
  } catch (const std::runtime_error&) {
    ::rmdir(folder_.c_str());
    throw;
  }
}

KeysForARun::~KeysForARun() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string KeysForARun::file_of(protocol::Role role) const {
  return protocol::key_file_in(folder_, std::string(name_of(role)));
}

}  // namespace oblique::client
