#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

namespace oblique::test {

/// Passes TCP connections of the loopback device on to a server as a long or a bad line does. Who
/// is behind them does not notice but by that.
class SlowProxy {
 public:
  /// Passes on to the server of that ZeroMQ address; every byte and every end arrives `delay` after
  /// it came, in either direction.
  SlowProxy(const std::string& server_url, std::chrono::milliseconds delay);
  ~SlowProxy();
  SlowProxy(const SlowProxy&) = delete;
  SlowProxy& operator=(const SlowProxy&) = delete;

  /// As ZeroMQ takes it.
  std::string url() const;
  /// While it holds, nothing passes; afterwards everything does that came meanwhile.
  void stall(bool holds) { stalls_ = holds; }
  /// From now on whatever comes over the connections that there are is lost, their ends too: each
  /// side takes the other for silent. Connections that come later pass.
  void swallow() { ++swallowed_; }
  /// Connections made so far.
  int connections() const { return connections_; }

 private:
  void run(const std::stop_token& stop);

  std::uint16_t server_port_;
  std::chrono::milliseconds delay_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> stalls_ = false;
  std::atomic<int> swallowed_ = 0;
  std::atomic<int> connections_ = 0;
  std::jthread thread_;  ///< last, as it uses the others
};

}  // namespace oblique::test
