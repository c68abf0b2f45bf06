#include "proto/keys/authorized_keys.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <string_view>
#include <vector>

#include <sys/stat.h>

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include "proto/keys/key_file.h"
#include "proto/keys/toml_fields.h"
#include "proto/keys/written_file.h"
#include "proto/suggestion.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

constexpr std::array<std::string_view, 4> kEntryFields{"name", "role", "public", "added_at"};
constexpr std::array<std::string_view, 1> kTopFields{"key"};

[[noreturn]] void refuse_writers(const std::string& what, mode_t mode, const std::string& path) {
  throw solver::InputError(
      fmt::format("{} has mode {:04o}: everybody could add a key, so it is not used. Mend it with: "
                  "chmod o-w '{}'",
                  what, mode & 07777U, path));
}

/// Anyone who can write or replace this file can add a key of his own.
void check_file(const std::string& path) {
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0) {
    return;  // reading it tells why
  }
  if ((file.st_mode & S_IWOTH) != 0) {
    refuse_writers("the list of keys " + path, file.st_mode, path);
  }
  const std::string parent = std::filesystem::path(path).parent_path().string();
  const std::string folder = parent.empty() ? "." : parent;
  if (::stat(folder.c_str(), &file) == 0 && (file.st_mode & S_IWOTH) != 0 &&
      (file.st_mode & S_ISVTX) == 0) {
    refuse_writers("the folder of the list of keys, " + folder + ",", file.st_mode, folder);
  }
}

AuthorizedKey entry_of(const std::string& path, const toml::node& node) {
  const auto* table = node.as_table();
  if (table == nullptr) {
    throw solver::InputError(
        fmt::format("{}:{}: `key` must be tables, as [[key]]", path, node.source().begin.line));
  }
  const TomlFields fields(path, *table);
  fields.refuse_unknown(kEntryFields, "an entry");
  AuthorizedKey key{fields.key_name("name"), fields.role("role"), fields.key("public"),
                    fields.text("added_at")};
  if (key.role == Role::kServer) {
    fields.fail("role", "`role` must be \"client\", \"worker\" or \"reader\": a server is no peer");
  }
  return key;
}

std::string text_of(const AuthorizedKeys& keys) {
  std::string text =
      "# Keys that oblique-server admits. `oblique keys add` and `oblique keys revoke` write this\n"
      "# file anew, without other comments; a running server heeds every change of it.\n";
  for (const AuthorizedKey& key : keys.all()) {
    text +=
        fmt::format("\n[[key]]\nname = \"{}\"\nrole = \"{}\"\npublic = \"{}\"\nadded_at = \"{}\"\n",
                    key.name, name_of(key.role), z85(key.public_key), key.added_at);
  }
  return text;
}

}  // namespace

const AuthorizedKey* AuthorizedKeys::find(const CurveKey& public_key) const {
  const auto place = places_.find(public_key);
  return place == places_.end() ? nullptr : &keys_.at(place->second);
}

const AuthorizedKey* AuthorizedKeys::find(std::string_view name) const {
  const auto place = places_by_name_.find(name);
  return place == places_by_name_.end() ? nullptr : &keys_.at(place->second);
}

void AuthorizedKeys::add(AuthorizedKey key) {
  if (const std::string objection = objection_to_key_name(key.name); !objection.empty()) {
    throw solver::InputError(objection);
  }
  if (find(key.name) != nullptr) {
    throw solver::InputError(fmt::format("there is a key called {} already", key.name));
  }
  if (const auto* same = find(key.public_key)) {
    throw solver::InputError(fmt::format("the public key {} is there already, called {}",
                                         z85(key.public_key), same->name));
  }
  places_.emplace(key.public_key, keys_.size());
  places_by_name_.emplace(key.name, keys_.size());
  keys_.push_back(std::move(key));
}

AuthorizedKey AuthorizedKeys::remove(std::string_view name) {
  const auto* found = find(name);
  if (found == nullptr) {
    const std::vector<std::string_view> names = [this] {
      std::vector<std::string_view> all;
      for (const AuthorizedKey& key : keys_) {
        all.emplace_back(key.name);
      }
      return all;
    }();
    throw solver::InputError(fmt::format("there is no key called {}{}; there {}", excerpt(name),
                                         did_you_mean(name, names),
                                         names.empty() ? "is none" : "are: " + joined(names)));
  }
  AuthorizedKey removed = *found;
  AuthorizedKeys others;
  for (AuthorizedKey& key : keys_) {
    if (key.name != name) {
      others.add(std::move(key));
    }
  }
  *this = std::move(others);
  return removed;
}

std::string authorized_keys_beside(const std::string& server_key_file) {
  return (std::filesystem::path(server_key_file).parent_path() / "authorized_keys.toml").string();
}

AuthorizedKeys read_authorized_keys(const std::string& path) {
  check_file(path);
  const TomlFile file(path, "the list of keys");
  TomlFields(path, file.top()).refuse_unknown(kTopFields, "a list of keys");
  AuthorizedKeys keys;
  const toml::node* list = file.top().get("key");
  if (list == nullptr) {
    return keys;
  }
  if (!list->is_array()) {
    throw solver::InputError(
        fmt::format("{}:{}: `key` must be tables, as [[key]]", path, list->source().begin.line));
  }
  for (const toml::node& node : *list->as_array()) {
    AuthorizedKey key = entry_of(path, node);
    try {
      keys.add(std::move(key));
    } catch (const solver::InputError& error) {
      throw solver::InputError(
          fmt::format("{}:{}: {}", path, node.source().begin.line, error.what()));
    }
  }
  return keys;
}

void change_authorized_keys(const std::string& path,
                            const std::function<void(AuthorizedKeys&)>& change) {
  const FileTurn turn(path);
  AuthorizedKeys keys = read_authorized_keys(path);
  change(keys);
  const std::string text = text_of(keys);
  if (text.size() > TomlFile::kMostBytes) {
    throw solver::InputError(
        fmt::format("the list of keys {} would have {} bytes, and one of more than {} is not read: "
                    "revoke keys that nobody uses",
                    path, text.size(), TomlFile::kMostBytes));
  }
  turn.replace(text);
}

std::string utc_now() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

}  // namespace oblique::protocol
