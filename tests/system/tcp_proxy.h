#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

namespace oblique::test {

/// Forwards TCP connections on loopback to a server. It can delay, stall, silently drop or
/// repeatedly cut them.
class TcpProxy {
 public:
  /// Forwards to the server at the ZeroMQ address `server_url`. Bytes and ends of connections
  /// arrive `delay` later, in both directions. All connections are cut after each `cut_interval`,
  /// unless it is 0.
  explicit TcpProxy(const std::string& server_url, std::chrono::milliseconds delay = {},
                    std::chrono::milliseconds cut_interval = {});
  ~TcpProxy();
  TcpProxy(const TcpProxy&) = delete;
  TcpProxy& operator=(const TcpProxy&) = delete;

  /// Returns the ZeroMQ address of the proxy.
  std::string url() const;
  /// stall(true) stops forwarding. stall(false) forwards the bytes received meanwhile, and
  /// continues.
  void stall(bool holds) { stalls_ = holds; }
  /// Drops all bytes on the present connections, and also hides their ends, so that neither side
  /// gets anything from the other. Later connections are forwarded.
  void swallow() { ++swallowed_; }
  /// Returns the number of connections so far.
  int connections() const { return connections_; }
  /// Returns the number of cut connections so far.
  int cuts() const { return cuts_; }

 private:
  void run(const std::stop_token& stop);

  std::uint16_t server_port_;
  std::chrono::milliseconds delay_;
  std::chrono::milliseconds cut_interval_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> stalls_ = false;
  std::atomic<int> swallowed_ = 0;
  std::atomic<int> connections_ = 0;
  std::atomic<int> cuts_ = 0;
  std::jthread thread_;  ///< declared last, because the thread uses the other members
};

}  // namespace oblique::test
