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

// Files with keys (TOML, README.md). Errors in a file are solver::InputError with file, line and
// key, and never show a secret.
namespace oblique::protocol {

/// One half of a CURVE key pair (Curve25519): 32 bytes.
using CurveKey = std::array<std::uint8_t, 32>;

/// Characters of a key in files and in ZeroMQ's options (Z85, rfc.zeromq.org 32).
inline constexpr std::size_t kKeyCharacters = 40;

/// A secret key in memory that is locked (within RLIMIT_MEMLOCK), left out of core dumps and wiped
/// at the end. Copies share that memory.
class SecretKey {
 public:
  /// All zero. Throws std::runtime_error when the system gives no such memory.
  SecretKey();

  const CurveKey& bytes() const { return *bytes_; }
  CurveKey& bytes() { return *bytes_; }
  const std::uint8_t* data() const { return bytes_->data(); }

 private:
  std::shared_ptr<CurveKey> bytes_;
};

enum class Role {
  kServer,
  kClient,  ///< may read and change everything at the port for clients
  kWorker,  ///< may solve at the port for workers
  kReader,  ///< may read at the port for clients, and change nothing
};

/// "server", "client", "worker" or "reader".
std::string_view name_of(Role role);
std::optional<Role> role_named(std::string_view name);

struct KeyPair {
  CurveKey public_key{};
  SecretKey secret_key{};
};

/// A new random pair.
KeyPair generate_key_pair();
CurveKey public_key_of(const SecretKey& secret_key);

/// A key as 40 printable characters, none of which is a quote, a backslash or a space.
std::string z85(const CurveKey& key);
/// None for a text that is no key.
std::optional<CurveKey> parse_z85(std::string_view text);

/// The content of the key file of a program.
struct KeyFile {
  Role role = Role::kClient;
  std::string name;  ///< of the key, for people
  KeyPair pair;
  std::optional<CurveKey> server = {};  ///< the server's public key; every role but the server's
  std::string path = {};                ///< of the file that it was read from
};

/// Throws solver::InputError unless the file is complete and private (README.md).
KeyFile read_key_file(const std::string& path);

/// Writes a new file of mode 0600 and flushes it to the disk. Throws std::runtime_error, also when
/// the file exists: it is never overwritten.
void write_key_file(const std::string& path, const KeyFile& key);

/// Whether a key, and its file, can have this name.
bool is_key_name(std::string_view name);

/// A key that the server admits.
struct AuthorizedKey {
  std::string name;
  Role role = Role::kClient;  ///< never the server's
  CurveKey public_key{};
  std::string added_at;  ///< UTC, ISO 8601
};

/// The keys that a server admits. Names and keys are unique.
class AuthorizedKeys {
 public:
  /// Null for a key that is not admitted.
  const AuthorizedKey* find(const CurveKey& public_key) const;
  const AuthorizedKey* find(std::string_view name) const;
  /// In the order of the file.
  const std::vector<AuthorizedKey>& all() const { return keys_; }

  /// Throws solver::InputError when the name or the key exists or the name is not allowed.
  void add(AuthorizedKey key);
  /// Throws solver::InputError for an unknown name.
  void remove(std::string_view name);

 private:
  std::vector<AuthorizedKey> keys_;
};

/// Reads a list; an empty file is an empty list. Throws solver::InputError when any part of it is
/// wrong, or when everybody may write it.
AuthorizedKeys read_authorized_keys(const std::string& path);

/// Reads the list, calls `change` and replaces the file in one step, while no other process does
/// the same. Creates a missing file. Throws as `read_authorized_keys` and `change`, and
/// std::runtime_error when it cannot be written; then nothing has changed.
void change_authorized_keys(const std::string& path,
                            const std::function<void(AuthorizedKeys&)>& change);

// Paths of the files in a folder with the keys of a server.
std::string key_file_in(const std::string& folder, const std::string& name);
std::string authorized_keys_in(const std::string& folder);

/// `named` or, if that is empty, the current folder or the `keys` in it. Throws solver::InputError
/// for a folder without a server's key.
std::string find_key_folder(const std::string& named);

/// Makes server.key, client.key, worker.key, reader.key and the list with the last three, and a
/// missing folder with mode 0700. Returns the server's public key. Throws std::runtime_error when
/// one of them exists, before it makes any, or cannot be made.
CurveKey make_key_folder(const std::string& folder);

/// Lists `public_key`, or the key of a new pair, which is written to NAME.key first. Throws
/// solver::InputError when name or key are listed already or the server's key cannot be read, and
/// std::runtime_error when a file cannot be written or exists; then nothing is listed.
AuthorizedKey add_key(const std::string& folder, const std::string& name, Role role,
                      const std::optional<CurveKey>& public_key);

}  // namespace oblique::protocol
