#include "proto/keys/key_folder.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <sys/stat.h>

#include <spdlog/fmt/fmt.h>

#include "proto/keys/key_file.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

constexpr std::array kPeers{Role::kClient, Role::kWorker, Role::kReader};

/// Files that go again unless all of them could be made.
class MadeFiles {
 public:
  MadeFiles() = default;
  MadeFiles(const MadeFiles&) = delete;
  MadeFiles& operator=(const MadeFiles&) = delete;
  ~MadeFiles() {
    for (auto path = paths_.rbegin(); path != paths_.rend(); ++path) {
      std::error_code ignored;
      std::filesystem::remove(*path, ignored);
    }
  }
  void add(const std::string& path) { paths_.push_back(path); }
  void keep() { paths_.clear(); }

 private:
  std::vector<std::string> paths_;
};

void make_folder(const std::string& folder, MadeFiles& made) {
  constexpr mode_t kFolderMode = 0700;
  if (::mkdir(folder.c_str(), kFolderMode) == 0) {
    made.add(folder);
  } else if (errno != EEXIST) {
    throw std::runtime_error(
        fmt::format("cannot make the folder {}: {}", folder, std::strerror(errno)));
  }
}

}  // namespace

std::string key_file_in(const std::string& folder, const std::string& name) {
  return (std::filesystem::path(folder) / (name + ".key")).string();
}

std::string authorized_keys_in(const std::string& folder) {
  return authorized_keys_beside(key_file_in(folder, "server"));
}

std::string key_folder_meant(const std::string& named) {
  const auto is_there = [](const std::string& path) {
    return std::filesystem::exists(std::filesystem::symlink_status(path));
  };
  const auto has_keys = [&is_there](const std::string& folder) {
    return is_there(authorized_keys_in(folder)) || is_there(key_file_in(folder, "server"));
  };
  std::string folder = named;
  if (folder.empty()) {
    folder = !has_keys(".") && has_keys("keys") ? "keys" : ".";
  }
  if (!has_keys(folder)) {
    throw solver::InputError(
        fmt::format("there is no {}: name the folder of the server's keys with --dir DIR",
                    authorized_keys_in(folder)));
  }
  return folder;
}

CurveKey make_key_folder(const std::string& folder) {
  MadeFiles made;
  make_folder(folder, made);
  const std::string list = authorized_keys_in(folder);
  if (std::filesystem::exists(std::filesystem::symlink_status(list))) {
    throw std::runtime_error(list + " is there already, and is never overwritten");
  }
  const auto write = [&](const KeyFile& key) {
    const std::string path = key_file_in(folder, key.name);
    write_key_file(path, key);
    made.add(path);
  };
  const KeyPair server = made_key_pair();
  write({Role::kServer, "server", server});
  std::vector<AuthorizedKey> listed;
  for (const Role role : kPeers) {
    const std::string name(name_of(role));
    const KeyPair pair = made_key_pair();
    write({role, name, pair, server.public_key});
    listed.push_back({name, role, pair.public_key, utc_now()});
  }
  made.add(list);
  change_authorized_keys(list, [&](AuthorizedKeys& keys) {
    for (AuthorizedKey& key : listed) {
      keys.add(std::move(key));
    }
  });
  made.keep();
  return server.public_key;
}

AuthorizedKey add_key(const std::string& folder, const std::string& name, Role role,
                      const std::optional<CurveKey>& public_key) {
  const std::string server_file = key_file_in(folder, "server");
  const KeyFile server = read_key_file(server_file);
  if (server.role != Role::kServer) {
    throw solver::InputError(fmt::format("{} is the key of a {}, and not of a server", server_file,
                                         name_of(server.role)));
  }
  const KeyPair pair = public_key ? KeyPair{*public_key, {}} : made_key_pair();
  const AuthorizedKey added{name, role, pair.public_key, utc_now()};
  MadeFiles made;
  change_authorized_keys(authorized_keys_in(folder), [&](AuthorizedKeys& keys) {
    keys.add(added);
    if (!public_key) {
      const std::string path = key_file_in(folder, name);
      write_key_file(path, {role, name, pair, server.pair.public_key});
      made.add(path);
    }
  });
  made.keep();
  return added;
}

}  // namespace oblique::protocol
