#pragma once

namespace oblique::protocol {

/// Settings of TCP keepalive, by which workers, clients and the server detect a dead connection.
/// ZeroMQ's heartbeats are not used, because libzmq 4.3.4 aborts (`Assertion failed: !_io_error`)
/// if one is due on a connection that is not read and whose peer has gone.
struct KeepAlive {
  int idle_s = 10;     ///< silence before the first probe [s]
  int interval_s = 5;  ///< time between two probes [s]
  int probes = 3;      ///< number of unanswered probes that end the connection
  /// time after which unacknowledged data ends the connection too [ms]
  int unacknowledged_ms = 20'000;
};

/// Number of bytes that encryption (CURVE's MESSAGE) adds to a frame. The maximum size of a frame
/// does not include them.
inline constexpr int kSealBytes = 33;

}  // namespace oblique::protocol
