#pragma once

#include <cstddef>
#include <cstdint>

// Limits on resources that peers can use. Six are options of oblique-server (--limits-KEY,
// server/program); their defaults are here. All others are constants. Every queue has a limit per
// peer and a limit for all peers.
namespace oblique::server::limits {

inline constexpr std::size_t kMiB = std::size_t{1} << 20U;

// ---- Defaults of the options ------------------------------------------------------------------

/// Maximum number of connections, for a large cluster. Each needs a descriptor and some kilobytes.
inline constexpr std::size_t kConnections = 4096;
/// Maximum size of unread replies to one peer: four replies of the maximum size.
inline constexpr std::size_t kWaitingOutBytes = 64 * kMiB;
/// Maximum size of unstored results: some seconds of work of a fast cluster.
inline constexpr std::size_t kUnstoredBytes = 64 * kMiB;
/// Maximum number of running queries. Each uses a process and up to 256 MiB.
inline constexpr std::size_t kRunningQueries = 4;
/// Maximum number of points of all open studies; with more, sums of points could overflow. The
/// memory for a set of points depends on its number of intervals, not of points.
inline constexpr std::uint64_t kOpenPoints = 10'000'000'000'000;
/// Maximum number of batches that a worker may request at a time. If one worker held more, other
/// workers might have none.
inline constexpr std::uint32_t kCredit = 1024;

// ---- Connections ------------------------------------------------------------------------------

/// Maximum total size of received messages that are incomplete or that the server has not taken.
inline constexpr std::size_t kHeldInBytes = 512 * kMiB;
/// Maximum total size of incomplete and untaken messages at one port. Above it the server reads
/// from no peer of the port.
inline constexpr std::size_t kHeldInToPauseBytes = 64 * kMiB;
/// A peer is busy if more output than this waits to be sent to it. A busy peer gets no batch, and
/// its requests are not read.
inline constexpr std::size_t kBusyBytes = 4 * kMiB;
inline constexpr std::size_t kAllWaitingOutBytes = 512 * kMiB;
/// Maximum number of simultaneous handshakes. One source address may have half of them, so that it
/// cannot block others.
inline constexpr std::size_t kHandshakes = 1024;
inline constexpr std::size_t kHandshakesOfSource = kHandshakes / 2;

// ---- Writes -----------------------------------------------------------------------------------

/// Maximum number of unstored writes for which no client waits, because small ones use memory too.
inline constexpr std::size_t kUnstoredWrites = 80'000;
/// Maximum number of unstored changes of clients, and maximum size of their recipes.
inline constexpr std::size_t kUnstoredChanges = 10'000;
inline constexpr std::size_t kUnstoredBytesOfChanges = 64 * kMiB;
/// Maximum number of requests for one study that wait until a change of the study is stored.
inline constexpr std::size_t kDeferredRequests = 1000;

// ---- Requests of clients ----------------------------------------------------------------------

/// A longer request is parsed on the check thread, because parsing takes more than a millisecond.
inline constexpr std::size_t kLongestInlineRequest = std::size_t{64} << 10U;
/// Maximum number and total size of long requests that wait for the check thread.
inline constexpr std::size_t kWaitingChecks = 64;
inline constexpr std::size_t kWaitingCheckBytes = 64 * kMiB;
/// Maximum number of studies or workers in a reply, and the approximate maximum size of the reply.
/// Such a reply takes the service's thread only some milliseconds.
inline constexpr std::uint32_t kListed = 1000;
inline constexpr std::size_t kListedBytes = kMiB;
/// Maximum number of studies that are neither done nor cancelled. Each needs some kilobytes.
inline constexpr std::size_t kOpenStudies = 100'000;

/// Maximum number of recipes that the page requests at a time, and of recipes in its cache. Each
/// has up to 16 MiB, and more when parsed.
inline constexpr std::size_t kRecipesOfPage = 4;

// ---- Queries ----------------------------------------------------------------------------------

/// Maximum number of running queries of one client, so that another client's query starts at once.
inline constexpr std::size_t kRunningQueriesOfClient = 2;
/// Maximum numbers of waiting queries, in all and per client, and their maximum memory in all. One
/// query may have a megabyte.
inline constexpr std::size_t kWaitingQueries = 64;
inline constexpr std::size_t kWaitingQueriesOfClient = 16;
inline constexpr std::size_t kWaitingQueryBytes = 16 * kMiB;

// ---- Traces -----------------------------------------------------------------------------------

/// Maximum number of traces that workers solve at a time. Each may return a message of 16 MiB.
inline constexpr std::size_t kRunningTraces = 2;
/// Maximum number of waiting requests for traces, and of running checks of points to trace.
inline constexpr std::size_t kWaitingTraces = 64;
/// Maximum number of traces that the page requests or sends at a time. Further requests wait.
inline constexpr std::size_t kTracesOfPage = 4;
/// Time from the request for a trace to its answer, including waiting: default and maximum.
inline constexpr std::int64_t kTraceTime_ms = 60'000;
inline constexpr std::int64_t kLongestTraceTime_ms = 600'000;

}  // namespace oblique::server::limits
