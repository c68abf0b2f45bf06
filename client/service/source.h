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

/// The database where none is named, also of `run`.
struct DatabaseSettings {
  std::string file{"oblique.db"};
  std::int64_t timeout_ms = 60'000;  ///< for one statement
};

/// What to show of the results of a study. Texts are SQL over the columns of the view `runs`.
struct ResultQuery {
  std::string study = {};
  std::string where = {};  ///< empty: all points
  /// Empty: the axes that vary and the main outputs, of a group its columns.
  std::string select = {};
  std::string group = {};  ///< columns of which each row has other values; empty: none
  std::string order = {};  ///< empty: by point, of a group by its columns
  std::optional<std::int64_t> limit = {};  ///< none: all rows
};

/// Throws solver::InputError, naming the flag, for a limit below 0 and for texts that are no part
/// of a statement; see check_sql_part.
void check(const ResultQuery& query);

protocol::QueryRequest request_for(const ResultQuery& query);

/// The rows of an answer as they come, in chunks (proto/wire). Its source must outlive it and
/// answers nothing else until it has ended. Destroying it earlier ends the work at the source.
class RowStream {
 public:
  virtual ~RowStream() = default;

  /// Waits for the next chunk, a sound one; `ends` is set in the last one: only then the answer is
  /// complete. Throws what the source throws, also in the middle of an answer. Not to be called
  /// after the end.
  virtual protocol::QueryReply next() = 0;
};

/// Receives a sentence for people.
using Tell = std::function<void(const std::string& sentence)>;

/// Where answers come from: a database file or a server (Connection).
class Source {
 public:
  virtual ~Source() = default;
  /// The answer to a statement that only reads, or to a StudyQuery, as it comes. Throws
  /// solver::InputError for a wrong one, and what the source throws, here or with the first chunk.
  virtual std::unique_ptr<RowStream> rows(protocol::QueryRequest request) = 0;
  /// The whole answer to one statement. For answers that fit into memory.
  protocol::Table query(const std::string& sql);
  /// The study of that name, or all of them when it is empty. Throws for an unknown name. Given a
  /// `tell`, waits for a server that is away; see Connection.
  virtual std::vector<protocol::StudyStatus> status(const std::string& study, const Tell& tell) = 0;
  std::vector<protocol::StudyStatus> status(const std::string& study) { return status(study, {}); }
  /// The study of that number, whatever its name is now. Throws std::runtime_error, with `name`,
  /// where there is none.
  virtual protocol::StudyStatus status_of(std::uint64_t study_id, const std::string& name,
                                          const Tell& tell);
  /// Who may use it, as StatusReply.access of the last status; empty for a file.
  virtual std::string access() const { return {}; }
  /// "oblique.db" or "tcp://127.0.0.1:7600", for messages.
  virtual std::string place() const = 0;
};

/// A database file, read directly. SQLite checks the time limit as it works, but a few functions
/// never do; these end by Ctrl-C alone. While rows are read, a server cannot truncate the
/// write-ahead log of the database.
std::unique_ptr<Source> open_database(const std::string& file,
                                      std::int64_t timeout_ms = DatabaseSettings().timeout_ms);

}  // namespace oblique::client
