#include "client/service/source_flags.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

constexpr const char* kServerVariable = "OBLIQUE_SERVER";
constexpr const char* kKeysVariable = "OBLIQUE_KEYS";

/// The server that a flag or the environment names; empty: none.
std::string server_named(const SourceFlags& flags) {
  return flags.server.empty() ? environment_variable(kServerVariable).value_or("") : flags.server;
}

std::string seconds(std::int64_t milliseconds) {
  return solver::exact_number(static_cast<double>(milliseconds) / 1000.0);
}

std::int64_t timeout_of(const SourceFlags& flags, std::int64_t default_ms) {
  constexpr double kLongest_s = 1e6;
  if (!flags.timeout_s) {
    return default_ms;
  }
  if (!(*flags.timeout_s > 0.0 && *flags.timeout_s <= kLongest_s)) {
    throw solver::InputError(
        fmt::format("--timeout {} is not allowed: it must be > 0 and at most {} s",
                    solver::exact_number(*flags.timeout_s), solver::exact_number(kLongest_s)));
  }
  return std::llround(std::ceil(*flags.timeout_s * 1000.0));
}

}  // namespace

void add_server_flags(CLI::App& verb, SourceFlags& flags) {
  verb.add_option("--server", flags.server,
                  fmt::format("address of the server; default: {}, else {}", kServerVariable,
                              ConnectionSettings().server_url))
      ->type_name("URL");
  verb.add_option(
          "--keys", flags.keys,
          fmt::format("key file for a server that has keys; default: {}, else none", kKeysVariable))
      ->type_name("FILE");
  verb.add_option("--timeout", flags.timeout_s,
                  fmt::format("longest wait for an answer [s]; default: {}",
                              seconds(ConnectionSettings().timeout_ms)))
      ->type_name("SECONDS");
}

void add_source_flags(CLI::App& verb, SourceFlags& flags) {
  auto* database = verb.add_option("--db", flags.database,
                                   fmt::format("database to read directly; default, unless a "
                                               "server is named: {} when it is in this folder",
                                               DatabaseSettings().file));
  database->type_name("FILE");
  flags.may_be_file = true;
  add_server_flags(verb, flags);
  verb.get_option("--timeout")
      ->description(fmt::format(
          "longest wait for an answer [s]; default: {} from a server, {} from a file",
          seconds(ConnectionSettings().timeout_ms), seconds(DatabaseSettings().timeout_ms)));
  database->excludes("--server");
  database->excludes("--keys");
}

void add_database_argument(CLI::App& verb, std::filesystem::path& file) {
  verb.add_option("--db,FILE", file, "the database; --db may be left out")
      ->type_name("FILE")
      ->capture_default_str();
}

ConnectionSettings connection_settings(Console& console, const SourceFlags& flags) {
  ConnectionSettings settings;
  settings.timeout_ms = timeout_of(flags, settings.timeout_ms);
  if (const std::string server = server_named(flags); !server.empty()) {
    settings.server_url = server;
  } else if (flags.may_be_file) {
    settings.if_silent = fmt::format(
        "there is no database {} in this folder, and no server at that address. Name a database "
        "with --db FILE, or a server with --server URL",
        DatabaseSettings().file);
  }
  const std::string keys =
      flags.keys.empty() ? environment_variable(kKeysVariable).value_or("") : flags.keys;
  console.detail(fmt::format("asks the server at {}{}", settings.server_url,
                             keys.empty() ? "" : fmt::format(" with the key {}", keys)));
  if (!keys.empty()) {
    settings.key = protocol::read_key_file(keys);
  }
  return settings;
}

std::string database_meant(const SourceFlags& flags) {
  const std::string file = DatabaseSettings().file;
  const bool is_default = server_named(flags).empty() && std::filesystem::exists(file);
  return flags.database.empty() && is_default ? file : flags.database;
}

std::unique_ptr<Source> open_source(Console& console, const SourceFlags& flags,
                                    Connection::KeepWaiting keep_waiting) {
  const auto database_timeout_ms = timeout_of(flags, DatabaseSettings().timeout_ms);
  if (const std::string database = database_meant(flags); !database.empty()) {
    console.detail(fmt::format("reads the database {} itself", database));
    return open_database(database, database_timeout_ms);
  }
  return std::make_unique<Connection>(connection_settings(console, flags), std::move(keep_waiting));
}

}  // namespace oblique::client
