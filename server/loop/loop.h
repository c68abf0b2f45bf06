#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/network/access.h"
#include "server/network/network.h"
#include "server/service/service.h"
#include "server/web/web.h"

namespace oblique::server {

/// How the loop is.
struct LoopTurn {
  enum class Stage { kRuns, kDrains, kEnds };
  Stage stage;
  std::size_t workers;
  std::size_t leases;  ///< batches that are with workers
};

struct LoopSettings {
  std::string database;              ///< file
  bool allow_network_disk = false;   ///< the file may lie on a network file system
  AccessSettings access;             ///< to both ports
  std::string worker_port = "7601";  ///< "*": the system picks one
  std::string client_port = "7600";
  QueryPoolSettings queries;
  NetworkLimits network;
  std::optional<WebSettings> web;  ///< database and solver version are those of the server
  /// When it is told to stop, it waits so long for results under way; 0: it ends at once.
  std::chrono::milliseconds drain{0};
  /// Called on the loop's thread several times a second, and once as the loop ends.
  std::function<void(const LoopTurn&)> on_turn = [](const LoopTurn&) {};
  ServiceSettings service;  ///< solver_version must be set; the rest from the database
};

/// What the loop ended with.
struct LoopEnd {
  std::size_t lost_writes;  ///< changes that could not be made durable
  bool lost_database;       ///< it was deleted or replaced, and so the server ended
};

/// The server: its network, the writer and the readers of queries, and one loop that feeds the
/// service with what comes from them. Logs to spdlog's default logger.
class Loop {
 public:
  /// Opens the database and binds both sockets. Throws StorageError, also for a file on a network
  /// file system, solver::InputError for an address that may not be listened on, and
  /// std::runtime_error for one that cannot.
  explicit Loop(LoopSettings settings);
  ~Loop();
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  /// As ZeroMQ endpoints with the ports that are really used.
  std::string client_endpoint() const;
  std::string worker_endpoint() const;
  /// As http://127.0.0.1:7602; empty: nothing is shown over HTTP.
  std::string http_url() const;
  /// The address of the page with its token; empty without HTTP.
  std::string page_url() const;

  /// Runs until `stop_fd` becomes readable, or a little longer than the database is there; then
  /// tells the workers, makes what was received durable, acknowledges it and returns.
  /// With `drain` it first waits for results under way, when `take_stop` reads `stop_fd`, so that
  /// a second request can be told from the first: that one ends it at once.
  LoopEnd run(int stop_fd, const std::function<void()>& take_stop = {});

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace oblique::server
