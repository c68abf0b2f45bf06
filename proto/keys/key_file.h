#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// Key files (TOML; README.md describes them). Errors are solver::InputError with file, line and
// key. They never contain a secret.
namespace oblique::protocol {

/// One half of a CURVE key pair (Curve25519): 32 bytes.
using CurveKey = std::array<std::uint8_t, 32>;

/// Number of characters of a key in files and in ZeroMQ's options (Z85, rfc.zeromq.org 32).
inline constexpr std::size_t kKeyCharacters = 40;

/// A secret key in memory that is locked (within RLIMIT_MEMLOCK), excluded from core dumps, and
/// wiped by the destructor. Copies share the memory.
class SecretKey {
 public:
  /// Creates a key of zeros. Throws std::runtime_error if the system refuses such memory.
  SecretKey();

  const CurveKey& bytes() const { return *bytes_; }
  CurveKey& bytes() { return *bytes_; }
  const std::uint8_t* data() const { return bytes_->data(); }

 private:
  std::shared_ptr<CurveKey> bytes_;
};

enum class Role {
  kServer,
  kClient,  ///< may read and change everything at the clients' port
  kWorker,  ///< may solve points at the workers' port
  kReader,  ///< may only read at the clients' port
};

/// Returns "server", "client", "worker" or "reader".
std::string_view name_of(Role role);
std::optional<Role> role_named(std::string_view name);

struct KeyPair {
  CurveKey public_key{};
  SecretKey secret_key{};
};

KeyPair generate_key_pair();
CurveKey public_key_of(const SecretKey& secret_key);

/// Formats a key as 40 printable characters without quotes, backslashes or spaces.
std::string z85(const CurveKey& key);
/// Returns the key that `text` encodes (see z85), or nothing if `text` is not a key.
std::optional<CurveKey> parse_z85(std::string_view text);

/// The content of a program's key file.
struct KeyFile {
  Role role = Role::kClient;
  std::string name;  ///< name of the key, for people
  KeyPair pair;
  /// public key of the server; absent in the server's own file
  std::optional<CurveKey> server = {};
  std::string path = {};  ///< path of the file that was read
};

/// Throws solver::InputError if the file is incomplete, or if other users can read it (README.md).
KeyFile read_key_file(const std::string& path);

/// Writes a new file of mode 0600 and syncs it. Throws std::runtime_error, also if the file exists.
void write_key_file(const std::string& path, const KeyFile& key);

/// Returns whether a key and its file may have this name.
bool is_key_name(std::string_view name);

/// A key that the server admits.
struct AuthorizedKey {
  std::string name;
  Role role = Role::kClient;  ///< any role except that of a server
  CurveKey public_key{};
  std::string added_at;  ///< time in UTC, ISO 8601
};

/// The list of keys that a server admits. Names and keys are unique.
class AuthorizedKeys {
 public:
  /// Returns null if the key is not in the list.
  const AuthorizedKey* find(const CurveKey& public_key) const;
  const AuthorizedKey* find(std::string_view name) const;
  /// Returns the keys in the order of the file.
  const std::vector<AuthorizedKey>& all() const { return keys_; }

  /// Throws solver::InputError if the list has the name or key already, or the name is not allowed.
  void add(AuthorizedKey key);
  /// Throws solver::InputError for an unknown name.
  void remove(std::string_view name);

 private:
  std::vector<AuthorizedKey> keys_;
};

/// Reads the list. An empty file is an empty list. Throws solver::InputError if the file has a
/// fault, or if every user may write it.
AuthorizedKeys read_authorized_keys(const std::string& path);

/// Reads the list, calls `change` and atomically replaces the file. Holds a lock meanwhile. Creates
/// a missing file. Throws the errors of `read_authorized_keys` and `change`, and std::runtime_error
/// if the file cannot be written. After an error the file is unchanged.
void change_authorized_keys(const std::string& path,
                            const std::function<void(AuthorizedKeys&)>& change);

// Return paths of files in a server's key folder.
std::string key_file_in(const std::string& folder, const std::string& name);
std::string authorized_keys_in(const std::string& folder);

/// Returns `named`. If it is empty, returns the current folder, or its subfolder `keys` if only the
/// subfolder has a server key. Throws solver::InputError if the folder has no server key.
std::string find_key_folder(const std::string& named);

/// Creates server.key, client.key, worker.key, reader.key, and the list with the last three keys.
/// Creates a missing folder with mode 0700. Returns the server's public key. Throws
/// std::runtime_error if a file cannot be created, and, before it creates any, if one of them
/// exists.
CurveKey make_key_folder(const std::string& folder);

/// Adds `public_key` to the list. Without `public_key`, creates a key pair, writes it to NAME.key
/// and adds its public key. Throws solver::InputError if the list has the name or key already, or
/// if the server's key cannot be read. Throws std::runtime_error if a file exists or cannot be
/// written. After an error the list is unchanged.
AuthorizedKey add_key(const std::string& folder, const std::string& name, Role role,
                      const std::optional<CurveKey>& public_key);

}  // namespace oblique::protocol
