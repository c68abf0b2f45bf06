#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "tests/fuzz/zmtp_port.h"

namespace oblique::server {
namespace {

void send_pieces(Zmtp& zmtp, std::string_view input) {
  while (!input.empty() && zmtp.fault().empty()) {
    static_cast<void>(send(zmtp, next_piece(input)));
  }
}

/// Changes bytes of a valid INITIATE as the input describes. Checks that the port does not admit
/// the peer if any byte differs.
void change_initiate(Zmtp& zmtp, CurveClient& client, std::string_view input) {
  be_welcomed(zmtp, client);
  const std::string sound = client.initiate();
  std::string data = sound;
  for (; input.size() >= 3; input.remove_prefix(3)) {
    const std::size_t at = static_cast<std::size_t>(number_of(input.substr(0, 2))) % data.size();
    data[at] = static_cast<char>(data[at] ^ input[2]);
  }
  static_cast<void>(send(zmtp, command_frame("INITIATE", data)));
  if (zmtp.is_open() != (data == sound)) {
    std::abort();
  }
}

/// Uses the input as the properties in a valid INITIATE.
void send_properties(Zmtp& zmtp, CurveClient& client, std::string_view input) {
  constexpr std::size_t kMax = 3500;
  be_welcomed(zmtp, client);
  client.properties = input.substr(0, kMax);
  static_cast<void>(send(zmtp, command_frame("INITIATE", client.initiate())));
}

}  // namespace
}  // namespace oblique::server

/// The input is what a peer sends on one connection. The first byte of the input selects a port
/// with or without keys, and the part of the handshake that is valid.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace oblique::server;
  static const KeyedPort port;
  std::string_view input(reinterpret_cast<const char*>(data), size);
  if (input.empty()) {
    return 0;
  }
  const unsigned way = static_cast<unsigned char>(input.front()) % 4U;
  input.remove_prefix(1);
  Zmtp zmtp(way == 0 ? nullptr : &port.security);
  CurveClient client(port.own, port.server.public_key);
  switch (way) {
    case 2:
      change_initiate(zmtp, client, input);
      break;
    case 3:
      send_properties(zmtp, client, input);
      break;
    default:
      send_pieces(zmtp, input);
  }
  return 0;
}
