#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

namespace oblique::test {

/// Forwards TCP connections on loopback to a server: slowly, with stalls, with silent losses, or
/// cut again and again.
class TcpProxy {
 public:
  /// Forwards to the server at this ZeroMQ address. All bytes and ends of connections arrive
  /// `delay` later in both directions. All connections are cut after each `cut_interval`, unless it
  /// is 0.
  explicit TcpProxy(const std::string& server_url, std::chrono::milliseconds delay = {},
                    std::chrono::milliseconds cut_interval = {});
  ~TcpProxy();
  TcpProxy(const TcpProxy&) = delete;
  TcpProxy& operator=(const TcpProxy&) = delete;

  /// Its ZeroMQ address.
  std::string url() const;
  /// While true, nothing is forwarded; received bytes are forwarded afterwards.
  void stall(bool holds) { stalls_ = holds; }
  /// Drops all data on the current connections, also their ends, so that each side gets no sign of
  /// the other. New connections are forwarded.
  void swallow() { ++swallowed_; }
  /// Number of connections so far.
  int connections() const { return connections_; }
  /// Number of cut connections so far.
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
  std::jthread thread_;  ///< last: it uses the other members
};

}  // namespace oblique::test
