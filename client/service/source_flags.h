#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "client/io/console.h"
#include "client/service/connection.h"
#include "client/service/source.h"

namespace oblique::client {

/// What --db, --server and --timeout said.
struct SourceFlags {
  std::string database;             ///< empty: not given
  std::string server;               ///< empty: not given
  std::optional<double> timeout_s;  ///< none: the default of what answers
  std::string keys = {};            ///< file; empty: not given
  bool may_be_file = false;         ///< the command has --db
};

/// Adds --server, --keys and --timeout. `flags` must live as long as `verb`.
void add_server_flags(CLI::App& verb, SourceFlags& flags);
/// Adds --db, --server, --keys and --timeout. `flags` must live as long as `verb`.
void add_source_flags(CLI::App& verb, SourceFlags& flags);

/// Adds the database file that a verb works on, as --db FILE or as a word of its own.
void add_database_argument(CLI::App& verb, std::filesystem::path& file);

/// The server that the flags name, else OBLIQUE_SERVER, else the default; and the key of the file
/// that they name, else OBLIQUE_KEYS, else none. Throws solver::InputError for a timeout that is
/// not positive and a key file that cannot be used.
ConnectionSettings connection_settings(Console& console, const SourceFlags& flags);

/// The database that the flags name: --db, or oblique.db when it is in this folder and no server is
/// named; empty: a server is meant.
std::string database_meant(const SourceFlags& flags);

/// Opens the database of `database_meant`, else the server of `connection_settings`, whose answers
/// `keep_waiting` may end the wait for; see Connection.
std::unique_ptr<Source> open_source(Console& console, const SourceFlags& flags,
                                    Connection::KeepWaiting keep_waiting = {});

}  // namespace oblique::client
