#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"
#include "proto/wire/chunk_writer.h"
#include "server/reading/query_limits.h"
#include "server/reading/query_rules.h"

namespace oblique::server {

/// An answer under way: rows of one statement, given in chunks. Between two chunks of one that
/// comes in the order of its points no transaction is open, and it goes on from the last point with
/// what the database holds then. Any other holds its transaction until it ends, which keeps the
/// write-ahead log of the database from being emptied.
class Answer {
 public:
  /// See Reader::answer, which makes them.
  Answer(sqlite3* database, protocol::QueryRequest request, const QueryLimits& limits,
         const std::atomic<bool>& interrupted);

  /// The next rows, some kChunkBytes of them, under the number of the chunk; `ends` is set in the
  /// last chunk, which may have no row. Throws QueryError when the statement fails, when it runs
  /// for longer than the time limit since the last chunk, and when one row has more than
  /// `max_bytes`. Not to be called after the end or a failure.
  protocol::QueryReply next();

  /// Ends its transaction until the next chunk is asked for; that is an error then unless
  /// `can_go_on`. From any thread, while no other call is under way.
  void rest();

  /// Whether it can be ended after any chunk and asked for again with `given`.
  bool can_go_on() const { return by_point_; }
  /// What was given until now.
  const protocol::GivenRows& given() const { return request_.after(); }

 private:
  void begin();
  /// The statement that answers what is left of the question.
  std::string planned();
  /// Steps to a row; false behind the last.
  bool step();
  void copy_row();

  sqlite3* database_;
  protocol::QueryRequest request_;  // its `after` is what was given
  QueryLimits limits_;
  const std::atomic<bool>& interrupted_;
  bool by_point_ = false;
  std::chrono::steady_clock::time_point begun_;            // the transaction
  StatementHandle statement_{nullptr, &sqlite3_finalize};  // null: to begin
  std::optional<protocol::ChunkWriter> rows_;              // once the columns are known
  int columns_ = 0;                                        // that are shown
  std::vector<std::string> units_;                         // of these, or none
  std::int64_t running_ms_ = 0;                            // in all
};

}  // namespace oblique::server
