#include "proto/wire/frame_scan.h"

#include <algorithm>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include "proto/oblique.pb.h"

namespace oblique::protocol {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

/// Calls `visit(number, bytes)` for each field of a serialised message until it gives false;
/// `bytes` are those of a text, a packed list or a message, and empty for a number. False when the
/// bytes are no message.
template <typename Visitor>
bool for_each_field(std::string_view message, Visitor visit) {
  CodedInputStream in(reinterpret_cast<const std::uint8_t*>(message.data()),
                      static_cast<int>(message.size()));
  while (const std::uint32_t tag = in.ReadTag()) {
    std::string_view bytes;
    if (WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      std::uint32_t length = 0;
      if (!in.ReadVarint32(&length)) {
        return false;
      }
      const auto begin = static_cast<std::size_t>(in.CurrentPosition());
      if (length > message.size() - begin || !in.Skip(static_cast<int>(length))) {
        return false;
      }
      bytes = message.substr(begin, length);
    } else if (!WireFormatLite::SkipField(&in, tag)) {
      return false;
    }
    if (!visit(WireFormatLite::GetTagFieldNumber(tag), bytes)) {
      return true;
    }
  }
  return in.ConsumedEntireMessage();
}

/// Numbers in a list that is packed or, when there are no bytes, a single one.
std::size_t listed_numbers(std::string_view packed) {
  return packed.empty()
             ? 1
             : static_cast<std::size_t>(std::count_if(packed.begin(), packed.end(), [](char byte) {
                 return (static_cast<unsigned char>(byte) & 0x80U) == 0;
               }));
}

}  // namespace

bool is_of_a_workers_size(std::string_view frame) {
  if (frame.size() > kMaxWorkerFrameBytes) {
    return false;
  }
  std::size_t results = 0;
  std::size_t lease_ids = 0;
  for_each_field(frame, [&](int kind, std::string_view part) {
    if (kind == WorkerMessage::kResultsFieldNumber) {
      for_each_field(part, [&](int field, std::string_view) {
        results += field == Results::kResultsFieldNumber ? 1U : 0U;
        return results <= kMostResultsAMessage;
      });
    } else if (kind == WorkerMessage::kHeartbeatFieldNumber ||
               kind == WorkerMessage::kGiveBackFieldNumber) {
      static_assert(int{Heartbeat::kLeaseIdsFieldNumber} == int{GiveBack::kLeaseIdsFieldNumber});
      for_each_field(part, [&](int field, std::string_view ids) {
        lease_ids += field == Heartbeat::kLeaseIdsFieldNumber ? listed_numbers(ids) : 0;
        return lease_ids <= kMostLeasesAHeartbeat;
      });
    }
    return true;
  });
  return results <= kMostResultsAMessage && lease_ids <= kMostLeasesAHeartbeat;
}

bool is_of_a_recipes_shape(std::string_view recipe) {
  // Key and count, of a range from 0 to 0: the least that an axis takes.
  constexpr std::size_t kLeastAxisBytes = 5;
  constexpr std::size_t kLeastAxes = 3;
  bool is_padded = false;
  const auto look_at_axes = [&](std::string_view block) {
    std::size_t axes = 0;
    const bool is_message = for_each_field(block, [&](int field, std::string_view axis) {
      if (field == Block::kAxesFieldNumber) {
        is_padded = is_padded || axis.size() < kLeastAxisBytes;
        ++axes;
      }
      return !is_padded;
    });
    is_padded = is_padded || !is_message || axes < kLeastAxes;
  };
  const bool is_message = for_each_field(recipe, [&](int field, std::string_view part) {
    if (field == Recipe::kBlocksFieldNumber) {
      look_at_axes(part);
    }
    return !is_padded;
  });
  return is_message && !is_padded;
}

bool is_of_a_requests_shape(std::string_view frame) {
  bool is_padded = false;
  const bool is_message = for_each_field(frame, [&](int kind, std::string_view part) {
    const bool is_submission = kind == ClientRequest::kSubmitFieldNumber;
    if (is_submission && !for_each_field(part, [&](int field, std::string_view recipe) {
          is_padded = is_padded || (field == SubmitRequest::kRecipeFieldNumber &&
                                    !is_of_a_recipes_shape(recipe));
          return !is_padded;
        })) {
      is_padded = true;
    }
    return !is_padded;
  });
  return is_message && !is_padded;
}

std::uint64_t request_id_of(std::string_view frame) {
  // Few fields stand before it in any request, and none after it counts.
  constexpr int kMostFields = 8;
  CodedInputStream in(reinterpret_cast<const std::uint8_t*>(frame.data()),
                      static_cast<int>(frame.size()));
  for (int i = 0; i < kMostFields; ++i) {
    const std::uint32_t tag = in.ReadTag();
    std::uint64_t id = 0;
    if (tag == WireFormatLite::MakeTag(ClientRequest::kRequestIdFieldNumber,
                                       WireFormatLite::WIRETYPE_VARINT)) {
      return in.ReadVarint64(&id) ? id : 0;
    }
    if (tag == 0 || !WireFormatLite::SkipField(&in, tag)) {
      return 0;
    }
  }
  return 0;
}

}  // namespace oblique::protocol
