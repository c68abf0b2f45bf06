#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "client/output/printer.h"
#include "client/service/connection.h"
#include "proto/oblique.pb.h"

namespace oblique::client {

/// Name of the database where none is given, here and in `run`.
struct DatabaseSettings {
  std::string file{"oblique.db"};
  std::int64_t timeout_ms = 60'000;  ///< for one statement
};

/// Where answers come from: a database file or a server.
class Source {
 public:
  virtual ~Source() = default;
  /// Runs one statement that only reads. Throws solver::InputError for a wrong one, and what the
  /// source throws.
  virtual protocol::QueryReply query(const std::string& sql) = 0;
  /// The study of that name, or all of them when it is empty. Throws for an unknown name. Given a
  /// `tell`, waits for a server that is away; see Connection.
  virtual std::vector<protocol::StudyStatus> status(const std::string& study, const Tell& tell) = 0;
  std::vector<protocol::StudyStatus> status(const std::string& study) { return status(study, {}); }
  /// "oblique.db" or "tcp://127.0.0.1:7600", for messages.
  virtual std::string place() const = 0;
};

/// What --db, --server and --timeout said.
struct SourceFlags {
  std::string database;             ///< empty: not given
  std::string server;               ///< empty: not given
  std::optional<double> timeout_s;  ///< none: the default of what answers
};

/// Adds --server and --timeout. `flags` must live as long as `verb`.
void add_server_flags(CLI::App& verb, SourceFlags& flags);
/// Adds --db, --server and --timeout. `flags` must live as long as `verb`.
void add_source_flags(CLI::App& verb, SourceFlags& flags);

/// Adds --format.
void add_format_flag(CLI::App& verb, std::string& format);

/// Prints rows to standard output. When the source cut them off, says so on standard error and
/// gives kFailed, else kDone.
int print_whole(const protocol::QueryReply& rows, Format format);

/// The server that the flags name, else OBLIQUE_SERVER, else the default. Throws
/// solver::InputError for a timeout that is not positive.
ConnectionSettings connection_settings(const SourceFlags& flags);

/// Opens what the flags name: --db, else --server or OBLIQUE_SERVER, else oblique.db when it is in
/// this folder, else the server at its default address.
/// `keep_waiting` may end the wait for a server's answer; see Connection.
std::unique_ptr<Source> open_source(const SourceFlags& flags,
                                    Connection::KeepWaiting keep_waiting = {});

/// A database file, read directly. A statement that takes longer than `timeout_ms` is an error; one
/// that cannot be stopped then ends the program soon after.
std::unique_ptr<Source> open_database(const std::string& file,
                                      std::int64_t timeout_ms = DatabaseSettings().timeout_ms);

/// A text as SQL writes it, in single quotes.
std::string sql_text(const std::string& text);

}  // namespace oblique::client
