#pragma once

#include <cstddef>
#include <cstdint>

// Limits on resources that peers can use. Six are options of oblique-server (--limits-KEY,
// server/program), whose defaults are here; all others are constants. Every queue has a limit per
// peer and one for all.
namespace oblique::server::limits {

inline constexpr std::size_t kMiB = std::size_t{1} << 20U;

// ---- Defaults of the options ------------------------------------------------------------------

/// Workers and clients of a large cluster; a connection needs a descriptor and some kilobytes.
inline constexpr std::size_t kConnections = 4096;
/// Unread replies to one peer: four of the longest.
inline constexpr std::size_t kWaitingOutBytes = 64 * kMiB;
/// Unstored results: some seconds of work of a fast cluster.
inline constexpr std::size_t kUnstoredBytes = 64 * kMiB;
/// Each query uses a process and up to 256 MiB.
inline constexpr std::size_t kRunningQueries = 4;
/// Points of open studies. Memory depends on intervals, not on points; beyond this limit sums could
/// overflow.
inline constexpr std::uint64_t kOpenPoints = 10'000'000'000'000;
/// Batches that a worker may request at a time. More would wait there while other workers have
/// none.
inline constexpr std::uint32_t kCredit = 1024;

// ---- Connections ------------------------------------------------------------------------------

/// Messages of all peers that are incomplete or not taken yet.
inline constexpr std::size_t kHeldInBytes = 512 * kMiB;
/// The same of one port, above which its peers are not read.
inline constexpr std::size_t kHeldInToPauseBytes = 64 * kMiB;
/// A peer with more unsent output is busy: it gets no batch, and its next request is not read.
inline constexpr std::size_t kBusyBytes = 4 * kMiB;
inline constexpr std::size_t kAllWaitingOutBytes = 512 * kMiB;
/// Handshakes at a time. One source may have half of them, so that it cannot lock out others.
inline constexpr std::size_t kHandshakes = 1024;
inline constexpr std::size_t kHandshakesOfSource = kHandshakes / 2;

// ---- Writes -----------------------------------------------------------------------------------

/// Number of writes without a waiting client, because small ones use memory too.
inline constexpr std::size_t kUnstoredWrites = 80'000;
/// Unstored changes of clients, and the size of their recipes.
inline constexpr std::size_t kUnstoredChanges = 10'000;
inline constexpr std::size_t kUnstoredBytesOfChanges = 64 * kMiB;
/// Requests for one study that wait for a change of it to be stored.
inline constexpr std::size_t kDeferredRequests = 1000;

// ---- Requests of clients ----------------------------------------------------------------------

/// A longer request is parsed on the check thread, because that takes over a millisecond.
inline constexpr std::size_t kLongestInlineRequest = std::size_t{64} << 10U;
/// Number and total size of such requests that wait.
inline constexpr std::size_t kWaitingChecks = 64;
inline constexpr std::size_t kWaitingCheckBytes = 64 * kMiB;
/// Maximum number of studies or workers in a reply, and its approximate size, so that making it
/// takes the service's thread only some milliseconds.
inline constexpr std::uint32_t kListed = 1000;
inline constexpr std::size_t kListedBytes = kMiB;
/// Studies that are neither done nor cancelled; each needs some kilobytes.
inline constexpr std::size_t kOpenStudies = 100'000;

/// Recipes that the page requests at a time, and recipes that it keeps: up to 16 MiB each, and more
/// when parsed.
inline constexpr std::size_t kRecipesOfPage = 4;

// ---- Queries ----------------------------------------------------------------------------------

/// Running queries of one client, so that another client's query starts at once.
inline constexpr std::size_t kRunningQueriesOfClient = 2;
/// Waiting queries, whose statements may have a megabyte.
inline constexpr std::size_t kWaitingQueries = 64;
inline constexpr std::size_t kWaitingQueriesOfClient = 16;
inline constexpr std::size_t kWaitingQueryBytes = 16 * kMiB;

// ---- Traces -----------------------------------------------------------------------------------

/// Traces that workers solve at a time; each may return a message of 16 MiB.
inline constexpr std::size_t kRunningTraces = 2;
/// Waiting requests for traces, and checks of their points.
inline constexpr std::size_t kWaitingTraces = 64;
/// Traces that the page requests or sends at a time; further ones wait.
inline constexpr std::size_t kTracesOfPage = 4;
/// Time from request to answer, including waiting: the default, and the maximum that clients can
/// request.
inline constexpr std::int64_t kTraceTime_ms = 60'000;
inline constexpr std::int64_t kLongestTraceTime_ms = 600'000;

}  // namespace oblique::server::limits
