#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "server/network/zmtp.h"

/// What a connection brings, in pieces; of each piece the first byte is its length.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMuch = std::size_t{1} << 20U;
  std::string_view input(reinterpret_cast<const char*>(data), size);
  oblique::server::Zmtp zmtp;
  while (!input.empty() && zmtp.fault().empty()) {
    const std::size_t length =
        std::min<std::size_t>(static_cast<unsigned char>(input.front()), input.size() - 1);
    zmtp.receive(input.substr(1, length));
    input.remove_prefix(1 + length);
    while (zmtp.has_message()) {
      static_cast<void>(zmtp.take_message());
    }
    static_cast<void>(zmtp.take_answers());
    if (zmtp.held_bytes() > kMuch) {
      std::abort();  // no more can be held than has come
    }
  }
  return 0;
}
