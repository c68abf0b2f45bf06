#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "proto/system/descriptor.h"
#include "server/network/zmtp.h"

namespace oblique::server {

/// One peer's TCP connection: what came and was not taken, what is to go out and did not. Nothing
/// here waits.
class Connection {
 public:
  /// Takes over a non-blocking TCP socket. The guard is as for `Zmtp`.
  Connection(protocol::Descriptor socket, const PortGuard* guard);

  /// Sends the server's greeting.
  void greet() { send_answers(); }
  enum class Read { kBytes, kNothingYet, kEnd };
  /// Reads once from the socket.
  Read read();
  /// Sends a message, or what the system takes of it; the rest is kept.
  void send(std::string_view body);
  /// Sends what is kept.
  void flush();
  /// The peer still takes what it is sent. What it sent before may be left to read when it does
  /// not.
  bool can_send() const { return can_send_; }

  /// What the peer said: messages, work that waits, who it is, faults.
  const Zmtp& said() const { return zmtp_; }
  ZmtpMessage take_message();
  void do_work();
  int descriptor() const { return socket_.number(); }
  /// Memory for what has come and was not taken.
  std::size_t held_in_bytes() const { return zmtp_.held_bytes(); }
  /// Bytes that the system has not taken yet.
  std::size_t waiting_out_bytes() const { return out_.size() - sent_; }

 private:
  void send_answers();
  void sending_failed();

  protocol::Descriptor socket_;
  bool can_send_ = true;
  Zmtp zmtp_;
  std::string out_;
  std::size_t sent_ = 0;  // of `out_`
};

}  // namespace oblique::server
