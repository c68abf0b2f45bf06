#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "tests/support/programs.h"
#include "tests/system/tcp_proxy.h"

namespace oblique::test {

/// What goes on around a server from the beginning of a storm to its end, beside sound workers. No
/// point may fail for it.
enum class StormKind {
  kKilledWorkers,   ///< a worker is killed a moment after it was started, again and again
  kCutConnections,  ///< the connection of a worker is cut again and again
  kVanishingPeers   ///< peers that take batches and vanish, each under a name of its own
};

class Storm {
 public:
  /// Against the server that awaits workers at `server_url`. `environment` is for the processes
  /// that are started.
  Storm(StormKind kind, const TemporaryFolder& folder, const std::string& server_url,
        const Environment& environment = {});
  ~Storm();
  Storm(const Storm&) = delete;
  Storm& operator=(const Storm&) = delete;

  /// Workers killed, connections cut, or peers that vanished with points.
  int blows() const { return proxy_ ? proxy_->cuts() : blows_.load(); }
  /// Ends it: nothing of it is left.
  void end();

 private:
  void kill_workers(const std::stop_token& stop);
  void let_peers_vanish(const std::stop_token& stop);

  const TemporaryFolder& folder_;
  std::string server_url_;
  Environment environment_;
  std::atomic<int> blows_ = 0;
  std::unique_ptr<TcpProxy> proxy_;
  std::unique_ptr<Worker> behind_proxy_;
  std::jthread thread_;  ///< last, as it uses the others
};

}  // namespace oblique::test
