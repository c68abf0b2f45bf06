#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "tests/support/programs.h"
#include "tests/system/tcp_proxy.h"

namespace oblique::test {

/// Kind of a storm. A storm repeats one kind of fault while undisturbed workers solve a study. No
/// point may fail because of a storm.
enum class StormKind {
  kKilledWorkers,   ///< a worker is killed shortly after each start
  kCutConnections,  ///< the connection of a worker is cut repeatedly
  kVanishingPeers   ///< peers that take batches and disappear, each under a new name
};

class Storm {
 public:
  /// Starts the storm. `server_url` is the server's address for workers; `environment` is for the
  /// processes that the storm starts.
  Storm(StormKind kind, const TemporaryFolder& folder, const std::string& server_url,
        const Environment& environment = {});
  ~Storm();
  Storm(const Storm&) = delete;
  Storm& operator=(const Storm&) = delete;

  /// Returns the number of killed workers, cut connections, or peers that disappeared with points.
  int faults() const { return proxy_ ? proxy_->cuts() : faults_.load(); }
  /// Ends the storm and all its processes.
  void end();

 private:
  void kill_workers(const std::stop_token& stop);
  void let_peers_vanish(const std::stop_token& stop);

  const TemporaryFolder& folder_;
  std::string server_url_;
  Environment environment_;
  std::atomic<int> faults_ = 0;
  std::unique_ptr<TcpProxy> proxy_;
  std::unique_ptr<Worker> behind_proxy_;
  std::jthread thread_;  ///< declared last, because the thread uses the other members
};

}  // namespace oblique::test
