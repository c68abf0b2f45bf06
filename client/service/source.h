#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// Default database of queries and of `run`.
struct DatabaseSettings {
  std::string file{"oblique.db"};
  std::int64_t timeout_ms = 60'000;  ///< per statement
};

/// A query for the results of a study. Its texts are SQL over the columns of the view `runs`.
struct ResultQuery {
  std::string study = {};
  std::string where = {};  ///< empty: all points
  /// Columns; default: the axes that vary and the main outputs; for groups, `group` and count(*).
  std::string select = {};
  std::string group = {};                  ///< columns to group by; empty: no groups
  std::string order = {};                  ///< default: by point number, or by `group`
  std::optional<std::int64_t> limit = {};  ///< nothing: all rows
};

/// Throws solver::InputError, with the flag, for a negative limit and for texts that are not part
/// of a statement; see check_sql_part.
void check(const ResultQuery& query);

protocol::QueryRequest request_for(const ResultQuery& query);

/// The rows of an answer in chunks (proto/wire), as they arrive. The source must outlive the stream
/// and answers no other call until the stream ends. The destructor stops the query.
class RowStream {
 public:
  virtual ~RowStream() = default;

  /// Waits for the next chunk, which is valid. The last chunk has `ends` set; without it the answer
  /// is incomplete. Throws the errors of the source, also in the middle of an answer. Must not be
  /// called after the last chunk.
  virtual protocol::QueryReply next() = 0;
};

/// Receives a message for people.
using Tell = std::function<void(const std::string& sentence)>;

/// Where results come from: a database file, or a server (Connection).
class Source {
 public:
  virtual ~Source() = default;
  /// Runs a read-only statement or a StudyQuery. Throws solver::InputError for a wrong statement,
  /// and the errors of the source. The stream may throw them later, with the first chunk.
  virtual std::unique_ptr<RowStream> rows(protocol::QueryRequest request) = 0;
  /// Returns the whole answer to one statement. Use it only for answers that fit into memory.
  protocol::Table query(const std::string& sql);
  /// Returns the status of the study called `study`, or of all studies if `study` is empty. Throws
  /// for an unknown name. With a `tell`, waits for an unreachable server; see Connection.
  virtual std::vector<protocol::StudyStatus> status(const std::string& study, const Tell& tell) = 0;
  std::vector<protocol::StudyStatus> status(const std::string& study) { return status(study, {}); }
  /// Returns the status of the study with this number, even if it was renamed. Throws
  /// std::runtime_error, whose text contains `name`, if the study does not exist.
  virtual protocol::StudyStatus status_of(std::uint64_t study_id, const std::string& name,
                                          const Tell& tell);
  /// StatusReply.access of the last status: which peers may connect; empty for a file.
  virtual std::string access() const { return {}; }
  /// Name of the source in messages: "oblique.db" or "tcp://127.0.0.1:7600".
  virtual std::string place() const = 0;
};

/// Opens a database file to read it directly. While rows are read, a server cannot truncate the
/// write-ahead log of the database. If a single SQL function exceeds the time limit, its thread
/// runs until the process ends.
std::unique_ptr<Source> open_database(const std::string& file,
                                      std::int64_t timeout_ms = DatabaseSettings().timeout_ms);

}  // namespace oblique::client
