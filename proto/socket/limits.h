#pragma once

namespace oblique::protocol {

/// TCP keepalive, by which workers, clients and the server detect a dead connection. ZeroMQ's
/// heartbeats are not used, because libzmq 4.3.4 aborts (`Assertion failed: !_io_error`) when one
/// fires for a connection that is not read and whose peer has gone.
struct KeepAlive {
  int idle_s = 10;     ///< silence before the first probe
  int interval_s = 5;  ///< time between probes
  int probes = 3;      ///< number of unanswered probes that end the connection
  /// sent data that stays unacknowledged for this time ends it too
  int unacknowledged_ms = 20'000;
};

/// Bytes that encryption adds to each frame (CURVE's MESSAGE), in addition to the largest frame.
inline constexpr int kSealBytes = 33;

}  // namespace oblique::protocol
