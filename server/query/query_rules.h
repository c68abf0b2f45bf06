#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include <sqlite3.h>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// A statement was refused or failed. The message says why.
class QueryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The statement itself is wrong: running it again gives the same error.
class StatementError : public QueryError {
 public:
  using QueryError::QueryError;
};

/// Limits of one query.
struct QueryLimits {
  std::uint64_t max_row_bytes = 12ULL << 20U;  ///< of a row; below protocol::kMaxFrameBytes
  std::int64_t time_limit_ms = 30'000;         ///< for each chunk of the answer; 0: no limit
  /// Size of one text, blob or row inside the statement; at most SQLite's own limit of 10^9.
  std::int64_t max_value_bytes = std::int64_t{16} << 20U;
  /// The first row after this time completes its chunk, so that the first rows of a slow statement
  /// are returned early.
  std::int64_t longest_chunk_ms = 250;
};

/// Only SQLite's own limits, for statements of trusted programs.
inline constexpr QueryLimits kNoLimits{UINT64_MAX, 0, 1'000'000'000};

/// Longest time limit that a client can request.
inline constexpr std::int64_t kLongestTimeLimit_ms = 600'000;

/// Time that a client allows for each chunk of its answer.
std::int64_t time_limit_of(const protocol::QueryRequest& request);

/// Message of a query that took longer than `time_limit_ms`.
std::string took_too_long(std::int64_t time_limit_ms);

inline constexpr int kLongestSql = 1'000'000;  ///< longest statement [bytes]

/// Restricts statements on `database` to reading and computing in memory, limits their size, and
/// adds our functions. LIKE becomes case-sensitive, because in modes S is stick and s is slip.
void restrict_to_reading(sqlite3* database);

using StatementHandle = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

/// Prepares one statement that only reads. Throws StatementError for none or several statements,
/// for one that writes, attaches or changes settings, has parameters, or that SQLite refuses;
/// QueryError for one that needs too much memory.
StatementHandle prepare_query(sqlite3* database, const std::string& sql);

/// The error for a client after a call on `database` returned `code`.
QueryError failure(sqlite3* database, int code);

}  // namespace oblique::server
