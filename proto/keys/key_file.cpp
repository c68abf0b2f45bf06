#include "proto/keys/key_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <regex>
#include <span>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sodium.h>
#include <zmq.h>

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include "proto/small_file.h"
#include "proto/system/descriptor.h"
#include "proto/text.h"
#include "proto/toml_reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {

namespace {

/// Returns false if `text` does not encode a key.
bool decode_z85(std::string_view text, CurveKey& key) {
  if (text.size() != kKeyCharacters || text.find('\0') != std::string_view::npos) {
    return false;
  }
  std::array<char, kKeyCharacters + 1> terminated{};
  std::ranges::copy(text, terminated.begin());
  const bool is_key = zmq_z85_decode(key.data(), terminated.data()) != nullptr;
  sodium_memzero(terminated.data(), terminated.size());
  return is_key;
}

constexpr std::array<std::string_view, 4> kRoles{"server", "client", "worker", "reader"};

}  // namespace

std::string_view name_of(Role role) {
  return kRoles.at(static_cast<std::size_t>(role));
}

std::optional<Role> role_named(std::string_view name) {
  const auto* const found = std::find(kRoles.begin(), kRoles.end(), name);
  return found == kRoles.end() ? std::nullopt
                               : std::optional(static_cast<Role>(found - kRoles.begin()));
}

SecretKey::SecretKey() {
  if (sodium_init() >= 0) {
    bytes_.reset(static_cast<CurveKey*>(sodium_malloc(sizeof(CurveKey))), sodium_free);
  }
  if (!bytes_) {
    throw std::runtime_error("cannot use keys: the system refuses locked memory or random numbers");
  }
  bytes_->fill(0);
}

KeyPair generate_key_pair() {
  static_assert(std::tuple_size_v<CurveKey> == crypto_box_PUBLICKEYBYTES);
  static_assert(std::tuple_size_v<CurveKey> == crypto_box_SECRETKEYBYTES);
  KeyPair pair;
  crypto_box_keypair(pair.public_key.data(), pair.secret_key.bytes().data());
  return pair;
}

CurveKey public_key_of(const SecretKey& secret_key) {
  CurveKey public_key{};
  crypto_scalarmult_base(public_key.data(), secret_key.data());
  return public_key;
}

std::string z85(const CurveKey& key) {
  std::string text(kKeyCharacters + 1, '\0');
  zmq_z85_encode(text.data(), key.data(), key.size());
  text.pop_back();
  return text;
}

std::optional<CurveKey> parse_z85(std::string_view text) {
  CurveKey key{};
  return decode_z85(text, key) ? std::optional(key) : std::nullopt;
}

namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 20U;
constexpr mode_t kOwnersAlone = 0600;
using Fields = std::span<const std::string_view>;
constexpr std::array<std::string_view, 5> kFileFields{"role", "name", "public", "secret", "server"};
constexpr std::array<std::string_view, 4> kEntryFields{"name", "role", "public", "added_at"};
constexpr std::array<std::string_view, 1> kListFields{"key"};
constexpr std::string_view kNameRule =
    "has 1 to 64 letters, digits or . _ - @, and begins with a letter or digit";

/// Reads the fields of one table of a file. Errors never show a value, because it may be a secret.
class KeyFields {
 public:
  KeyFields(const TomlReader& file, const toml::table& table, Fields known)
      : file_(file), table_(table) {
    file.refuse_unknown(table, known, "", "allowed are " + joined(known));
  }

  [[noreturn]] void fail(std::string_view field, std::string_view rule) const {
    const toml::node* node = table_.get(field);
    file_.fail(node == nullptr ? table_ : *node, fmt::format("`{}` {}", field, rule));
  }
  std::string text(std::string_view field) const {
    const toml::node* node = table_.get(field);
    if (node == nullptr || !node->is_string()) {
      fail(field, node == nullptr ? "is missing" : "must be a text in quotes");
    }
    return *node->value<std::string>();
  }
  Role role() const {
    if (const auto role = role_named(text("role"))) {
      return *role;
    }
    fail("role", R"(must be "server", "client", "worker" or "reader")");
  }
  CurveKey key(std::string_view field) const {
    if (const auto key = parse_z85(text(field))) {
      return *key;
    }
    fail(field, "is not a key: a key has 40 characters, as written by `oblique keygen`");
  }
  std::string name() const {
    std::string name = text("name");
    if (!is_key_name(name)) {
      fail("name", kNameRule);
    }
    return name;
  }

 private:
  const TomlReader& file_;
  const toml::table& table_;
};

[[noreturn]] void fail_to(std::string_view what, const std::string& path) {
  throw std::runtime_error(fmt::format("{} {}: {}", what, path, std::strerror(errno)));
}

/// Returns the status of a file. If the file does not exist, all members are zero.
struct stat status_of(const std::string& path) {
  struct stat file {};
  static_cast<void>(::stat(path.c_str(), &file));
  return file;
}

bool exists(const std::string& path) {
  return std::filesystem::exists(std::filesystem::symlink_status(path));
}

/// Writes a new file of mode 0600, and syncs it and its folder. Deletes the file if that fails.
void write_new_file(const std::string& path, std::string_view text) {
  const Descriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnersAlone));
  if (!file.is_open()) {
    fail_to("cannot create", path);
  }
  const ssize_t written = ::write(file.number(), text.data(), text.size());
  if (written != static_cast<ssize_t>(text.size()) || ::fsync(file.number()) != 0) {
    ::unlink(path.c_str());
    fail_to("cannot write", path);
  }
  static_cast<void>(::fsync(open_folder_of(path).number()));
}

/// Throws if the mode of the file or folder contains any of the bits `refused`.
void refuse_mode(const std::string& path, mode_t refused, std::string_view risk,
                 std::string_view remedy) {
  if (const mode_t mode = status_of(path).st_mode; (mode & refused) != 0) {
    throw solver::InputError(fmt::format("{} has mode {:04o}: {}. To use it: chmod {} '{}'", path,
                                         mode & 07777U, risk, remedy, path));
  }
}

/// Returns the secret key and overwrites it with zeros in `text`: the TOML parser, which reads
/// `text` next, leaves copies of its input in memory. Returns nothing if no line begins with
/// `secret = "KEY"`.
std::optional<SecretKey> take_secret(std::string& text) {
  const std::size_t line = text.starts_with("secret") ? 0 : text.find("\nsecret");
  const std::size_t quote = text.find_first_of("\"'", line);
  SecretKey key;
  if (quote == std::string::npos ||
      !decode_z85(std::string_view(text).substr(quote + 1, kKeyCharacters), key.bytes())) {
    return std::nullopt;
  }
  text.replace(quote + 1, kKeyCharacters, kKeyCharacters, '0');
  return key;
}

std::string text_of(const AuthorizedKeys& keys) {
  std::string text =
      "# Keys that oblique-server admits. `oblique keys add` and `oblique keys revoke` write this\n"
      "# file and drop other comments. A running server applies each change within a second.\n";
  for (const AuthorizedKey& key : keys.all()) {
    text +=
        fmt::format("\n[[key]]\nname = \"{}\"\nrole = \"{}\"\npublic = \"{}\"\nadded_at = \"{}\"\n",
                    key.name, name_of(key.role), z85(key.public_key), key.added_at);
  }
  return text;
}

}  // namespace

KeyFile read_key_file(const std::string& path) {
  const struct stat about = status_of(path);
  const bool is_ours = about.st_uid == ::geteuid();
  if (S_ISREG(about.st_mode)) {
    refuse_mode(path, is_ours ? S_IRWXG | S_IRWXO : S_IRWXO,
                "others than its owner can read the secret key in it", is_ours ? "600" : "o=");
  }
  std::string text = read_small_file(path, "the key file", kMaxBytes);
  const std::optional<SecretKey> secret = take_secret(text);
  const TomlReader file(path);
  const toml::table top = file.parse(text);
  const KeyFields fields(file, top, kFileFields);
  KeyFile key;
  key.path = path;
  key.role = fields.role();
  key.name = fields.name();
  key.pair.public_key = fields.key("public");
  if (fields.key("secret") != CurveKey{} || !secret) {
    fields.fail("secret", "must begin its line, as secret = \"KEY\"");
  }
  key.pair.secret_key = *secret;
  if (public_key_of(*secret) != key.pair.public_key) {
    fields.fail("secret", "does not belong to `public`");
  }
  if (key.role != Role::kServer) {
    key.server = fields.key("server");
  }
  return key;
}

void write_key_file(const std::string& path, const KeyFile& key) {
  struct Wiped {
    std::string text = {};
    ~Wiped() { sodium_memzero(text.data(), text.size()); }
  };
  // Memory is reserved, because a growing string would leave copies of the secret key in memory.
  constexpr std::size_t kLongest = 1024;
  const Wiped secret{z85(key.pair.secret_key.bytes())};
  Wiped file;
  file.text.reserve(kLongest);
  file.text += fmt::format(
      "# A key of oblique: anyone who can read this file can act as its owner.\n"
      "role = \"{}\"\nname = \"{}\"\npublic = \"{}\"\nsecret = \"",
      name_of(key.role), key.name, z85(key.pair.public_key));
  (file.text += secret.text) += "\"\n";
  if (key.server) {
    file.text += fmt::format("server = \"{}\"  # public key\n", z85(*key.server));
  }
  write_new_file(path, file.text);
}

bool is_key_name(std::string_view name) {
  static const std::regex kName("[A-Za-z0-9][A-Za-z0-9._@-]{0,63}");
  return std::regex_match(name.begin(), name.end(), kName);
}

const AuthorizedKey* AuthorizedKeys::find(const CurveKey& public_key) const {
  const auto found = std::find_if(keys_.begin(), keys_.end(),
                                  [&](const auto& key) { return key.public_key == public_key; });
  return found == keys_.end() ? nullptr : &*found;
}

const AuthorizedKey* AuthorizedKeys::find(std::string_view name) const {
  const auto found =
      std::find_if(keys_.begin(), keys_.end(), [&](const auto& key) { return key.name == name; });
  return found == keys_.end() ? nullptr : &*found;
}

void AuthorizedKeys::add(AuthorizedKey key) {
  if (!is_key_name(key.name)) {
    throw solver::InputError(fmt::format("the name of a key {}", kNameRule));
  }
  if (find(key.name) != nullptr) {
    throw solver::InputError(fmt::format("the list already has a key called {}", key.name));
  }
  if (const auto* same = find(key.public_key)) {
    throw solver::InputError(fmt::format("the list already has the public key {}, called {}",
                                         z85(key.public_key), same->name));
  }
  keys_.push_back(std::move(key));
}

void AuthorizedKeys::remove(std::string_view name) {
  if (std::erase_if(keys_, [&](const AuthorizedKey& key) { return key.name == name; }) > 0) {
    return;
  }
  std::vector<std::string_view> names;
  for (const AuthorizedKey& key : keys_) {
    names.emplace_back(key.name);
  }
  throw solver::InputError(fmt::format("there is no key called {}{}; the list has: {}",
                                       excerpt(name), did_you_mean(name, names), joined(names)));
}

AuthorizedKeys read_authorized_keys(const std::string& path) {
  constexpr std::string_view kRisk = "every user could add a key";
  const std::string folder = std::filesystem::absolute(path).parent_path();
  refuse_mode(path, S_IWOTH, kRisk, "o-w");
  if ((status_of(folder).st_mode & S_ISVTX) == 0) {
    refuse_mode(folder, S_IWOTH, kRisk, "o-w");
  }
  const TomlReader file(path);
  const toml::table top = file.parse(read_small_file(path, "the list of keys", kMaxBytes));
  const KeyFields fields(file, top, kListFields);
  AuthorizedKeys keys;
  if (top.empty()) {
    return keys;
  }
  const toml::array* list = top["key"].as_array();
  if (list == nullptr || !list->is_homogeneous<toml::table>()) {
    fields.fail("key", "must be tables, as [[key]]");
  }
  for (const toml::node& node : *list) {
    const KeyFields entry(file, *node.as_table(), kEntryFields);
    AuthorizedKey key{entry.name(), entry.role(), entry.key("public"), entry.text("added_at")};
    if (key.role == Role::kServer) {
      entry.fail("role", R"(must be "client", "worker" or "reader")");
    }
    file.located(node, [&] { keys.add(std::move(key)); });
  }
  return keys;
}

void change_authorized_keys(const std::string& path,
                            const std::function<void(AuthorizedKeys&)>& change) {
  // If `path` is a symbolic link, replaces its target, to which other links may point.
  const std::string target = std::filesystem::weakly_canonical(path);
  const Descriptor folder = open_folder_of(target);
  if (::flock(folder.number(), LOCK_EX) != 0) {
    fail_to("cannot lock the folder of", path);
  }
  const struct stat before = status_of(target);
  AuthorizedKeys keys = exists(target) ? read_authorized_keys(path) : AuthorizedKeys();
  change(keys);
  const std::string draft = target + ".new";
  ::unlink(draft.c_str());  // a killed process may have left this file
  write_new_file(draft, text_of(keys));
  // Keeps owner and mode, because a server of another user must still be able to read the file.
  const bool has_owner_and_mode =
      before.st_mode == 0 || (::chown(draft.c_str(), before.st_uid, before.st_gid) == 0 &&
                              ::chmod(draft.c_str(), before.st_mode & 07777U) == 0);
  if (!has_owner_and_mode || ::rename(draft.c_str(), target.c_str()) != 0) {
    fail_to("cannot replace", path);
  }
  static_cast<void>(::fsync(folder.number()));
}

std::string key_file_in(const std::string& folder, const std::string& name) {
  return (std::filesystem::path(folder) / (name + ".key")).string();
}

std::string authorized_keys_in(const std::string& folder) {
  return (std::filesystem::path(folder) / "authorized_keys.toml").string();
}

std::string find_key_folder(const std::string& named) {
  const auto has_keys = [](const std::string& folder) {
    return exists(key_file_in(folder, "server"));
  };
  const std::string found = !has_keys(".") && has_keys("keys") ? "keys" : ".";
  const std::string& folder = named.empty() ? found : named;
  if (!has_keys(folder)) {
    throw solver::InputError(
        fmt::format("there is no {}: give the folder of the server's keys with --dir DIR",
                    key_file_in(folder, "server")));
  }
  return folder;
}

CurveKey make_key_folder(const std::string& folder) {
  constexpr mode_t kFolderMode = 0700;
  if (::mkdir(folder.c_str(), kFolderMode) != 0 && errno != EEXIST) {
    fail_to("cannot create the folder", folder);
  }
  std::vector<std::string> paths{authorized_keys_in(folder)};
  for (const std::string_view role : kRoles) {
    paths.push_back(key_file_in(folder, std::string(role)));
  }
  for (const std::string& path : paths) {
    if (exists(path)) {
      throw std::runtime_error(path + " exists, and is never overwritten");
    }
  }
  const KeyPair server = generate_key_pair();
  write_key_file(key_file_in(folder, "server"), {Role::kServer, "server", server});
  for (const Role role : {Role::kClient, Role::kWorker, Role::kReader}) {
    add_key(folder, std::string(name_of(role)), role, std::nullopt);
  }
  return server.public_key;
}

AuthorizedKey add_key(const std::string& folder, const std::string& name, Role role,
                      const std::optional<CurveKey>& public_key) {
  const KeyFile server = read_key_file(key_file_in(folder, "server"));
  const KeyPair pair = public_key ? KeyPair{*public_key, {}} : generate_key_pair();
  AuthorizedKey added{name, role, pair.public_key,
                      fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))};
  const std::string file = key_file_in(folder, name);
  bool is_written = false;
  try {
    change_authorized_keys(authorized_keys_in(folder), [&](AuthorizedKeys& keys) {
      keys.add(added);
      if (!public_key) {
        write_key_file(file, {role, name, pair, server.pair.public_key});
        is_written = true;
      }
    });
  } catch (...) {
    if (is_written) {  // a key that is not on the list would only be in the way of the next attempt
      ::unlink(file.c_str());
    }
    throw;
  }
  return added;
}

}  // namespace oblique::protocol
