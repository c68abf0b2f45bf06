#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

namespace oblique::test {

/// Passes TCP connections of the loopback device on to a server, and cuts all of them again and
/// again. Who is behind them does not notice but by that.
class CuttingProxy {
 public:
  /// Passes on to the server of that ZeroMQ address, and cuts after each `interval`.
  CuttingProxy(const std::string& server_url, std::chrono::milliseconds interval);
  ~CuttingProxy();
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;

  /// As ZeroMQ takes it.
  std::string url() const;
  /// Connections cut so far.
  int cuts() const { return cuts_; }

 private:
  void run(const std::stop_token& stop);

  std::uint16_t server_port_;
  std::chrono::milliseconds interval_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<int> cuts_ = 0;
  std::jthread thread_;  ///< last, as it uses the others
};

}  // namespace oblique::test
