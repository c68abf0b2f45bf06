#include "proto/frames.h"

namespace oblique::protocol {

std::string encode(const google::protobuf::MessageLite& message) {
  return message.SerializeAsString();
}

bool decode(std::string_view frame, google::protobuf::MessageLite& message) {
  return frame.size() <= kMaxFrameBytes &&
         message.ParseFromArray(frame.data(), static_cast<int>(frame.size()));
}

}  // namespace oblique::protocol
