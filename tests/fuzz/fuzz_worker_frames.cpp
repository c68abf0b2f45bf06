#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "proto/frames.h"
#include "proto/result_message.h"
#include "worker/conversation.h"

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  oblique::protocol::silence_protobuf();
  return 0;
}

/// The input is frames from a server to a worker. The first byte of each piece is its length.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view input(reinterpret_cast<const char*>(data), size);
  oblique::protocol::WorkerHello hello;
  oblique::protocol::set_protocol(hello);
  oblique::worker::Conversation conversation(hello, {});
  std::int64_t now_ms = 0;
  conversation.start(now_ms);
  while (!input.empty()) {
    const std::size_t length =
        std::min<std::size_t>(static_cast<unsigned char>(input.front()), input.size() - 1);
    oblique::protocol::ServerToWorker message;
    if (oblique::protocol::decode(input.substr(1, length), message)) {
      conversation.on_message(message, now_ms);
    }
    input.remove_prefix(1 + length);
    now_ms += 50;
    conversation.on_time(now_ms);
  }
  return 0;
}
