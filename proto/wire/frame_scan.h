#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace oblique::protocol {

// Measures frames before they are parsed. A parsed field of two bytes may need a hundred bytes, so
// parsing a malicious frame could need far more memory than its size.

/// Maximum size of a worker's frame [bytes], without the rows of a trace. The results in a
/// message have at most 1 MiB.
inline constexpr std::size_t kMaxWorkerFrameBytes = std::size_t{4} * 1024 * 1024;
/// Maximum memory of a parsed worker's frame, without the rows of a trace [bytes].
inline constexpr std::size_t kMaxParsedWorkerFrameBytes = std::size_t{16} * 1024 * 1024;
/// Maximum memory of a parsed recipe [bytes].
inline constexpr std::size_t kMaxParsedRecipeBytes = std::size_t{64} * 1024 * 1024;
/// Maximum memory of all other fields of a client's request [bytes]. A statement has at most 1 MB.
inline constexpr std::size_t kMaxParsedRequestBytes = std::size_t{4} * 1024 * 1024;
/// Maximum number of results in one message, checked after parsing. Workers send at most 1,000.
inline constexpr int kMaxResultsAMessage = 10'000;
/// Maximum number of leases in a heartbeat, checked after parsing. A worker has at most 50,000
/// unacknowledged results and 1,024 batches.
inline constexpr int kMaxLeasesAHeartbeat = 65'536;

/// Return whether an encoded message is within the limits above; may be true for an invalid one.
bool is_worker_frame_within_limits(std::string_view frame);
bool is_request_within_limits(std::string_view frame);
bool is_recipe_within_limits(std::string_view recipe);

/// Returns the number of a client's request, from the beginning of its frame; 0 if it is missing.
std::uint64_t request_id_of(std::string_view frame);

}  // namespace oblique::protocol
