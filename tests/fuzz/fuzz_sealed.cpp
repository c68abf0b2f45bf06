#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/zmtp_port.h"

namespace oblique::server {
namespace {

void require(bool is_so) {
  if (!is_so) {
    std::abort();
  }
}

/// The messages that these bytes bring; PONGs must be for this client.
std::vector<ZmtpMessage> messages_of(Zmtp& zmtp, const CurveClient& client,
                                     std::string_view bytes) {
  constexpr std::size_t kMuch = std::size_t{1} << 20U;
  constexpr std::size_t kShortHeader = 2;
  std::vector<ZmtpMessage> messages;
  zmtp.receive(bytes);
  while (zmtp.has_message() || zmtp.waiting_work() != Zmtp::Work::kNone) {
    zmtp.do_work();
    if (zmtp.has_message()) {
      messages.push_back(zmtp.take_message());
    }
  }
  require(zmtp.held_bytes() < kMuch);  // no more can be held than has come
  const std::string answer = zmtp.take_answers();
  require(answer.empty() ||
          client.opened_message(std::string_view(answer).substr(kShortHeader)).has_value());
  return messages;
}

/// One frame in MESSAGE. The piece has its flags and its body; with the highest bit of the flags
/// the box is changed on its way.
void say_frame(Zmtp& zmtp, CurveClient& client, std::string_view piece, bool& in_parts) {
  constexpr unsigned kIsChanged = 0x80;
  constexpr unsigned kMore = 1;
  constexpr unsigned kCommand = 2;
  const unsigned head = piece.empty() ? 0 : static_cast<unsigned char>(piece.front());
  const unsigned flags = head & ~kIsChanged;
  const std::string body(piece.empty() ? piece : piece.substr(1));
  std::string frame = client.sealed(body, flags);
  frame.back() = static_cast<char>(frame.back() ^ ((head & kIsChanged) != 0 ? 1 : 0));
  const std::vector<ZmtpMessage> messages = messages_of(zmtp, client, frame);
  if ((head & kIsChanged) != 0 || flags > kCommand) {
    require(!zmtp.fault().empty() && messages.empty());
  } else if (flags == 0) {
    require(messages.size() == 1 && messages[0].is_single == !in_parts &&
            messages[0].body == (in_parts ? "" : body));
    in_parts = false;
  } else {
    require(messages.empty());
    in_parts = in_parts || flags == kMore;
  }
}

}  // namespace
}  // namespace oblique::server

/// What a peer says after a finished handshake: frames in MESSAGE. What was said whole and under a
/// sound seal comes out as it was said, and nothing else does.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace oblique::server;
  static const Guarded guarded;
  std::string_view input(reinterpret_cast<const char*>(data), size);
  Zmtp zmtp(&guarded.guard);
  CurveClient client(guarded.own, guarded.server.public_key);
  be_welcomed(zmtp, client);
  static_cast<void>(say(zmtp, command_of("INITIATE", client.initiate())));
  require(zmtp.is_open());
  bool in_parts = false;
  while (!input.empty() && zmtp.fault().empty()) {
    say_frame(zmtp, client, next_piece(input), in_parts);
  }
  return 0;
}
