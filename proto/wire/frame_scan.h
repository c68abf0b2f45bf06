#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace oblique::protocol {

// What a frame holds, counted on its bytes before anything is built of it. A message of two bytes
// becomes an object of hundreds, so a hostile frame could else cost a hundred times its size.

/// Longest frame of a worker, without the rows of a trace: a sound one splits its results at 1 MiB.
inline constexpr std::size_t kMaxWorkerFrameBytes = std::size_t{4} * 1024 * 1024;
/// Most results in one message; a sound worker sends 1,000.
inline constexpr std::size_t kMaxResultsAMessage = 10'000;
/// Most leases that a heartbeat names: a worker keeps 50,000 results that are not acknowledged, and
/// holds at most 1,024 batches. To be checked after parsing, for a lease needs little more memory.
inline constexpr int kMaxLeasesAHeartbeat = 65'536;

/// Whether the frame holds no more than a correct worker sends. One that cannot be parsed may pass.
bool is_worker_frame_within_limits(std::string_view frame);

/// Whether the recipe in a client's request has room in its bytes for the axes that its blocks
/// need. Else it is padded with empty messages, or cannot be parsed.
bool is_unpadded_request(std::string_view frame);

/// The same of a serialised recipe.
bool is_unpadded_recipe(std::string_view recipe);

/// The number of a client's request, from the beginning of its frame; 0 when it is not there.
std::uint64_t request_id_of(std::string_view frame);

}  // namespace oblique::protocol
