#pragma once

#include <cstdint>
#include <string>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// What one query may cost.
struct QueryLimits {
  std::uint64_t max_rows = 100'000;  ///< more are cut off, and `truncated` says so
  std::uint64_t max_bytes =
      12ULL << 20U;  ///< of the reply, likewise; below protocol::kMaxFrameBytes
  /// A query that runs for longer is an error; of an answer in chunks, longer without giving one.
  /// 0: no limit.
  std::int64_t time_limit_ms = 30'000;
  /// Bytes of one text, blob or row on the way to the answer; at most SQLite's own limit of 10^9.
  std::int64_t max_value_bytes = std::int64_t{16} << 20U;
  /// An answer in chunks that cannot be gone on with later is an error when it ran for longer in
  /// all; 0: no limit.
  std::int64_t longest_in_all_ms = 600'000;
};

/// No limits but SQLite's own: for a program that trusts its statement.
inline constexpr QueryLimits kNoLimits{UINT64_MAX, UINT64_MAX, 0, 1'000'000'000, 0};

/// When a chunk of an answer is given: with so many bytes, or with a row that came so long after
/// the chunk was begun, so that whoever looks at the first rows need not wait for many.
inline constexpr std::uint64_t kChunkBytes = std::uint64_t{256} << 10U;
inline constexpr std::int64_t kLongestChunk_ms = 250;

/// An answer that holds its transaction and of which nothing is taken is ended when the write-ahead
/// log, which cannot be emptied meanwhile, has so many bytes.
inline constexpr std::uint64_t kLongLogBytes = std::uint64_t{256} << 20U;

/// Bytes of the write-ahead log of the database at `path`; 0: there is none.
std::uint64_t log_bytes(const std::string& path);

/// The longest time that a client can have by asking for it.
inline constexpr std::int64_t kLongestTimeLimit_ms = 600'000;

/// What SQLite may allocate in a reader process. All that a query needs is memory: nothing is
/// sorted or gathered in files.
inline constexpr std::int64_t kReaderHeapBytes = std::int64_t{256} << 20U;

/// The default limits, and what `request` says of them where it may.
QueryLimits limits_of(const protocol::QueryRequest& request);

/// Says, for people, that a query took longer than `time_limit_ms`.
std::string took_too_long(std::int64_t time_limit_ms);

}  // namespace oblique::server
