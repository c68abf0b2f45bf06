#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "client/io/child_process.h"
#include "client/io/console.h"
#include "client/service/connection.h"
#include "client/service/run_service.h"
#include "client/service/source.h"
#include "client/study/study.h"
#include "proto/keys/key_file.h"
#include "proto/oblique.pb.h"
#include "proto/program/process.h"

namespace oblique::client {

/// A server and workers on this machine, for as long as this object lives.
struct ServiceSettings {
  std::filesystem::path database;
  int workers = 1;                      ///< processes, which share the cores
  bool allow_network_disk = false;      ///< the database may lie on a network file system
  std::string http = "off";             ///< where its page is: ADDRESS:PORT
  std::uint64_t fall_memory_bytes = 0;  ///< of all workers; 0: an eighth of what is free
  std::string only_study{};             ///< the others of the database wait; empty: all are solved
  bool verbose = false;                 ///< standard error of server and workers goes to ours
};

/// Why a server that was started on the database may not answer, as a sentence part.
std::string why_silent(const std::filesystem::path& database);

/// Keys for as long as this object lives, in a folder below TMPDIR that only its owner can read.
class EphemeralKeys {
 public:
  /// Throws std::runtime_error when they cannot be written.
  EphemeralKeys();
  ~EphemeralKeys();
  EphemeralKeys(const EphemeralKeys&) = delete;
  EphemeralKeys& operator=(const EphemeralKeys&) = delete;

  /// The key file of the program with that role.
  std::string file_of(protocol::Role role) const;

 private:
  std::string folder_;
};

/// Starts `oblique-server` on loopback, at ports that the system picks, and workers; ends them all
/// when destroyed. The same programs and messages as on many machines.
class EmbeddedService {
 public:
  /// Waits until the server listens, then starts the workers. Throws ProcessError with the last
  /// words of what failed, Interrupted when `stop` is requested meanwhile.
  EmbeddedService(const ServiceSettings& settings, protocol::StopSignals& stop);
  ~EmbeddedService() { stop(); }
  EmbeddedService(const EmbeddedService&) = delete;
  EmbeddedService& operator=(const EmbeddedService&) = delete;

  /// Where clients connect.
  const std::string& client_url() const { return client_url_; }
  /// Their key: other users of this machine reach the ports too.
  protocol::KeyFile client_key() const {
    return protocol::read_key_file(keys_.file_of(protocol::Role::kClient));
  }
  /// The address of the page, with the token that lets a browser in; empty without one.
  const std::string& page_url() const { return page_url_; }

  /// Throws ProcessError when the server or the last worker has ended.
  void check();
  /// The last words of workers that ended since the last call; or an empty text.
  std::string news();
  /// Ends the workers, then the server, which stores their results first; kills what does not end
  /// in time.
  void stop();

 private:
  void start_server(const ServiceSettings& settings, protocol::StopSignals& stop);
  void start_worker(const ServiceSettings& settings);

  EphemeralKeys keys_;
  std::unique_ptr<ChildProcess> server_;
  std::vector<std::unique_ptr<ChildProcess>> workers_;
  std::set<pid_t> reported_;  ///< workers whose end `news` has returned
  std::string client_url_;
  std::string worker_url_;
  std::string page_url_;
};

/// Why the workers of an EmbeddedService do not solve the rest of a study, and what to do; or
/// empty.
std::string objection_to_waiting(const protocol::StudyStatus& status);

/// How `run` runs a study, and `paper` its cases.
struct RunSettings {
  ServiceSettings service{.database = DatabaseSettings().file};
  bool no_reuse = false;   ///< as in SubmitSettings
  std::int64_t rows = 30;  ///< most rows of results fetched at the end
};

/// Adds --workers, --fall-memory and --verbose. `settings` must live as long as `command`.
void add_worker_flags(CLI::App& command, RunSettings& settings);

/// Throws solver::InputError, naming the flag and what is allowed, for a number of workers or rows
/// that cannot be.
void check_settings(const RunSettings& settings);

/// How a study ended.
struct RunEnd {
  protocol::StudyStatus status;
  std::vector<protocol::QueryReply> rows;  ///< chunks of the first results
  int exit_code;                           ///< kDone when every point is solved
};

/// Starts server and workers here, submits the study, shows its progress and waits for its end;
/// nothing is left running. When `stop` is requested, prints how to continue and returns nothing.
/// Throws ProcessError when server or workers end too soon, ServerError when the study is refused.
std::optional<RunEnd> run_study(Console& console, const Study& study, const RunSettings& settings,
                                protocol::StopSignals& stop);

}  // namespace oblique::client
