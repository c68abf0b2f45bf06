#include "proto/keys/key_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>

#include <sys/stat.h>
#include <unistd.h>

#include <sodium.h>

#include <spdlog/fmt/fmt.h>

#include "proto/keys/toml_fields.h"
#include "proto/keys/written_file.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

constexpr std::array<std::string_view, 4> kServersFields{"role", "name", "public", "secret"};
constexpr std::array<std::string_view, 5> kPeersFields{"role", "name", "public", "secret",
                                                       "server"};

/// Who can read a secret key is who it names.
void check_mode(const std::string& path) {
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0) {
    throw solver::InputError(
        fmt::format("the key file {} cannot be read: {}", path, std::strerror(errno)));
  }
  const bool is_ours = file.st_uid == ::geteuid();
  const mode_t refused = is_ours ? S_IRWXG | S_IRWXO : S_IRWXO;
  if (S_ISREG(file.st_mode) && (file.st_mode & refused) != 0) {
    throw solver::InputError(
        fmt::format("the key file {} has mode {:04o}: others than its owner can use the secret "
                    "key in it, so it is not used. Mend it with: chmod {} '{}'",
                    path, file.st_mode & 07777U, is_ours ? "600" : "o=", path));
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

}  // namespace

KeyFile read_key_file(const std::string& path) {
  check_mode(path);
  std::optional<SecretKey> secret;
  const TomlFile file(path, "the key file",
                      [&secret](std::string& text) { secret = take_secret(text); });
  const TomlFields fields(path, file.top());
  KeyFile key;
  key.path = path;
  key.role = fields.role("role");
  const bool is_server = key.role == Role::kServer;
  fields.refuse_unknown(is_server ? std::span<const std::string_view>(kServersFields)
                                  : std::span<const std::string_view>(kPeersFields),
                        is_server ? "the server's key file" : "a key file");
  key.name = fields.key_name("name");
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
    write_new_file(path, text);
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

}  // namespace oblique::protocol
