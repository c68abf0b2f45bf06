#include "proto/frames.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/wire_format_lite.h>
#include <spdlog/fmt/fmt.h>

namespace oblique::protocol {

std::string version_error(std::uint32_t version, const std::string& who) {
  return version == kProtocolVersion ? ""
                                     : fmt::format(
                                           "the server has protocol version {}, but the {} has "
                                           "version {}: install the same "
                                           "release on both",
                                           kProtocolVersion, who, version);
}

std::string encode(const google::protobuf::MessageLite& message) {
  return message.SerializeAsString();
}

std::string encode_around(const google::protobuf::MessageLite& rest, int number,
                          std::string_view encoded) {
  using google::protobuf::internal::WireFormatLite;
  std::string bytes = encode(rest);
  bytes.reserve(bytes.size() + encoded.size() + 16);
  {
    google::protobuf::io::StringOutputStream stream(&bytes);  // this stream appends to `bytes`
    google::protobuf::io::CodedOutputStream out(&stream);
    out.WriteTag(WireFormatLite::MakeTag(number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED));
    out.WriteVarint32(static_cast<std::uint32_t>(encoded.size()));
  }
  return bytes.append(encoded);
}

bool decode(std::string_view frame, google::protobuf::MessageLite& message) {
  return frame.size() <= kMaxFrameBytes &&
         message.ParseFromArray(frame.data(), static_cast<int>(frame.size()));
}

void silence_protobuf() {
  google::protobuf::SetLogHandler(nullptr);
}

}  // namespace oblique::protocol
