#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>

#include "server/network/zmtp.h"
#include "tests/server/network/curve_client.h"

namespace oblique::server {

/// A port with keys, and the key of a peer that the port admits.
struct KeyedPort {
  protocol::KeyPair server = protocol::generate_key_pair();
  protocol::KeyPair own = protocol::generate_key_pair();
  ListAuthenticator authenticator;
  PortSecurity security{server, authenticator};
  KeyedPort() { authenticator.add(own.public_key, "fuzz"); }
};

inline std::string send(Zmtp& zmtp, std::string_view bytes) {
  constexpr std::size_t kMuch = std::size_t{1} << 20U;
  zmtp.receive(bytes);
  while (zmtp.has_message() || zmtp.pending_step() != Zmtp::PendingStep::kNone) {
    zmtp.run_step();
    if (zmtp.has_message()) {
      static_cast<void>(zmtp.take_message());
    }
  }
  if (zmtp.held_bytes() > kMuch) {
    std::abort();  // the port must not store more than it received
  }
  return zmtp.take_answers();
}

/// Returns the next piece of the input. The first byte of a piece is its length.
inline std::string_view next_piece(std::string_view& input) {
  const std::size_t length =
      std::min<std::size_t>(static_cast<unsigned char>(input.front()), input.size() - 1);
  const std::string_view piece = input.substr(1, length);
  input.remove_prefix(1 + length);
  return piece;
}

inline void be_welcomed(Zmtp& zmtp, CurveClient& client) {
  static_cast<void>(zmtp.take_answers());
  const std::string welcome = send(zmtp, curve_greeting() + command_frame("HELLO", client.hello()));
  if (!client.take_welcome(std::string_view(welcome).substr(10))) {
    std::abort();
  }
}

}  // namespace oblique::server
