#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "proto/keys/curve_key.h"
#include "proto/keys/role.h"

namespace oblique::protocol {

/// A key that the server admits.
struct AuthorizedKey {
  std::string name;
  Role role = Role::kClient;  ///< never the server's
  CurveKey public_key{};
  std::string added_at;  ///< UTC, ISO 8601
};

/// The keys that a server admits, each once, by name and by key.
class AuthorizedKeys {
 public:
  /// Null for one that is not admitted.
  const AuthorizedKey* find(const CurveKey& public_key) const;
  const AuthorizedKey* find(std::string_view name) const;
  /// In the order of the file.
  const std::vector<AuthorizedKey>& all() const { return keys_; }

  /// Throws solver::InputError when the name or the key is there already, naming which, or when the
  /// name is none that a key can have.
  void add(AuthorizedKey key);
  /// Throws solver::InputError, naming those that there are, for a name that is not there.
  AuthorizedKey remove(std::string_view name);

 private:
  std::vector<AuthorizedKey> keys_;
  std::map<CurveKey, std::size_t> places_;
  std::map<std::string, std::size_t, std::less<>> places_by_name_;
};

/// The list beside a server's key file: DIR/authorized_keys.toml.
std::string authorized_keys_beside(const std::string& server_key_file);

/// Reads a list (TOML, README.md); an empty file is an empty list. Throws solver::InputError, with
/// file, line and key, when it is not one from beginning to end, or when everybody may write it.
AuthorizedKeys read_authorized_keys(const std::string& path);

/// Reads the list, lets it be changed and replaces the file at once, while no other process does
/// the same. Makes the file where there is none. Throws as `read_authorized_keys` and `change`, and
/// std::runtime_error when it cannot be written; then nothing has changed.
void change_authorized_keys(const std::string& path,
                            const std::function<void(AuthorizedKeys&)>& change);

/// Now, as `added_at` has it.
std::string utc_now();

}  // namespace oblique::protocol
