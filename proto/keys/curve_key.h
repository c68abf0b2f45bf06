#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace oblique::protocol {

/// One half of a CURVE key pair (Curve25519): 32 bytes.
using CurveKey = std::array<std::uint8_t, 32>;

/// Characters of a key in files and in ZeroMQ's options (Z85, rfc.zeromq.org 32).
inline constexpr std::size_t kKeyCharacters = 40;

/// A secret key. Its bytes are in memory that is locked where the system permits (RLIMIT_MEMLOCK),
/// is no part of a core dump and is wiped at the end. Copies share that memory.
class SecretKey {
 public:
  using Bytes = std::span<std::uint8_t, std::tuple_size_v<CurveKey>>;
  using ConstBytes = std::span<const std::uint8_t, Bytes::extent>;

  /// All zero. Throws std::runtime_error when the system gives no random numbers, else
  /// std::bad_alloc.
  SecretKey();

  const std::uint8_t* data() const { return bytes_.get(); }
  ConstBytes bytes() const { return ConstBytes(bytes_.get(), Bytes::extent); }
  /// To fill in a new key, before it is copied.
  Bytes bytes() { return Bytes(bytes_.get(), Bytes::extent); }
  bool operator==(const SecretKey& other) const;

 private:
  std::shared_ptr<std::uint8_t> bytes_;
};

/// What the holder of a key is to the server.
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

/// A new random pair. Throws std::runtime_error when the system gives no random numbers.
KeyPair made_key_pair();

/// The public half that belongs to a secret one.
CurveKey public_half_of(const SecretKey& secret_key);

/// A key as 40 printable characters, none of which is a quote, a backslash or a space.
std::string z85(SecretKey::ConstBytes key);

/// None unless `text` is 40 characters that stand for 32 bytes.
std::optional<CurveKey> key_of_z85(std::string_view text);
std::optional<SecretKey> secret_key_of_z85(std::string_view text);

}  // namespace oblique::protocol
