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
#include "client/service/source.h"
#include "client/study/study.h"
#include "proto/keys/key_file.h"
#include "proto/oblique.pb.h"
#include "proto/program/process.h"

namespace oblique::client {

/// Settings of a temporary server with its workers.
struct ServiceSettings {
  std::filesystem::path database;
  int workers = 1;                      ///< number of worker processes, which share the cores
  bool allow_network_disk = false;      ///< permits a database on a network file system
  std::string http = "off";             ///< address of the web page: ADDRESS:PORT
  std::uint64_t fall_memory_bytes = 0;  ///< memory for all workers' falls; 0: 1/8 of free memory
  std::string only_study{};             ///< solves only this study; empty: all studies
  bool verbose = false;                 ///< server and workers write to our standard error
  Tell tell{};                          ///< receives what the server waits for before it is ready
};

/// Returns, as part of a sentence, why a server that was started on the database may not answer.
std::string why_silent(const std::filesystem::path& database);

/// Temporary keys in a folder below TMPDIR that only its owner can read.
class EphemeralKeys {
 public:
  /// Throws std::runtime_error if the keys cannot be written.
  EphemeralKeys();
  ~EphemeralKeys();
  EphemeralKeys(const EphemeralKeys&) = delete;
  EphemeralKeys& operator=(const EphemeralKeys&) = delete;

  /// Returns the key file for a role.
  std::string file_of(protocol::Role role) const;

 private:
  std::string folder_;
};

/// Starts an `oblique-server` on loopback, with ports chosen by the system, and workers. The
/// destructor ends all of them.
class EmbeddedService {
 public:
  /// Waits until the server listens, then starts the workers. Throws ProcessError, with the last
  /// output of the process, if one fails, and Interrupted when `stop` is requested.
  EmbeddedService(const ServiceSettings& settings, protocol::StopSignals& stop);
  ~EmbeddedService() { stop(); }
  EmbeddedService(const EmbeddedService&) = delete;
  EmbeddedService& operator=(const EmbeddedService&) = delete;

  /// Address for clients.
  const std::string& client_url() const { return client_url_; }
  /// The clients' key. It is needed because other users of this machine can reach the ports.
  protocol::KeyFile client_key() const {
    return protocol::read_key_file(keys_.file_of(protocol::Role::kClient));
  }
  /// Address of the web page with its access token; empty if there is no page.
  const std::string& page_url() const { return page_url_; }

  /// Throws ProcessError if the server or all workers have ended.
  void check();
  /// Returns the last output of workers that ended since the previous call, or an empty text.
  std::string news();
  /// Ends the workers, then the server, which first stores their results. Kills slow processes.
  void stop();

 private:
  void start_server(const ServiceSettings& settings, protocol::StopSignals& stop);
  void start_worker(const ServiceSettings& settings);

  EphemeralKeys keys_;
  std::unique_ptr<ChildProcess> server_;
  std::vector<std::unique_ptr<ChildProcess>> workers_;
  std::set<pid_t> reported_;  ///< ended workers that `news` has reported
  std::string client_url_;
  std::string worker_url_;
  std::string page_url_;
};

/// Explains why the workers of this service cannot solve the remaining points of a study, with the
/// remedy. Returns an empty text if they can.
std::string objection_to_waiting(const protocol::StudyStatus& status);

/// Settings for solving a study with a temporary server, for `run` and explorations.
struct RunSettings {
  ServiceSettings service{.database = DatabaseSettings().file};
  bool no_reuse = false;   ///< same as SubmitSettings::no_reuse
  std::int64_t rows = 30;  ///< number of result rows to fetch at the end
};

/// Adds --workers, --fall-memory and --verbose. `settings` must live as long as `command`.
void add_worker_flags(CLI::App& command, RunSettings& settings);

struct RunEnd {
  protocol::StudyStatus status;
  std::vector<protocol::QueryReply> rows;  ///< chunks that contain the first results
  int exit_code;                           ///< kDone if every point is solved
};

/// Starts server and workers, submits the study, shows its progress, waits for its end, and ends
/// all processes. When `stop` is requested, prints how to continue and returns nothing. Throws
/// ProcessError if the server or all workers end early, and ServerError if the server refuses the
/// study.
std::optional<RunEnd> run_study(Console& console, const Study& study, const RunSettings& settings,
                                protocol::StopSignals& stop);

}  // namespace oblique::client
