#include "client/service/source.h"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <utility>

#include "client/service/time_guard.h"
#include "proto/program/exit_code.h"
#include "proto/text.h"
#include "server/database/database_in_use.h"
#include "server/reading/reader.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

constexpr const char* kServerVariable = "OBLIQUE_SERVER";

std::string server_of_environment() {
  const char* value = std::getenv(kServerVariable);
  return value == nullptr ? std::string() : std::string(value);
}

double seconds(std::int64_t milliseconds) {
  return static_cast<double>(milliseconds) / 1000.0;
}

std::int64_t timeout_of(const SourceFlags& flags, std::int64_t default_ms) {
  constexpr double kLongest_s = 1e6;
  if (!flags.timeout_s) {
    return default_ms;
  }
  if (!(*flags.timeout_s > 0.0 && *flags.timeout_s <= kLongest_s)) {
    throw solver::InputError("--timeout " + solver::exact_number(*flags.timeout_s) +
                             " is not allowed: it must be > 0 and at most " +
                             solver::exact_number(kLongest_s) + " s");
  }
  return std::llround(std::ceil(*flags.timeout_s * 1000.0));
}

class DatabaseSource : public Source {
 public:
  DatabaseSource(std::string file, std::int64_t timeout_ms)
      : file_(std::move(file)), reader_(file_) {
    limits_.time_limit_ms = timeout_ms;
    // One for the whole process, which has nothing else in SQLite.
    sqlite3_hard_heap_limit64(kHeapBytes);
    if (!reader_.remark().empty()) {
      std::cerr << protocol::visible(reader_.remark()) << ".\n";
    }
  }

  protocol::QueryReply query(const std::string& sql) override {
    // Some functions of SQL do not look at the clock.
    constexpr std::chrono::milliseconds kGrace{500};
    const TimeGuard guard(std::chrono::milliseconds(limits_.time_limit_ms) + kGrace,
                          "oblique: " + server::took_too_long(limits_.time_limit_ms));
    try {
      return reader_.query(sql, limits_);
    } catch (const server::StatementError& error) {
      throw solver::InputError(error.what());
    }
  }
  std::vector<protocol::StudyStatus> status(const std::string& study, const Tell&) override {
    try {
      auto found = reader_.study_status(study);
      if (!server::is_in_use(file_)) {
        say_that_nobody_works(found);
      }
      return found;
    } catch (const server::QueryError& error) {
      throw server::QueryError(std::string(error.what()) + " in " + file_);
    }
  }
  std::string place() const override { return file_; }

 private:
  void say_that_nobody_works(std::vector<protocol::StudyStatus>& studies) const {
    for (auto& study : studies) {
      if (study.state() == "running") {
        study.set_waits_for("a server: nobody is at work on " + file_);
      }
    }
  }

  static constexpr std::int64_t kHeapBytes = std::int64_t{1} << 30U;

  std::string file_;
  server::Reader reader_;
  // Nobody else is kept waiting, and an answer may be as long as memory is.
  server::QueryLimits limits_{UINT64_MAX, UINT64_MAX, 0, std::int64_t{64} << 20U};
};

class ServerSource : public Source {
 public:
  ServerSource(ConnectionSettings settings, Connection::KeepWaiting keep_waiting)
      : connection_(std::move(settings), std::move(keep_waiting)) {}

  protocol::QueryReply query(const std::string& sql) override { return connection_.query(sql); }
  std::vector<protocol::StudyStatus> status(const std::string& study, const Tell& tell) override {
    const auto reply = connection_.status(study, tell);
    return {reply.studies().begin(), reply.studies().end()};
  }
  std::string place() const override { return connection_.url(); }

 private:
  Connection connection_;
};

}  // namespace

void add_server_flags(CLI::App& verb, SourceFlags& flags) {
  verb.add_option("--server", flags.server,
                  std::string("address of the server; default: ") + kServerVariable + ", else " +
                      ConnectionSettings().server_url)
      ->type_name("URL");
  verb.add_option("--timeout", flags.timeout_s,
                  "longest wait for an answer [s]; default: " +
                      solver::exact_number(seconds(ConnectionSettings().timeout_ms)))
      ->type_name("SECONDS");
}

void add_source_flags(CLI::App& verb, SourceFlags& flags) {
  auto* database = verb.add_option(
      "--db", flags.database,
      "database to read directly; default, unless a server is named: " + DatabaseSettings().file +
          " when it is in this folder");
  database->type_name("FILE");
  add_server_flags(verb, flags);
  verb.get_option("--timeout")
      ->description("longest wait for an answer [s]; default: " +
                    solver::exact_number(seconds(ConnectionSettings().timeout_ms)) +
                    " from a server, " +
                    solver::exact_number(seconds(DatabaseSettings().timeout_ms)) + " from a file");
  database->excludes("--server");
}

void add_format_flag(CLI::App& verb, std::string& format) {
  verb.add_option("--format", format, "table, csv, json or markdown")
      ->type_name("FORMAT")
      ->capture_default_str();
}

int print_whole(const protocol::QueryReply& rows, Format format) {
  print_out(rows, format);
  if (!rows.truncated()) {
    return protocol::kDone;
  }
  std::cerr << "Only the first " << rows.rows_size()
            << " rows: the server sends no more at once. Narrow it with WHERE and LIMIT, or read "
               "the database itself with --db FILE.\n";
  return protocol::kFailed;
}

ConnectionSettings connection_settings(const SourceFlags& flags) {
  ConnectionSettings settings;
  settings.timeout_ms = timeout_of(flags, settings.timeout_ms);
  if (!flags.server.empty()) {
    settings.server_url = flags.server;
  } else if (const auto from_environment = server_of_environment(); !from_environment.empty()) {
    settings.server_url = from_environment;
  }
  return settings;
}

std::unique_ptr<Source> open_source(const SourceFlags& flags,
                                    Connection::KeepWaiting keep_waiting) {
  const auto database_timeout_ms = timeout_of(flags, DatabaseSettings().timeout_ms);
  if (!flags.database.empty()) {
    return open_database(flags.database, database_timeout_ms);
  }
  const bool server_named = !flags.server.empty() || !server_of_environment().empty();
  if (!server_named && std::filesystem::exists(DatabaseSettings().file)) {
    return open_database(DatabaseSettings().file, database_timeout_ms);
  }
  return std::make_unique<ServerSource>(connection_settings(flags), std::move(keep_waiting));
}

std::unique_ptr<Source> open_database(const std::string& file, std::int64_t timeout_ms) {
  return std::make_unique<DatabaseSource>(file, timeout_ms);
}

std::string sql_text(const std::string& text) {
  std::string quoted = "'";
  for (const char letter : text) {
    quoted.append(letter == '\'' ? 2 : 1, letter);
  }
  quoted += '\'';
  return quoted;
}

}  // namespace oblique::client
