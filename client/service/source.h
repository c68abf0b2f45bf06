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

/// The default database, also of `run`.
struct DatabaseSettings {
  std::string file{"oblique.db"};
  std::int64_t timeout_ms = 60'000;  ///< per statement
};

/// A query of a study's results. Texts are SQL over the columns of the view `runs`.
struct ResultQuery {
  std::string study = {};
  std::string where = {};  ///< empty: all points
  /// Empty: the axes that vary and the main outputs; for groups their columns.
  std::string select = {};
  std::string group = {};                  ///< columns to group by; empty: none
  std::string order = {};                  ///< empty: by point; for groups by their columns
  std::optional<std::int64_t> limit = {};  ///< none: all rows
};

/// Throws solver::InputError, with the flag, for a negative limit and for texts that are not a part
/// of a statement; see check_sql_part.
void check(const ResultQuery& query);

protocol::QueryRequest request_for(const ResultQuery& query);

/// The rows of an answer in chunks (proto/wire), as they arrive. Its source must outlive it and
/// answers nothing else until it ends. The destructor stops the query.
class RowStream {
 public:
  virtual ~RowStream() = default;

  /// Waits for the next chunk, which is valid. `ends` is set in the last one; without it the answer
  /// is incomplete. Throws what the source throws, also in the middle of an answer. Must not be
  /// called after the end.
  virtual protocol::QueryReply next() = 0;
};

/// Receives a message for people.
using Tell = std::function<void(const std::string& sentence)>;

/// A database file or a server (Connection).
class Source {
 public:
  virtual ~Source() = default;
  /// Runs a statement that only reads, or a StudyQuery. Throws solver::InputError for a wrong one,
  /// and what the source throws, here or with the first chunk.
  virtual std::unique_ptr<RowStream> rows(protocol::QueryRequest request) = 0;
  /// The whole answer to one statement, for answers that fit into memory.
  protocol::Table query(const std::string& sql);
  /// The study of that name, or all studies if it is empty. Throws for an unknown name. With a
  /// `tell`, waits for an unreachable server; see Connection.
  virtual std::vector<protocol::StudyStatus> status(const std::string& study, const Tell& tell) = 0;
  std::vector<protocol::StudyStatus> status(const std::string& study) { return status(study, {}); }
  /// The study of that number, whatever its present name. Throws std::runtime_error, with `name`,
  /// if it does not exist.
  virtual protocol::StudyStatus status_of(std::uint64_t study_id, const std::string& name,
                                          const Tell& tell);
  /// StatusReply.access of the last status: who may use the server; empty for a file.
  virtual std::string access() const { return {}; }
  /// "oblique.db" or "tcp://127.0.0.1:7600", for messages.
  virtual std::string place() const = 0;
};

/// A database file, read directly. SQLite checks the time limit while it works, except in a few
/// functions; only Ctrl-C ends these. While rows are read, a server cannot truncate the write-ahead
/// log of the database.
std::unique_ptr<Source> open_database(const std::string& file,
                                      std::int64_t timeout_ms = DatabaseSettings().timeout_ms);

}  // namespace oblique::client
