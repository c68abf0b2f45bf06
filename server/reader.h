#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/sqlite.h"

namespace oblique::server {

/// A statement was refused or failed. The message says why, for people.
class QueryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What one query may cost.
struct QueryLimits {
  std::uint64_t max_rows = 100'000;  ///< more are cut off, and `truncated` says so
  std::uint64_t max_bytes =
      12ULL << 20U;                     ///< of the reply, likewise; below protocol::kMaxFrameBytes
  std::int64_t time_limit_ms = 30'000;  ///< a longer query is an error; 0: no limit
};

/// No limits but memory: for a program that reads its own database.
inline constexpr QueryLimits kNoLimits{UINT64_MAX, UINT64_MAX, 0};

/// A database opened for reading only, also while a server writes it. Not thread-safe, but for
/// `interrupt`.
class Reader {
 public:
  /// Throws StorageError naming what was found: nothing, a directory, a foreign file, a newer
  /// schema, an unreadable file.
  explicit Reader(const std::string& path);

  /// Runs one statement that only reads. A blob comes as the text x'0F..', as does a text that is
  /// not UTF-8. Throws QueryError: no statement or more than one, one that writes, attaches or sets
  /// something, one that SQLite refuses, one over the time limit or interrupted.
  protocol::QueryReply query(const std::string& sql, const QueryLimits& limits);

  /// Where the study called `name` stands, or all of them when `name` is empty. Nothing is leased
  /// and the rate is 0, for that only a server knows. Throws QueryError for an unknown name.
  std::vector<protocol::StudyStatus> study_status(const std::string& name = {});

  /// Ends the query that runs, and all later ones. From any thread.
  void interrupt() { interrupted_ = true; }

 private:
  struct Deadline;

  DatabaseHandle database_;
  std::atomic<bool> interrupted_ = false;
};

}  // namespace oblique::server
