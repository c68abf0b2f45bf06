#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/service/connection.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

/// Name of the database where none is given, here and in `run`.
struct DatabaseSettings {
  std::string file{"oblique.db"};
  std::int64_t timeout_ms = 60'000;  ///< for one statement
};

/// The rows of an answer as they come, in chunks (proto/wire). Its source must outlive it and
/// answers nothing else until it has ended. One that is destroyed before ends the work at the
/// source.
class RowStream {
 public:
  virtual ~RowStream() = default;

  /// The next chunk, a sound one; it waits for it. `ends` is set in the last one: only then was all
  /// given. Throws what the source throws, also in the middle of an answer. Not to be called after
  /// the end.
  virtual protocol::QueryReply next() = 0;
};

/// Where answers come from: a database file or a server.
class Source {
 public:
  virtual ~Source() = default;
  /// The answer to a statement that only reads, or to a question, as it comes. Throws
  /// solver::InputError for a wrong one, and what the source throws, then or with the first chunk.
  virtual std::unique_ptr<RowStream> rows(protocol::QueryRequest request) = 0;
  /// The whole answer to one statement, however long.
  protocol::Table query(const std::string& sql);
  /// The study of that name, or all of them when it is empty. Throws for an unknown name. Given a
  /// `tell`, waits for a server that is away; see Connection.
  virtual std::vector<protocol::StudyStatus> status(const std::string& study, const Tell& tell) = 0;
  std::vector<protocol::StudyStatus> status(const std::string& study) { return status(study, {}); }
  /// The study of that number, whatever it is called by now; `study` was its name.
  virtual std::vector<protocol::StudyStatus> status_of(const std::string& study,
                                                       std::uint64_t study_id,
                                                       const Tell& tell) = 0;
  /// Who may come there, as StatusReply.access of the last status said; empty for a file.
  virtual std::string access() const { return {}; }
  /// "oblique.db" or "tcp://127.0.0.1:7600", for messages.
  virtual std::string place() const = 0;
};

/// A server. `keep_waiting` may end the wait for its answer; see Connection.
std::unique_ptr<Source> open_server(ConnectionSettings settings,
                                    Connection::KeepWaiting keep_waiting = {});

/// A database file, read directly. A statement that takes longer than `timeout_ms` is an error; one
/// that cannot be stopped then ends the program soon after.
std::unique_ptr<Source> open_database(const std::string& file,
                                      std::int64_t timeout_ms = DatabaseSettings().timeout_ms);

}  // namespace oblique::client
