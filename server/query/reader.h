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

/// Size at which a chunk of an answer is returned.
inline constexpr std::uint64_t kChunkBytes = std::uint64_t{256} << 10U;

/// When a statement must end. SQLite checks it as long as the statement runs.
struct TimeLimit {
  std::atomic<bool> is_interrupted = false;
  std::int64_t end_ms = INT64_MAX;  ///< of the steady clock
};

/// The rows of one statement, returned in chunks. Holds a read transaction until it ends or is
/// destroyed, during which the database cannot truncate its write-ahead log.
class Answer {
 public:
  Answer(sqlite3* database, const protocol::QueryRequest& request, const QueryLimits& limits,
         TimeLimit& time);

  /// The next chunk, with its number from 1 on; `ends` is set in the last one, which may have no
  /// rows. A blob is returned as the text x'0F..', as is a text that is not UTF-8. Throws
  /// QueryError when the statement fails, when this call takes longer than the time limit, and when
  /// a row is longer than `max_row_bytes`. Not to be called after the end or a failure.
  protocol::QueryReply next();

 private:
  void start_time();
  bool step();
  void copy_row();

  sqlite3* database_;
  QueryLimits limits_;
  TimeLimit& time_;
  std::int64_t start_ms_ = 0;  // of the call of `next`
  StatementHandle statement_{nullptr, &sqlite3_finalize};
  std::vector<std::string> units_;             // of the columns; may be empty
  std::optional<protocol::ChunkWriter> rows_;  // set by the constructor
  std::uint64_t chunks_ = 0;
};

/// A database opened for reading only; a server may write to it. Not thread-safe except
/// `interrupt`.
class Reader {
 public:
  /// Throws StorageError, which names the reason: no file, a directory, a foreign file, another
  /// schema, an unreadable file.
  explicit Reader(const std::string& path);

  /// Starts the answer to `request`. Throws what `prepare_query` and `plan` throw. The reader must
  /// outlive the answer and must not be used otherwise until then.
  Answer answer(const protocol::QueryRequest& request, const QueryLimits& limits);

  /// The whole answer to one statement, as `rows` of one reply. Throws what Answer throws.
  protocol::Table query(const std::string& sql, const QueryLimits& limits);

  /// Status of the study called `name`, or of all when `name` is empty. Leases and rate are 0,
  /// because only a server has them. Throws QueryError for an unknown name.
  std::vector<protocol::StudyStatus> study_status(const std::string& name = {});

  /// Ends the running query and all later ones. May be called from any thread.
  void interrupt() { time_.is_interrupted = true; }

 private:
  TimeLimit time_;
  DatabaseHandle database_;
};

/// A blob as SQL writes it: x'0F..'.
std::string hexadecimal(std::string_view bytes);

}  // namespace oblique::server
