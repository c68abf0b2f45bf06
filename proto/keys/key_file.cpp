#include "proto/keys/key_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sodium.h>

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include "proto/small_file.h"
#include "proto/suggestion.h"
#include "proto/system/descriptor.h"
#include "proto/text.h"
#include "proto/toml_reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
constexpr mode_t kOwnersAlone = 0600;
constexpr std::array<std::string_view, 4> kServersFields{"role", "name", "public", "secret"};
constexpr std::array<std::string_view, 5> kPeersFields{"role", "name", "public", "secret",
                                                       "server"};
constexpr std::array<std::string_view, 4> kEntryFields{"name", "role", "public", "added_at"};
constexpr std::array<std::string_view, 1> kListFields{"key"};

/// The fields of one table of a file. Errors never show a value, which may be a secret.
class KeyFields {
 public:
  KeyFields(const TomlReader& file, const toml::table& table) : file_(file), table_(table) {}

  std::string text(std::string_view field) const {
    const toml::node* node = table_.get(field);
    if (node == nullptr) {
      file_.fail(table_, fmt::format("`{}` is missing", field));
    }
    if (!node->is_string()) {
      file_.fail(*node, fmt::format("`{}` must be a text in quotes", field));
    }
    return *node->value<std::string>();
  }
  Role role() const {
    const auto role = role_named(text("role"));
    if (!role) {
      fail("role", "`role` must be \"server\", \"client\", \"worker\" or \"reader\"");
    }
    return *role;
  }
  CurveKey key(std::string_view field) const {
    const auto key = key_of_z85(text(field));
    if (!key) {
      fail(field, fmt::format("`{}` is no key: one has {} characters, as `oblique keygen` writes "
                              "them",
                              field, kKeyCharacters));
    }
    return *key;
  }
  std::string name() const {
    std::string name = text("name");
    if (const std::string objection = objection_to_key_name(name); !objection.empty()) {
      fail("name", "`name`: " + objection);
    }
    return name;
  }
  void refuse_unknown(std::span<const std::string_view> known, std::string_view what) const {
    file_.refuse_unknown(table_, known, "", fmt::format("{} has {}", what, joined(known)));
  }
  /// About a field that exists.
  [[noreturn]] void fail(std::string_view field, const std::string& message) const {
    file_.fail(*table_.get(field), message);
  }

 private:
  const TomlReader& file_;
  const toml::table& table_;
};

[[noreturn]] void fail_to(std::string_view what, const std::string& path) {
  throw std::runtime_error(fmt::format("{} {}: {}", what, path, std::strerror(errno)));
}

/// A new file, which gets `text` and is flushed to the disk with its name; removed when that fails.
/// `prepare` runs before anything is written, `finish` afterwards.
void write_new_file(const std::string& path, std::string_view text,
                    const std::function<void(const Descriptor&)>& prepare,
                    const std::function<void()>& finish) {
  const Descriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kOwnersAlone));
  if (!file.is_open() && errno == EEXIST) {
    throw std::runtime_error(path + " is there already, and is never overwritten");
  }
  if (!file.is_open()) {
    fail_to("cannot make", path);
  }
  try {
    prepare(file);
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
    finish();
  } catch (const std::runtime_error&) {
    ::unlink(path.c_str());
    throw;
  }
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const Descriptor opened(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // Not every file system flushes folders.
  static_cast<void>(::fsync(opened.number()));
}

/// The file, created where it is missing and locked against other processes that change it.
Descriptor locked_file(const std::string& path) {
  for (;;) {
    Descriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kOwnersAlone));
    if (!file.is_open()) {
      fail_to("cannot open", path);
    }
    while (::flock(file.number(), LOCK_EX) != 0) {
      if (errno != EINTR) {
        fail_to("cannot lock", path);
      }
    }
    // Another process may have replaced the file before the lock.
    struct stat opened {};
    struct stat named {};
    if (::fstat(file.number(), &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
        opened.st_dev == named.st_dev && opened.st_ino == named.st_ino) {
      return file;
    }
  }
}

/// Replaces a locked file in one step, keeping owner and mode.
void replace_file(const Descriptor& locked, const std::string& path, std::string_view text) {
  const std::string draft = path + ".new";
  ::unlink(draft.c_str());  // left by a process that was killed
  const auto keep_owner_and_mode = [&](const Descriptor& file) {
    struct stat before {};
    if (::fstat(locked.number(), &before) != 0 ||
        ::fchown(file.number(), before.st_uid, before.st_gid) != 0 ||
        ::fchmod(file.number(), before.st_mode & 07777U) != 0) {
      fail_to("cannot keep owner and mode of", path);
    }
  };
  write_new_file(draft, text, keep_owner_and_mode, [&] {
    if (::rename(draft.c_str(), path.c_str()) != 0) {
      fail_to("cannot replace", path);
    }
  });
}

/// Refuses a file or folder that has one of the mode bits `refused`; reading it reports why it
/// cannot be read.
void refuse_mode(const std::string& what, const std::string& path, mode_t refused,
                 std::string_view risk, std::string_view remedy) {
  struct stat file {};
  if (::stat(path.c_str(), &file) == 0 && (file.st_mode & refused) != 0) {
    throw solver::InputError(
        fmt::format("{} {} has mode {:04o}: {}, so it is not used. Mend it with: chmod {} '{}'",
                    what, path, file.st_mode & 07777U, risk, remedy, path));
  }
}

/// Whoever can read a secret key can pass for its owner.
void check_readers(const std::string& path) {
  struct stat file {};
  if (::stat(path.c_str(), &file) == 0 && S_ISREG(file.st_mode)) {
    const bool is_ours = file.st_uid == ::geteuid();
    refuse_mode("the key file", path, is_ours ? S_IRWXG | S_IRWXO : S_IRWXO,
                "others than its owner can use the secret key in it", is_ours ? "600" : "o=");
  }
}

/// Anyone who can write or replace the list can add a key.
void check_writers(const std::string& path) {
  constexpr std::string_view kRisk = "everybody could add a key";
  refuse_mode("the list of keys", path, S_IWOTH, kRisk, "o-w");
  const std::string parent = std::filesystem::path(path).parent_path().string();
  const std::string folder = parent.empty() ? "." : parent;
  struct stat file {};
  if (::stat(folder.c_str(), &file) == 0 && (file.st_mode & S_ISVTX) == 0) {
    refuse_mode("the folder of the list of keys,", folder, S_IWOTH, kRisk, "o-w");
  }
}

/// Takes the secret key out of a key file's text and leaves zeros there: a parser leaves copies of
/// its text in memory. Nothing unless a line begins with `secret = "KEY"`.
std::optional<SecretKey> take_secret(std::string& text) {
  const std::size_t line = text.starts_with("secret") ? 0 : text.find("\nsecret");
  const std::size_t quote = text.find_first_of("\"'", line);
  if (line == std::string::npos || quote == std::string::npos) {
    return std::nullopt;
  }
  std::optional<SecretKey> key =
      secret_key_of_z85(std::string_view(text).substr(quote + 1, kKeyCharacters));
  if (key) {
    text.replace(quote + 1, kKeyCharacters, kKeyCharacters, '0');
  }
  return key;
}

AuthorizedKey entry_of(const TomlReader& file, const toml::node& node) {
  const auto* table = node.as_table();
  if (table == nullptr) {
    file.fail(node, "`key` must be tables, as [[key]]");
  }
  const KeyFields fields(file, *table);
  fields.refuse_unknown(kEntryFields, "an entry");
  AuthorizedKey key{fields.name(), fields.role(), fields.key("public"), fields.text("added_at")};
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

}  // namespace

KeyFile read_key_file(const std::string& path) {
  check_readers(path);
  std::string text = read_small_file(path, "the key file", kMostBytes);
  const std::optional<SecretKey> secret = take_secret(text);
  const TomlReader file(path);
  const toml::table top = file.parse(text);
  const KeyFields fields(file, top);
  KeyFile key;
  key.path = path;
  key.role = fields.role();
  const bool is_server = key.role == Role::kServer;
  fields.refuse_unknown(is_server ? std::span<const std::string_view>(kServersFields)
                                  : std::span<const std::string_view>(kPeersFields),
                        is_server ? "the server's key file" : "a key file");
  key.name = fields.name();
  key.pair.public_key = fields.key("public");
  if (fields.key("secret") != CurveKey{} || !secret) {
    fields.fail("secret", "`secret` must begin its line, as secret = \"KEY\"");
  }
  key.pair.secret_key = *secret;
  if (public_half_of(key.pair.secret_key) != key.pair.public_key) {
    fields.fail("secret", "`secret` is not the other half of `public`");
  }
  if (!is_server) {
    key.server = fields.key("server");
  }
  return key;
}

void write_key_file(const std::string& path, const KeyFile& key) {
  constexpr std::size_t kLongestRest = 256;
  std::string text = fmt::format(
      "# A key of oblique: whoever can read this file can pass for its owner.\n"
      "role = \"{}\"\nname = \"{}\"\npublic = \"{}\"\n",
      name_of(key.role), key.name, z85(key.pair.public_key));
  std::string secret = z85(key.pair.secret_key.bytes());
  text.reserve(text.size() + kLongestRest);  // growing would leave the secret key behind
  ((text += "secret = \"") += secret) += "\"\n";
  if (key.server) {
    text += fmt::format("server = \"{}\"  # public key\n", z85(*key.server));
  }
  const auto wipe = [&] {
    sodium_memzero(secret.data(), secret.size());
    sodium_memzero(text.data(), text.size());
  };
  try {
    write_new_file(
        path, text, [](const Descriptor&) {}, [] {});
  } catch (const std::runtime_error&) {
    wipe();
    throw;
  }
  wipe();
}

std::string objection_to_key_name(std::string_view name) {
  constexpr std::size_t kLongest = 64;
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 && static_cast<unsigned char>(c) < 0x80;
  };
  const auto is_allowed = [&](char c) {
    return is_plain(c) || std::string_view("._-@").find(c) != std::string_view::npos;
  };
  return !name.empty() && name.size() <= kLongest && is_plain(name.front()) &&
                 std::all_of(name.begin(), name.end(), is_allowed)
             ? ""
             : "the name of a key has 1 to 64 letters, digits or . _ - @, and begins with a letter "
               "or digit";
}

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
    std::vector<std::string_view> names;
    for (const AuthorizedKey& key : keys_) {
      names.emplace_back(key.name);
    }
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
  check_writers(path);
  const TomlReader file(path);
  const toml::table top = file.parse(read_small_file(path, "the list of keys", kMostBytes));
  KeyFields(file, top).refuse_unknown(kListFields, "a list of keys");
  AuthorizedKeys keys;
  const toml::node* list = top.get("key");
  if (list == nullptr) {
    return keys;
  }
  if (!list->is_array()) {
    file.fail(*list, "`key` must be tables, as [[key]]");
  }
  for (const toml::node& node : *list->as_array()) {
    file.located(node, [&, key = entry_of(file, node)] { keys.add(key); });
  }
  return keys;
}

void change_authorized_keys(const std::string& path,
                            const std::function<void(AuthorizedKeys&)>& change) {
  // Of a link the file that it leads to is replaced: another one may lead there too.
  std::error_code is_new;
  const auto real = std::filesystem::canonical(path, is_new);
  const std::string target = is_new ? path : real.string();
  const Descriptor locked = locked_file(target);
  AuthorizedKeys keys = read_authorized_keys(path);
  change(keys);
  const std::string text = text_of(keys);
  if (text.size() > kMostBytes) {
    throw solver::InputError(
        fmt::format("the list of keys {} would have {} bytes, and one of more than {} is not read: "
                    "revoke keys that nobody uses",
                    path, text.size(), kMostBytes));
  }
  replace_file(locked, target, text);
}

std::string utc_now() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

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
  constexpr mode_t kFolderMode = 0700;
  if (::mkdir(folder.c_str(), kFolderMode) == 0) {
    made.add(folder);
  } else if (errno != EEXIST) {
    fail_to("cannot make the folder", folder);
  }
  const std::string list = authorized_keys_in(folder);
  if (std::filesystem::exists(std::filesystem::symlink_status(list))) {
    throw std::runtime_error(list + " is there already, and is never overwritten");
  }
  const KeyPair server = made_key_pair();
  const std::string server_file = key_file_in(folder, "server");
  write_key_file(server_file, {Role::kServer, "server", server});
  made.add(server_file);
  made.add(list);
  for (const Role role : {Role::kClient, Role::kWorker, Role::kReader}) {
    const std::string name(name_of(role));
    add_key(folder, name, role, std::nullopt);
    made.add(key_file_in(folder, name));
  }
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
