#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"
#include "server/database/sqlite.h"
#include "server/query/query_rules.h"

namespace oblique::server {

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

  /// A remark if the database is read in an unusual way (open_for_reading); else empty.
  const std::string& remark() const { return remark_; }

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
  std::string remark_;
};

/// A blob as SQL writes it: x'0F..'.
std::string hexadecimal(std::string_view bytes);

}  // namespace oblique::server
