#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>

#include "server/network/zmtp.h"
#include "tests/server/network/curve_client.h"
#include "tests/server/network/list_doorkeeper.h"

namespace oblique::server {
namespace {

/// A port with keys, and one who is admitted there.
struct Guarded {
  protocol::KeyPair server = protocol::made_key_pair();
  protocol::KeyPair own = protocol::made_key_pair();
  std::shared_ptr<ListDoorkeeper> doorkeeper = std::make_shared<ListDoorkeeper>();
  PortGuard guard{server, doorkeeper};
  Guarded() { doorkeeper->admit(own.public_key, "fuzz"); }
};

std::string say(Zmtp& zmtp, std::string_view bytes) {
  constexpr std::size_t kMuch = std::size_t{1} << 20U;
  zmtp.receive(bytes);
  while (zmtp.has_message() || zmtp.waiting_work() != Zmtp::Work::kNone) {
    zmtp.do_work();
    if (zmtp.has_message()) {
      static_cast<void>(zmtp.take_message());
    }
  }
  if (zmtp.held_bytes() > kMuch) {
    std::abort();  // no more can be held than has come
  }
  return zmtp.take_answers();
}

/// The next piece of the input; its first byte is its length.
std::string_view next_piece(std::string_view& input) {
  const std::size_t length =
      std::min<std::size_t>(static_cast<unsigned char>(input.front()), input.size() - 1);
  const std::string_view piece = input.substr(1, length);
  input.remove_prefix(1 + length);
  return piece;
}

void say_pieces(Zmtp& zmtp, std::string_view input) {
  while (!input.empty() && zmtp.fault().empty()) {
    static_cast<void>(say(zmtp, next_piece(input)));
  }
}

void be_welcomed(Zmtp& zmtp, CurveClient& client) {
  static_cast<void>(zmtp.take_answers());
  const std::string welcome = say(zmtp, curve_greeting() + zmtp_command("HELLO", client.hello()));
  if (!client.take_welcome(std::string_view(welcome).substr(10))) {
    std::abort();
  }
}

/// An INITIATE that is sound but for what the input changes: nobody may get in by it.
void change_initiate(Zmtp& zmtp, CurveClient& client, std::string_view input) {
  be_welcomed(zmtp, client);
  const std::string sound = client.initiate();
  std::string data = sound;
  for (; input.size() >= 3; input.remove_prefix(3)) {
    const std::size_t at = static_cast<std::size_t>(number_of(input.substr(0, 2))) % data.size();
    data[at] = static_cast<char>(data[at] ^ input[2]);
  }
  static_cast<void>(say(zmtp, command_of("INITIATE", data)));
  if (zmtp.is_open() != (data == sound)) {
    std::abort();
  }
}

/// Properties as the input has them, under a sound seal.
void say_properties(Zmtp& zmtp, CurveClient& client, std::string_view input) {
  constexpr std::size_t kMost = 3500;
  be_welcomed(zmtp, client);
  client.properties = input.substr(0, kMost);
  static_cast<void>(say(zmtp, command_of("INITIATE", client.initiate())));
}

/// Frames as the input has them, each under a sound seal: of each the first byte is its flags.
void say_sealed(Zmtp& zmtp, CurveClient& client, std::string_view input) {
  be_welcomed(zmtp, client);
  static_cast<void>(say(zmtp, command_of("INITIATE", client.initiate())));
  while (!input.empty() && zmtp.fault().empty()) {
    const std::string_view piece = next_piece(input);
    const unsigned flags = piece.empty() ? 0 : static_cast<unsigned char>(piece.front());
    static_cast<void>(say(zmtp, client.sealed(piece.empty() ? piece : piece.substr(1), flags)));
  }
}

}  // namespace
}  // namespace oblique::server

/// What a connection brings. The first byte says to which port, and how much of it is sound.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace oblique::server;
  static const Guarded guarded;
  std::string_view input(reinterpret_cast<const char*>(data), size);
  if (input.empty()) {
    return 0;
  }
  const unsigned way = static_cast<unsigned char>(input.front()) % 5U;
  input.remove_prefix(1);
  Zmtp zmtp(way == 0 ? nullptr : &guarded.guard);
  CurveClient client(guarded.own, guarded.server.public_key);
  switch (way) {
    case 2:
      change_initiate(zmtp, client, input);
      break;
    case 3:
      say_properties(zmtp, client, input);
      break;
    case 4:
      say_sealed(zmtp, client, input);
      break;
    default:
      say_pieces(zmtp, input);
  }
  return 0;
}
