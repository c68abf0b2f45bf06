#include "proto/keys/key_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
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
#include "proto/system/descriptor.h"
#include "proto/text.h"
#include "proto/toml_reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {

namespace {

constexpr std::string_view kDigits =
    "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#";
constexpr std::size_t kBytesOfGroup = 4;
constexpr std::size_t kDigitsOfGroup = 5;

/// False unless `text` stands for a key.
bool decode_z85(std::string_view text, SecretKey::Bytes key) {
  if (text.size() != kKeyCharacters) {
    return false;
  }
  for (std::size_t group = 0; group < text.size() / kDigitsOfGroup; ++group) {
    std::uint64_t number = 0;
    for (const char digit : text.substr(group * kDigitsOfGroup, kDigitsOfGroup)) {
      const std::size_t value = kDigits.find(digit);
      if (value == std::string_view::npos) {
        return false;
      }
      number = number * kDigits.size() + value;
    }
    if (number > std::numeric_limits<std::uint32_t>::max()) {
      return false;
    }
    for (std::size_t i = kBytesOfGroup; i > 0; --i) {
      key[group * kBytesOfGroup + i - 1] = static_cast<std::uint8_t>(number & 0xffU);
      number >>= 8U;
    }
  }
  return true;
}

/// In the order of `Role`.
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
  if (sodium_init() < 0) {
    throw std::runtime_error("no keys can be used: the system gives no random numbers");
  }
  bytes_.reset(static_cast<std::uint8_t*>(sodium_malloc(Bytes::extent)), sodium_free);
  if (!bytes_) {
    throw std::bad_alloc();
  }
  std::fill_n(bytes_.get(), Bytes::extent, std::uint8_t{0});
}

bool SecretKey::operator==(const SecretKey& other) const {
  return sodium_memcmp(data(), other.data(), Bytes::extent) == 0;
}

KeyPair made_key_pair() {
  static_assert(std::tuple_size_v<CurveKey> == crypto_box_PUBLICKEYBYTES);
  static_assert(std::tuple_size_v<CurveKey> == crypto_box_SECRETKEYBYTES);
  KeyPair pair;
  crypto_box_keypair(pair.public_key.data(), pair.secret_key.bytes().data());
  return pair;
}

CurveKey public_half_of(const SecretKey& secret_key) {
  CurveKey public_key{};
  crypto_scalarmult_base(public_key.data(), secret_key.data());
  return public_key;
}

// Four bytes are one number, the first byte its highest, and so are five digits.
std::string z85(SecretKey::ConstBytes key) {
  std::string text;
  text.reserve(kKeyCharacters);  // growing would leave parts of a secret key behind
  for (std::size_t at = 0; at < key.size(); at += kBytesOfGroup) {
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < kBytesOfGroup; ++i) {
      number = number << 8U | key[at + i];
    }
    std::string group(kDigitsOfGroup, '0');
    for (std::size_t i = kDigitsOfGroup; i > 0; --i) {
      group[i - 1] = kDigits[number % kDigits.size()];
      number /= static_cast<std::uint32_t>(kDigits.size());
    }
    text += group;
  }
  return text;
}

std::optional<CurveKey> key_of_z85(std::string_view text) {
  CurveKey key{};
  return decode_z85(text, key) ? std::optional(key) : std::nullopt;
}

std::optional<SecretKey> secret_key_of_z85(std::string_view text) {
  SecretKey key;
  return decode_z85(text, key.bytes()) ? std::optional(key) : std::nullopt;
}

namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
constexpr mode_t kOwnersAlone = 0600;
using Fields = std::span<const std::string_view>;
constexpr std::array<std::string_view, 5> kFileFields{"role", "name", "public", "secret", "server"};
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
    require("role", role.has_value(),
            "`role` must be \"server\", \"client\", \"worker\" or \"reader\"");
    return *role;
  }
  CurveKey key(std::string_view field) const {
    const auto key = key_of_z85(text(field));
    require(field, key.has_value(),
            fmt::format("`{}` is no key: one has {} characters, as `oblique keygen` writes them",
                        field, kKeyCharacters));
    return *key;
  }
  std::string name() const {
    std::string name = text("name");
    const std::string objection = objection_to_key_name(name);
    require("name", objection.empty(), "`name`: " + objection);
    return name;
  }
  void refuse_unknown(Fields known, std::string_view what) const {
    file_.refuse_unknown(table_, known, "", fmt::format("{} has {}", what, joined(known)));
  }
  /// Throws an error about a field that exists, unless `is_met`.
  void require(std::string_view field, bool is_met, const std::string& message) const {
    if (!is_met) {
      file_.fail(*table_.get(field), message);
    }
  }

 private:
  const TomlReader& file_;
  const toml::table& table_;
};

[[noreturn]] void fail_to(std::string_view what, const std::string& path) {
  throw std::runtime_error(fmt::format("{} {}: {}", what, path, std::strerror(errno)));
}

/// What the system knows about a file; all zero where there is none.
struct stat status_of(const std::string& path) {
  struct stat file {};
  static_cast<void>(::stat(path.c_str(), &file));
  return file;
}

std::string folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

/// Flushes the names in a file's folder to the disk. Not every file system does that.
void flush_folder_of(const std::string& path) {
  const Descriptor opened(::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  static_cast<void>(::fsync(opened.number()));
}

/// Writes a new file with `text` and flushes it to the disk with its name; removes it if that
/// fails. It gets owner and mode of the file `like`, if that exists.
void write_new_file(const std::string& path, std::string_view text, const std::string& like = "") {
  const Descriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kOwnersAlone));
  if (!file.is_open() && errno == EEXIST) {
    throw std::runtime_error(path + " is there already, and is never overwritten");
  }
  if (!file.is_open()) {
    fail_to("cannot make", path);
  }
  try {
    const struct stat other = status_of(like);
    if (other.st_mode != 0 && (::fchown(file.number(), other.st_uid, other.st_gid) != 0 ||
                               ::fchmod(file.number(), other.st_mode & 07777U) != 0)) {
      fail_to("cannot keep owner and mode of", like);
    }
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
  } catch (const std::runtime_error&) {
    ::unlink(path.c_str());
    throw;
  }
  flush_folder_of(path);
}

/// Locks the folder of a list against other processes that change the list.
Descriptor locked_folder_of(const std::string& path) {
  Descriptor folder(::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder.is_open()) {
    fail_to("cannot open the folder", folder_of(path));
  }
  while (::flock(folder.number(), LOCK_EX) != 0) {
    if (errno != EINTR) {
      fail_to("cannot lock the folder of", path);
    }
  }
  return folder;
}

/// Refuses a file or folder that has one of the mode bits `refused`. Reading reports why a file
/// cannot be read.
void refuse_mode(std::string_view what, const std::string& path, mode_t refused,
                 std::string_view risk, std::string_view remedy) {
  if (const mode_t mode = status_of(path).st_mode; (mode & refused) != 0) {
    throw solver::InputError(
        fmt::format("{} {} has mode {:04o}: {}, so it is not used. Mend it with: chmod {} '{}'",
                    what, path, mode & 07777U, risk, remedy, path));
  }
}

/// A reader of a secret key can pass for its owner.
void check_readers(const std::string& path) {
  const struct stat file = status_of(path);
  const bool is_ours = file.st_uid == ::geteuid();
  if (S_ISREG(file.st_mode)) {
    refuse_mode("the key file", path, is_ours ? S_IRWXG | S_IRWXO : S_IRWXO,
                "others than its owner can use the secret key in it", is_ours ? "600" : "o=");
  }
}

/// Anyone who can write or replace the list can add a key.
void check_writers(const std::string& path) {
  constexpr std::string_view kRisk = "everybody could add a key";
  refuse_mode("the list of keys", path, S_IWOTH, kRisk, "o-w");
  const std::string folder = folder_of(path);
  if ((status_of(folder).st_mode & S_ISVTX) == 0) {
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
  fields.require("role", key.role != Role::kServer,
                 "`role` must be \"client\", \"worker\" or \"reader\": a server is no peer");
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

bool exists(const std::string& path) {
  return std::filesystem::exists(std::filesystem::symlink_status(path));
}

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
  fields.refuse_unknown(Fields(kFileFields).first(is_server ? 4 : 5),
                        is_server ? "the server's key file" : "a key file");
  key.name = fields.name();
  key.pair.public_key = fields.key("public");
  fields.require("secret", fields.key("secret") == CurveKey{} && secret,
                 "`secret` must begin its line, as secret = \"KEY\"");
  key.pair.secret_key = *secret;
  fields.require("secret", public_half_of(key.pair.secret_key) == key.pair.public_key,
                 "`secret` is not the other half of `public`");
  if (!is_server) {
    key.server = fields.key("server");
  }
  return key;
}

void write_key_file(const std::string& path, const KeyFile& key) {
  constexpr std::size_t kLongest = 1024;  // growing would leave parts of the secret key behind
  std::string secret = z85(key.pair.secret_key.bytes());
  std::string text;
  text.reserve(kLongest);
  fmt::format_to(std::back_inserter(text),
                 "# A key of oblique: whoever can read this file can pass for its owner.\n"
                 "role = \"{}\"\nname = \"{}\"\npublic = \"{}\"\nsecret = \"",
                 name_of(key.role), key.name, z85(key.pair.public_key));
  (text += secret) += "\"\n";
  if (key.server) {
    text += fmt::format("server = \"{}\"  # public key\n", z85(*key.server));
  }
  const auto wiped = [](std::string* bytes) { sodium_memzero(bytes->data(), bytes->size()); };
  const std::unique_ptr<std::string, decltype(wiped)> wipes_secret(&secret, wiped);
  const std::unique_ptr<std::string, decltype(wiped)> wipes_text(&text, wiped);
  write_new_file(path, text);
}

std::string objection_to_key_name(std::string_view name) {
  constexpr std::size_t kLongest = 64;
  constexpr std::string_view kAllowed =
      "._-@0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
  const bool is_allowed = !name.empty() && name.size() <= kLongest &&
                          name.find_first_not_of(kAllowed) == std::string_view::npos &&
                          kAllowed.find(name.front()) >= std::string_view("._-@").size();
  return is_allowed
             ? ""
             : "the name of a key has 1 to 64 letters, digits or . _ - @, and begins with a letter "
               "or digit";
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
  throw solver::InputError(fmt::format("there is no key called {}{}; there {}", excerpt(name),
                                       did_you_mean(name, names),
                                       names.empty() ? "is none" : "are: " + joined(names)));
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
  const Descriptor lock = locked_folder_of(target);
  AuthorizedKeys keys = exists(target) ? read_authorized_keys(path) : AuthorizedKeys();
  change(keys);
  const std::string text = text_of(keys);
  if (text.size() > kMostBytes) {
    throw solver::InputError(
        fmt::format("the list of keys {} would have {} bytes, and one of more than {} is not read: "
                    "revoke keys that nobody uses",
                    path, text.size(), kMostBytes));
  }
  const std::string draft = target + ".new";
  ::unlink(draft.c_str());  // left by a process that was killed
  write_new_file(draft, text, target);
  if (::rename(draft.c_str(), target.c_str()) != 0) {
    ::unlink(draft.c_str());
    fail_to("cannot replace", path);
  }
  flush_folder_of(target);
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
  const auto has_keys = [](const std::string& folder) {
    return exists(authorized_keys_in(folder)) || exists(key_file_in(folder, "server"));
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
  constexpr mode_t kFolderMode = 0700;
  std::vector<std::string> made;
  if (::mkdir(folder.c_str(), kFolderMode) == 0) {
    made.push_back(folder);
  } else if (errno != EEXIST) {
    fail_to("cannot make the folder", folder);
  }
  const std::string list = authorized_keys_in(folder);
  if (exists(list)) {
    throw std::runtime_error(list + " is there already, and is never overwritten");
  }
  const KeyPair server = made_key_pair();
  try {
    write_key_file(key_file_in(folder, "server"), {Role::kServer, "server", server});
    made.insert(made.end(), {key_file_in(folder, "server"), list});
    for (const Role role : {Role::kClient, Role::kWorker, Role::kReader}) {
      const std::string name(name_of(role));
      add_key(folder, name, role, std::nullopt);
      made.push_back(key_file_in(folder, name));
    }
  } catch (const std::exception&) {
    for (auto path = made.rbegin(); path != made.rend(); ++path) {
      ::remove(path->c_str());
    }
    throw;
  }
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
  const std::string file = key_file_in(folder, name);
  bool has_file = false;
  try {
    change_authorized_keys(authorized_keys_in(folder), [&](AuthorizedKeys& keys) {
      keys.add(added);
      if (!public_key) {
        write_key_file(file, {role, name, pair, server.pair.public_key});
        has_file = true;
      }
    });
  } catch (...) {
    if (has_file) {
      ::unlink(file.c_str());
    }
    throw;
  }
  return added;
}

}  // namespace oblique::protocol
