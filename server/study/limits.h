#pragma once

#include <cstddef>
#include <cstdint>

// Bounds on what peers can make the server hold or do. The six that people may set are options of
// oblique-server (--limits-KEY, server/program); here are their defaults and all others, each with
// its reason. Every wait has a bound for one peer and one for all.
namespace oblique::server::limits {

inline constexpr std::size_t kMiB = std::size_t{1} << 20U;

// ---- Defaults of the options ------------------------------------------------------------------

/// Workers and clients of a large cluster; a connection takes a descriptor and some kilobytes.
inline constexpr std::size_t kConnections = 4096;
/// Replies to one peer that it does not read: four of the longest.
inline constexpr std::size_t kWaitingOutBytes = 64 * kMiB;
/// Results on their way to the disk: seconds of a fast cluster's work.
inline constexpr std::size_t kUnstoredBytes = 64 * kMiB;
/// Each query keeps a process and up to 256 MiB busy.
inline constexpr std::size_t kRunningQueries = 4;
/// Points of open studies. A study takes memory by its intervals, not its points; beyond this sums
/// would come near to overflow.
inline constexpr std::uint64_t kOpenPoints = 10'000'000'000'000;
/// Batches that a worker may request at a time. More would wait there while others have none.
inline constexpr std::uint32_t kCredit = 1024;

// ---- Connections ------------------------------------------------------------------------------

/// Messages of all peers that are incomplete or were not taken.
inline constexpr std::size_t kHeldInBytes = 512 * kMiB;
/// Of one port, above which its peers are not read.
inline constexpr std::size_t kHeldInToPauseBytes = 64 * kMiB;
/// A peer with more unsent output is busy: it gets no batch, and its next request waits.
inline constexpr std::size_t kBusyBytes = 4 * kMiB;
inline constexpr std::size_t kAllWaitingOutBytes = 512 * kMiB;
/// Handshakes at a time; of one source half as many, so that it cannot keep others out.
inline constexpr std::size_t kHandshakes = 1024;
inline constexpr std::size_t kHandshakesOfSource = kHandshakes / 2;

// ---- Writes -----------------------------------------------------------------------------------

/// Writes that no client waits for, in number: small ones take memory, too.
inline constexpr std::size_t kUnstoredWrites = 80'000;
/// Changes of clients, and bytes of their recipes.
inline constexpr std::size_t kUnstoredChanges = 10'000;
inline constexpr std::size_t kUnstoredBytesOfChanges = 64 * kMiB;
/// Requests for one study that wait for a change of it.
inline constexpr std::size_t kDeferredRequests = 1000;

// ---- Requests of clients ----------------------------------------------------------------------

/// A longer request is parsed on a thread of its own: parsing it takes over a millisecond.
inline constexpr std::size_t kLongestInlineRequest = std::size_t{64} << 10U;
/// Such requests that wait, and their bytes.
inline constexpr std::size_t kWaitingChecks = 64;
inline constexpr std::size_t kWaitingCheckBytes = 64 * kMiB;
/// Studies or workers in a reply, and about so many bytes: making it takes the service's thread
/// some milliseconds.
inline constexpr std::uint32_t kListed = 1000;
inline constexpr std::size_t kListedBytes = kMiB;
/// Studies that are neither done nor cancelled, some kilobytes each.
inline constexpr std::size_t kOpenStudies = 100'000;

/// Recipes that the page requests at a time, and that it keeps: up to 16 MiB each, and more parsed.
inline constexpr std::size_t kRecipesOfPage = 4;

// ---- Queries ----------------------------------------------------------------------------------

/// Queries of one client at a time, so that another client's starts at once.
inline constexpr std::size_t kRunningQueriesOfClient = 2;
/// Queries that wait, with statements of up to a megabyte.
inline constexpr std::size_t kWaitingQueries = 64;
inline constexpr std::size_t kWaitingQueriesOfClient = 16;
inline constexpr std::size_t kWaitingQueryBytes = 16 * kMiB;

// ---- Traces -----------------------------------------------------------------------------------

/// Traces with workers: each may come back as a message of 16 MiB.
inline constexpr std::size_t kRunningTraces = 2;
/// Requests for traces that wait, and checks of their points.
inline constexpr std::size_t kWaitingTraces = 64;
/// Traces that the page requests or sends at a time; more wait.
inline constexpr std::size_t kTracesOfPage = 4;
/// Time from request to answer, waiting included: the usual one, and what clients can request.
inline constexpr std::int64_t kTraceTime_ms = 60'000;
inline constexpr std::int64_t kLongestTraceTime_ms = 600'000;

}  // namespace oblique::server::limits
