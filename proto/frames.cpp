#include "proto/frames.h"

#include <google/protobuf/stubs/logging.h>

namespace oblique::protocol {

std::string objection_to_version(std::uint32_t version, const std::string& who) {
  if (version >= kOldestProtocolVersion && version <= kProtocolVersion) {
    return {};
  }
  return "the server speaks protocol versions " + std::to_string(kOldestProtocolVersion) + " and " +
         std::to_string(kProtocolVersion) + ", the " + who + " " + std::to_string(version) +
         ": install the same release on both";
}

std::string encode(const google::protobuf::MessageLite& message) {
  return message.SerializeAsString();
}

bool decode(std::string_view frame, google::protobuf::MessageLite& message) {
  return frame.size() <= kMaxFrameBytes &&
         message.ParseFromArray(frame.data(), static_cast<int>(frame.size()));
}

void silence_protobuf() {
  google::protobuf::SetLogHandler(nullptr);
}

}  // namespace oblique::protocol
