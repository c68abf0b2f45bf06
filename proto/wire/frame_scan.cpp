#include "proto/wire/frame_scan.h"

#include <algorithm>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include "proto/frames.h"
#include "proto/oblique.pb.h"

namespace oblique::protocol {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

CodedInputStream stream_of(std::string_view bytes) {
  return CodedInputStream(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                          static_cast<int>(bytes.size()));
}

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

/// Memory of the fields of a parsed message [bytes]: of fields that have a limit of their own, and
/// of all others. Each number is at least the size of the encoded fields.
struct Memory {
  std::size_t bulk = 0;
  std::size_t rest = 0;
};

/// Returns the maximum memory that parsing `message` takes on a 64-bit processor, or more than any
/// limit. `bulk` are the fields with a limit of their own.
Memory measure(std::string_view message, const Descriptor& type,
               const std::vector<const FieldDescriptor*>& bulk) {
  constexpr std::size_t kMessageBytes = 320;           // of an empty message of any type
  constexpr std::size_t kTextBytes = 64;               // of an empty text
  constexpr std::size_t kEnough = 8 * kMaxFrameBytes;  // above all limits
  static_assert(sizeof(PointResult) < kMessageBytes && sizeof(Axis) < kMessageBytes);
  Memory memory;
  CodedInputStream in = stream_of(message);
  bool is_complete = true;
  while (is_complete && memory.bulk + memory.rest < kEnough) {
    const auto begin = static_cast<std::size_t>(in.CurrentPosition());
    const std::uint32_t tag = in.ReadTag();
    const auto value = static_cast<std::size_t>(in.CurrentPosition());
    is_complete = tag != 0 && WireFormatLite::SkipField(&in, tag);
    // Protobuf parses an incomplete field as far as it goes.
    const std::size_t bytes =
        (is_complete ? static_cast<std::size_t>(in.CurrentPosition()) : message.size()) - begin;
    const auto wire_type = WireFormatLite::GetTagWireType(tag);
    const bool has_length = wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
    const FieldDescriptor* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
    Memory added;
    if (has_length && field != nullptr && field->message_type() != nullptr) {
      std::string_view inner = message.substr(value, begin + bytes - value);
      CodedInputStream head = stream_of(inner);
      std::uint32_t length = 0;
      head.ReadVarint32(&length);
      inner.remove_prefix(static_cast<std::size_t>(head.CurrentPosition()));
      added = measure(inner, *field->message_type(), bulk);
      added.rest += kMessageBytes;
    } else if (has_length && (field == nullptr || !field->is_packable())) {
      added.rest = kTextBytes + bytes;
    } else {
      // A byte may be a number of 8 bytes; two bytes may be an unknown field of 64.
      const bool is_group = wire_type == WireFormatLite::WIRETYPE_START_GROUP;
      const bool is_double =
          field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE;
      added.rest = bytes * (is_group ? 32 : is_double ? 1 : 8);
    }
    if (std::ranges::count(bulk, field) > 0) {
      added = {added.bulk + added.rest, 0};
    }
    memory.bulk += added.bulk;
    memory.rest += added.rest;
  }
  return memory;
}

}  // namespace

bool is_worker_frame_within_limits(std::string_view frame) {
  const Descriptor& trace = *Trace::descriptor();
  const Memory memory = measure(frame, *WorkerMessage::descriptor(),
                                {trace.FindFieldByNumber(Trace::kValuesFieldNumber),
                                 trace.FindFieldByNumber(Trace::kStatesFieldNumber)});
  return frame.size() <= kMaxFrameBytes && frame.size() <= kMaxWorkerFrameBytes + memory.bulk &&
         memory.rest <= kMaxParsedWorkerFrameBytes;
}

bool is_request_within_limits(std::string_view frame) {
  const Descriptor& request = *ClientRequest::descriptor();
  const Memory memory =
      measure(frame, request, {request.FindFieldByNumber(ClientRequest::kSubmitFieldNumber)});
  return memory.bulk <= kMaxParsedRecipeBytes && memory.rest <= kMaxParsedRequestBytes;
}

bool is_recipe_within_limits(std::string_view recipe) {
  return measure(recipe, *Recipe::descriptor(), {}).rest <= kMaxParsedRecipeBytes;
}

std::uint64_t request_id_of(std::string_view frame) {
  CodedInputStream in = stream_of(frame);
  const auto expect = [&in](int field) {
    return in.ReadTag() == WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_VARINT);
  };
  std::uint64_t version = 0;
  std::uint64_t id = 0;
  const bool is_there = expect(ClientRequest::kProtocolVersionFieldNumber) &&
                        in.ReadVarint64(&version) && expect(ClientRequest::kRequestIdFieldNumber) &&
                        in.ReadVarint64(&id);
  return is_there ? id : 0;
}

}  // namespace oblique::protocol
