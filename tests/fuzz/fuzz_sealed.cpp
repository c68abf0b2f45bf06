#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "tests/fuzz/zmtp_port.h"

namespace oblique::server {
namespace {

void require(bool is_so) {
  if (!is_so) {
    std::abort();
  }
}

/// Sends one MESSAGE. The first byte of `piece` contains its flags, the other bytes its body. If
/// the highest bit of the flags is set, the encrypted box is changed in transit. The port must
/// accept only an unchanged MESSAGE without flags.
void send_frame(Zmtp& zmtp, CurveClient& client, std::string_view piece) {
  constexpr unsigned kIsChanged = 0x80;
  constexpr std::size_t kMuch = std::size_t{1} << 20U;
  const unsigned head = piece.empty() ? 0 : static_cast<unsigned char>(piece.front());
  const std::string body(piece.empty() ? piece : piece.substr(1));
  std::string frame = client.sealed(body, head & ~kIsChanged);
  frame.back() = static_cast<char>(frame.back() ^ ((head & kIsChanged) != 0 ? 1 : 0));
  zmtp.receive(frame);
  zmtp.run_step();
  require(zmtp.held_bytes() < kMuch);
  require(zmtp.has_message() == (head == 0) && zmtp.fault().empty() == (head == 0));
  require(head != 0 || zmtp.take_message() == body);
  require(zmtp.take_answers().empty());
}

}  // namespace
}  // namespace oblique::server

/// The input consists of frames that a peer sends after its handshake.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace oblique::server;
  static const KeyedPort port;
  std::string_view input(reinterpret_cast<const char*>(data), size);
  Zmtp zmtp(&port.security);
  CurveClient client(port.own, port.server.public_key);
  be_welcomed(zmtp, client);
  static_cast<void>(send(zmtp, command_frame("INITIATE", client.initiate())));
  require(zmtp.is_open());
  while (!input.empty() && zmtp.fault().empty()) {
    send_frame(zmtp, client, next_piece(input));
  }
  return 0;
}
