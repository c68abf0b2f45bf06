#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"
#include "server/database/sqlite.h"

namespace oblique::server {

/// A statement was refused or failed. The message has the reason.
class QueryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The statement is wrong, so running it again gives the same error.
class StatementError : public QueryError {
 public:
  using QueryError::QueryError;
};

class NoSuchStudy : public QueryError {
 public:
  using QueryError::QueryError;
};

/// Limits of one query.
struct QueryLimits {
  /// maximum size of a row; below protocol::kMaxFrameBytes
  std::uint64_t max_row_bytes = 12ULL << 20U;
  std::int64_t time_limit_ms = 30'000;  ///< time limit for each chunk of the answer; 0: no limit
  /// Maximum size of one text, blob or row inside the statement; at most SQLite's limit of 10^9.
  std::int64_t max_value_bytes = std::int64_t{16} << 20U;
  /// A chunk ends with the first row after this time, so that a slow statement's first rows come
  /// early.
  std::int64_t longest_chunk_ms = 250;
};

/// Limits of a query that a program runs on a file for its own user.
inline constexpr QueryLimits kNoLimits{UINT64_MAX, 0, std::int64_t{64} << 20U};

/// Maximum time limit that a client can request.
inline constexpr std::int64_t kLongestTimeLimit_ms = 600'000;

/// Returns the time limit of a request for each chunk of its answer.
std::int64_t time_limit_of(const protocol::QueryRequest& request);

/// Returns the error message for a query that took longer than `time_limit_ms`.
std::string took_too_long(std::int64_t time_limit_ms);

inline constexpr int kLongestSql = 1'000'000;  ///< maximum size of a statement [bytes]

/// Restricts statements on `database` to reading and to computing in memory, limits their size, and
/// adds our functions. Makes LIKE case-sensitive, because in a mode S means stick and s slip.
void restrict_to_reading(sqlite3* database);

using StatementHandle = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

/// Prepares one read-only statement. Throws StatementError if `sql` has no or several statements,
/// or if the statement writes, attaches, changes settings, has parameters, or is refused by SQLite.
/// Throws QueryError if the statement needs too much memory.
StatementHandle prepare_query(sqlite3* database, const std::string& sql);

/// Returns the error to report to a client after SQLite returned `code`.
QueryError failure(sqlite3* database, int code);

/// Size at which a chunk of an answer ends [bytes].
inline constexpr std::uint64_t kChunkBytes = std::uint64_t{256} << 10U;

/// Time limit of a statement, which SQLite checks while the statement runs.
struct TimeLimit {
  std::atomic<bool> is_interrupted = false;
  std::int64_t end_ms = INT64_MAX;  ///< end of the allowed time, on the steady clock
};

/// The rows of one statement in chunks. Holds a read transaction until it ends or is destroyed;
/// meanwhile the database cannot truncate its write-ahead log.
class Answer {
 public:
  Answer(sqlite3* database, const protocol::QueryRequest& request, const QueryLimits& limits,
         TimeLimit& time);

  /// Returns the next chunk, numbered from 1. The last chunk has `ends` set and may have no rows. A
  /// blob or a text that is not UTF-8 becomes the text x'0F..'. Throws QueryError if the statement
  /// fails, exceeds the time limit in this call, or has a row longer than `max_row_bytes`. Must not
  /// be called after the end or a failure.
  protocol::QueryReply next();

 private:
  void start_time();
  bool step();
  void copy_row();

  sqlite3* database_;
  QueryLimits limits_;
  TimeLimit& time_;
  std::int64_t start_ms_ = 0;  // time at which `next` was called
  StatementHandle statement_{nullptr, &sqlite3_finalize};
  std::vector<std::string> units_;             // units of the columns; may be empty
  std::optional<protocol::ChunkWriter> rows_;  // always set after construction
  std::uint64_t chunks_ = 0;
};

/// A database opened for reading only, while a server may write. Only `interrupt` is thread-safe.
class Reader {
 public:
  /// Throws StorageError if the file is missing, unreadable, foreign or of another schema.
  explicit Reader(const std::string& path);

  /// Starts the answer to `request`. Throws the errors of `prepare_query` and `plan`. The reader
  /// must outlive the answer and must not be used until the answer ends.
  Answer answer(const protocol::QueryRequest& request, const QueryLimits& limits);

  /// Returns the whole answer to one statement. Throws the errors of Answer.
  protocol::Table query(const std::string& sql, const QueryLimits& limits);

  /// Returns the status of the study called `name`, or of all studies if `name` is empty. Leases
  /// and points per second are 0, because only a server counts them. Throws QueryError for an
  /// unknown name.
  std::vector<protocol::StudyStatus> study_status(const std::string& name = {});

  /// Ends the running query and all later ones. Thread-safe.
  void interrupt() { time_.is_interrupted = true; }

 private:
  TimeLimit time_;
  DatabaseHandle database_;
};

/// Formats a blob as an SQL literal: x'0F..'.
std::string hexadecimal(std::string_view bytes);

}  // namespace oblique::server
