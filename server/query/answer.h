#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"
#include "proto/wire/chunk_writer.h"
#include "server/reading/query_rules.h"

namespace oblique::server {

/// Size at which a chunk of an answer is returned. A chunk is also returned with the first row that
/// comes kLongestChunk_ms after the chunk was begun, so that a reader of the first rows need not
/// wait for many.
inline constexpr std::uint64_t kChunkBytes = std::uint64_t{256} << 10U;
inline constexpr std::int64_t kLongestChunk_ms = 250;

/// The rows of one statement, returned in chunks. Holds a read transaction until it ends or is
/// destroyed, during which the database cannot truncate its write-ahead log.
class Answer {
 public:
  /// See Reader::answer.
  Answer(sqlite3* database, const protocol::QueryRequest& request, const QueryLimits& limits,
         const std::atomic<bool>& interrupted);

  /// The next chunk, with its number from 1 on; `ends` is set in the last one, which may have no
  /// row. A blob is returned as the text x'0F..', as is a text that is not UTF-8. Throws QueryError
  /// when the statement fails, when this call takes longer than the time limit, and when a row is
  /// longer than `max_row_bytes`. Not to be called after the end or a failure.
  protocol::QueryReply next();

 private:
  bool step();
  void copy_row();

  sqlite3* database_;
  QueryLimits limits_;
  const std::atomic<bool>& interrupted_;
  StatementHandle statement_{nullptr, &sqlite3_finalize};
  int columns_ = 0;                            // those that are returned
  std::vector<std::string> units_;             // of these, or none
  std::optional<protocol::ChunkWriter> rows_;  // set by the constructor
  std::uint64_t chunks_ = 0;
};

/// As SQL writes a blob: x'0F..'.
std::string hexadecimal(std::string_view bytes);

}  // namespace oblique::server
