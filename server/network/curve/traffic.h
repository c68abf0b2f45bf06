#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/network/curve/secret.h"

namespace oblique::server {

/// A frame as it was before it was sealed.
struct OpenedFrame {
  bool more;
  bool is_command;
  std::string body;
};

/// What is said once a handshake is done: frames, each sealed as one MESSAGE. Numbers of either
/// side only grow, so that nothing is heard twice or in another order.
class CurveTraffic {
 public:
  /// Bytes that MESSAGE adds to a frame's body: its name, number, MAC and flags.
  static constexpr std::size_t kAddedBytes = 33;

  CurveTraffic(const Secret& shared_key, std::uint64_t heard_nonce)
      : key_(shared_key), heard_nonce_(heard_nonce) {}

  /// READY less its name, with these properties. First and once.
  std::string ready(std::string_view properties);
  /// Appends MESSAGE, whole, to `out`.
  void seal(std::string_view body, bool is_command, std::string& out);
  /// Takes MESSAGE, whole. Nothing when it is not from this peer, or not new, or says what no
  /// frame can be.
  std::optional<OpenedFrame> open(std::string_view message);

 private:
  Secret key_;
  std::uint64_t heard_nonce_;
  std::uint64_t sent_nonce_ = 0;
};

}  // namespace oblique::server
