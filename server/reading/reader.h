#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/database/sqlite.h"
#include "server/reading/answer.h"
#include "server/reading/query_limits.h"
#include "server/reading/query_rules.h"

namespace oblique::server {

/// A database opened for reading only, also while a server writes it. Not thread-safe, but for
/// `interrupt`.
class Reader {
 public:
  /// Throws StorageError naming what was found: nothing, a directory, a foreign file, another
  /// schema, an unreadable file.
  explicit Reader(const std::string& path);

  /// What there is to say of how the database is read (see open_for_reading); mostly nothing.
  const std::string& remark() const { return remark_; }

  /// Runs one statement that only reads. A blob comes as the text x'0F..', as does a text that is
  /// not UTF-8. Throws QueryError: what `prepare_query` says, one over the time limit or
  /// interrupted, one that needs more memory than there is or than SQLite's heap limit, a row that
  /// has more than `max_bytes` alone.
  protocol::QueryReply query(const std::string& sql, const QueryLimits& limits);

  /// The same as the bytes of an encoded QueryReply, which takes hardly more memory than those.
  std::string encoded_query(const std::string& sql, const QueryLimits& limits);

  /// The answer to `request`, to be taken in chunks, after what `request.after()` says was given.
  /// Throws as `query` does, and solver::InputError for a wrong question. The reader must outlive
  /// it and answers nothing else meanwhile.
  Answer answer(const protocol::QueryRequest& request, const QueryLimits& limits);

  /// Where the study called `name` stands, or all of them when `name` is empty. Nothing is leased
  /// and the rate is 0, for that only a server knows. Throws QueryError for an unknown name.
  std::vector<protocol::StudyStatus> study_status(const std::string& name = {});

  /// Ends the query that runs, and all later ones. From any thread.
  void interrupt() { interrupted_ = true; }

 private:
  std::string nearest_study(const std::string& name);
  using TakeRow = std::function<void(protocol::Row&)>;

  /// Gives columns and `truncated`; each row goes to `take`.
  protocol::QueryReply run(const std::string& sql, const QueryLimits& limits, const TakeRow& take);

  DatabaseHandle database_;
  std::string remark_;
  std::atomic<bool> interrupted_ = false;
};

}  // namespace oblique::server
