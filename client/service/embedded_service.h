#pragma once

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "client/service/child_process.h"
#include "client/service/keys_for_a_run.h"
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
  bool verbose = false;                 ///< what server and workers say goes to our standard error
};

/// Why a server that was started on the database may not answer, as a sentence part.
std::string why_silent(const std::filesystem::path& database);

/// Starts `oblique-server` on loopback, at ports that the system picks, and workers that ask it
/// for work; ends them all when destroyed. The same programs and messages as on many machines.
class EmbeddedService {
 public:
  /// Waits until the server listens, then starts the workers. Throws ProcessError with the last
  /// words of what failed, Interrupted when `stop` is requested meanwhile.
  EmbeddedService(const ServiceSettings& settings, protocol::StopSignals& stop);
  ~EmbeddedService();
  EmbeddedService(const EmbeddedService&) = delete;
  EmbeddedService& operator=(const EmbeddedService&) = delete;

  /// Where clients connect.
  const std::string& client_url() const { return client_url_; }
  /// The address of the page, with the token that lets a browser in; empty without one.
  const std::string& page_url() const { return page_url_; }
  /// With which they do: the service has keys of its own, for other users of this machine reach
  /// its ports too.
  protocol::KeyFile client_key() const {
    return protocol::read_key_file(keys_.file_of(protocol::Role::kClient));
  }

  /// Throws ProcessError when the server or the last worker has ended.
  void check();

  /// What a worker that ended said, each told once; empty when none has ended since.
  std::string news();

  /// Asks all to end, workers first so that the server can take in what they have, and kills what
  /// does not end in time. Nothing is left behind.
  void stop();

 private:
  void wait_until_ready(const Descriptor& ready, const ServiceSettings& settings,
                        protocol::StopSignals& stop);

  KeysForARun keys_;
  std::unique_ptr<ChildProcess> server_;
  std::vector<std::unique_ptr<ChildProcess>> workers_;
  std::set<pid_t> reported_;  ///< workers whose end `news` has told
  std::string client_url_;
  std::string worker_url_;
  std::string page_url_;
};

}  // namespace oblique::client
