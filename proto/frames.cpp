#include "proto/frames.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/wire_format_lite.h>
#include <spdlog/fmt/fmt.h>

#include "proto/oblique.pb.h"

namespace oblique::protocol {

namespace {

/// The bytes of a message that holds nothing but that field, a message that is encoded already.
std::string field_around(int number, std::string_view encoded) {
  using google::protobuf::internal::WireFormatLite;
  std::string bytes;
  bytes.reserve(encoded.size() + 16);
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream out(&stream);
    out.WriteTag(WireFormatLite::MakeTag(number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED));
    out.WriteVarint32(static_cast<std::uint32_t>(encoded.size()));
  }
  return bytes.append(encoded);
}

}  // namespace

std::string objection_to_version(std::uint32_t version, const std::string& who) {
  return version == kProtocolVersion ? std::string()
                                     : fmt::format(
                                           "the server has protocol version {}, the {} {}: install "
                                           "the same release on both",
                                           kProtocolVersion, who, version);
}

std::string encode(const google::protobuf::MessageLite& message) {
  return message.SerializeAsString();
}

std::string reply_around(std::string_view encoded_query_reply) {
  return field_around(ClientReply::kQueryFieldNumber, encoded_query_reply);
}

std::string definition_around(std::uint64_t study_id, std::string_view encoded_recipe) {
  StudyDefinition number;
  number.set_study_id(study_id);
  return field_around(
      ServerToWorker::kStudyFieldNumber,
      encode(number).append(field_around(StudyDefinition::kRecipeFieldNumber, encoded_recipe)));
}

std::string description_around(std::uint64_t request_id, std::string_view encoded_recipe) {
  return with_request_id(
      request_id, field_around(ClientReply::kDescribeFieldNumber,
                               field_around(DescribeReply::kRecipeFieldNumber, encoded_recipe)));
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

void silence_protobuf() {
  google::protobuf::SetLogHandler(nullptr);
}

}  // namespace oblique::protocol
