#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace oblique::protocol {

// Checks frames before they are parsed. A parsed message of two bytes may need hundreds of bytes,
// so parsing a malicious frame could need a hundred times its size.

/// Maximum size of a worker's frame [bytes], without the rows of a trace. The results in a
/// message have at most 1 MiB.
inline constexpr std::size_t kMaxWorkerFrameBytes = std::size_t{4} * 1024 * 1024;
/// Maximum number of results in one message. Workers send at most 1,000.
inline constexpr std::size_t kMaxResultsAMessage = 10'000;
/// Maximum number of leases in a heartbeat. A worker has at most 50,000 unacknowledged results and
/// 1,024 batches. This is checked after parsing, because a parsed lease needs little more memory
/// than an encoded one.
inline constexpr int kMaxLeasesAHeartbeat = 65'536;

/// Returns whether the frame is within the limits for workers; may be true for an invalid frame.
bool is_worker_frame_within_limits(std::string_view frame);

/// Returns whether the recipe in a client's request has enough bytes for the axes that its blocks
/// need. If not, the recipe is padded with empty messages or cannot be parsed.
bool is_unpadded_request(std::string_view frame);

/// Returns whether an encoded recipe has enough bytes for the axes that its blocks need.
bool is_unpadded_recipe(std::string_view recipe);

/// Returns the number of a client's request, from the beginning of its frame; 0 if it is missing.
std::uint64_t request_id_of(std::string_view frame);

}  // namespace oblique::protocol
