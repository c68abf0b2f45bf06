#include "proto/wire/frame_scan.h"

#include <array>
#include <span>
#include <vector>

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

struct Found {
  std::size_t fields = 0;
  std::size_t bytes = 0;  ///< total size of the found texts, packed lists and messages
  bool is_whole = true;   ///< true if every message on the path is complete
};

Found find(std::string_view message, std::span<const int> path) {
  Found found;
  CodedInputStream in = stream_of(message);
  while (const std::uint32_t tag = in.ReadTag()) {
    const auto begin = static_cast<std::size_t>(in.CurrentPosition());
    if (!WireFormatLite::SkipField(&in, tag)) {
      break;
    }
    if (WireFormatLite::GetTagFieldNumber(tag) != path.front()) {
      continue;
    }
    std::string_view bytes;
    if (WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      bytes = message.substr(begin, static_cast<std::size_t>(in.CurrentPosition()) - begin);
      std::uint32_t length = 0;
      stream_of(bytes).ReadVarint32(&length);
      bytes.remove_prefix(bytes.size() - length);
    }
    const Found inner =
        path.size() > 1 ? find(bytes, path.subspan(1)) : Found{1, bytes.size(), true};
    found.fields += inner.fields;
    found.bytes += inner.bytes;
    found.is_whole = found.is_whole && inner.is_whole;
  }
  found.is_whole = found.is_whole && in.ConsumedEntireMessage();
  return found;
}

/// Returns whether the recipe at the path has enough bytes for the axes that its blocks need.
bool has_room_for_axes(std::string_view message, std::vector<int> path) {
  // The smallest axis consists of a key and a range from 0 to 0. A block has at least three axes.
  constexpr std::size_t kLeastAxisBytes = 5;
  constexpr std::size_t kLeastBlockBytes = 3 * (2 + kLeastAxisBytes);
  path.push_back(Recipe::kBlocksFieldNumber);
  const Found blocks = find(message, path);
  path.push_back(Block::kAxesFieldNumber);
  const Found axes = find(message, path);
  return axes.is_whole && blocks.fields * kLeastBlockBytes <= blocks.bytes &&
         axes.fields * kLeastAxisBytes <= axes.bytes;
}

}  // namespace

bool is_worker_frame_within_limits(std::string_view frame) {
  if (frame.size() > kMaxFrameBytes) {
    return false;
  }
  using Message = WorkerMessage;
  const auto bytes_of = [frame](int field) {
    return find(frame, std::array{static_cast<int>(Message::kTraceFieldNumber), field}).bytes;
  };
  const auto rows = bytes_of(Trace::kValuesFieldNumber) + bytes_of(Trace::kStatesFieldNumber);
  const std::array results{static_cast<int>(Message::kResultsFieldNumber),
                           static_cast<int>(Results::kResultsFieldNumber)};
  return frame.size() - rows <= kMaxWorkerFrameBytes &&
         find(frame, results).fields <= kMaxResultsAMessage;
}

bool is_unpadded_recipe(std::string_view recipe) {
  return has_room_for_axes(recipe, {});
}

bool is_unpadded_request(std::string_view frame) {
  return has_room_for_axes(frame,
                           {ClientRequest::kSubmitFieldNumber, SubmitRequest::kRecipeFieldNumber});
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
