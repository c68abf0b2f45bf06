#include "proto/frames.h"

#include <algorithm>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/wire_format_lite.h>

#include "proto/oblique.pb.h"

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

std::string reply_around(std::string_view encoded_query_reply) {
  using google::protobuf::internal::WireFormatLite;
  std::string bytes;
  bytes.reserve(encoded_query_reply.size() + 16);
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream out(&stream);
    out.WriteTag(WireFormatLite::MakeTag(ClientReply::kQueryFieldNumber,
                                         WireFormatLite::WIRETYPE_LENGTH_DELIMITED));
    out.WriteVarint32(static_cast<std::uint32_t>(encoded_query_reply.size()));
    out.WriteRaw(encoded_query_reply.data(), static_cast<int>(encoded_query_reply.size()));
  }
  return bytes;
}

std::string with_request_id(std::uint64_t request_id, std::string_view encoded_reply) {
  ClientReply number;
  number.set_request_id(request_id);
  // Encoded messages one after another are, decoded, one message with all their fields.
  return encode(number).append(encoded_reply);
}

bool decode(std::string_view frame, google::protobuf::MessageLite& message) {
  return frame.size() <= kMaxFrameBytes &&
         message.ParseFromArray(frame.data(), static_cast<int>(frame.size()));
}

std::size_t count_nested(std::string_view frame, int outer, int inner) {
  using google::protobuf::internal::WireFormatLite;
  const auto tag_of = [](int field) {
    return WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
  };
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(frame.data()),
                                            static_cast<int>(frame.size()));
  std::size_t count = 0;
  while (const std::uint32_t tag = in.ReadTag()) {
    std::uint32_t bytes = 0;
    if (tag != tag_of(outer)) {
      if (!WireFormatLite::SkipField(&in, tag)) {
        break;
      }
      continue;
    }
    if (!in.ReadVarint32(&bytes)) {
      break;
    }
    const auto end = in.PushLimit(static_cast<int>(std::min<std::size_t>(bytes, frame.size())));
    while (const std::uint32_t nested = in.ReadTag()) {
      count += nested == tag_of(inner) ? 1U : 0U;
      if (!WireFormatLite::SkipField(&in, nested)) {
        return count;
      }
    }
    in.PopLimit(end);
  }
  return count;
}

void silence_protobuf() {
  google::protobuf::SetLogHandler(nullptr);
}

}  // namespace oblique::protocol
