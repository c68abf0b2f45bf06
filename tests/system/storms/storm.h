#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "tests/support/programs.h"
#include "tests/system/tcp_proxy.h"

namespace oblique::test {

/// A storm: repeated faults of one kind around a server, in addition to sound workers. No point may
/// fail because of it.
enum class StormKind {
  kKilledWorkers,   ///< a worker is killed shortly after its start, again and again
  kCutConnections,  ///< the connection of a worker is cut again and again
  kVanishingPeers   ///< peers that take batches and disappear, each under a new name
};

class Storm {
 public:
  /// Starts the storm at the server with the workers' address `server_url`. `environment` is for
  /// the processes that it starts.
  Storm(StormKind kind, const TemporaryFolder& folder, const std::string& server_url,
        const Environment& environment = {});
  ~Storm();
  Storm(const Storm&) = delete;
  Storm& operator=(const Storm&) = delete;

  /// Number of killed workers, cut connections, or peers that disappeared with points.
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
  std::jthread thread_;  ///< last: it uses the other members
};

}  // namespace oblique::test
