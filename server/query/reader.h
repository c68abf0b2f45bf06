#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/database/sqlite.h"
#include "server/reading/answer.h"
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

  /// The answer to `request`, to be taken in chunks. Throws QueryError: what `prepare_query` does,
  /// and for a plan that takes longer than the time limit; solver::InputError for a wrong question.
  /// The reader must outlive the answer and does nothing else meanwhile.
  Answer answer(const protocol::QueryRequest& request, const QueryLimits& limits);

  /// The whole answer to one statement, as `rows` of one reply. Throws what Answer throws.
  protocol::QueryReply query(const std::string& sql, const QueryLimits& limits);

  /// Where the study called `name` stands, or all of them when `name` is empty. Nothing is leased
  /// and the rate is 0, for that only a server knows. Throws QueryError for an unknown name.
  std::vector<protocol::StudyStatus> study_status(const std::string& name = {});

  /// Ends the query that runs, and all later ones. From any thread.
  void interrupt() { interrupted_ = true; }

 private:
  std::string nearest_study(const std::string& name);

  DatabaseHandle database_;
  std::string remark_;
  std::atomic<bool> interrupted_ = false;
};

}  // namespace oblique::server
