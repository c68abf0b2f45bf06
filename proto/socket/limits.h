#pragma once

namespace oblique::protocol {

/// How a connection whose other end is gone without a word is found, by workers, clients and the
/// server alike: by TCP, not by ZeroMQ's own heartbeats, for libzmq 4.3.4 ends its process when
/// these fire for a connection that is read no more and whose peer has gone (`Assertion failed:
/// !_io_error`).
struct KeepAlive {
  int idle_s = 10;                 ///< silence before the first probe
  int interval_s = 5;              ///< between probes
  int probes = 3;                  ///< unanswered, that end the connection
  int unacknowledged_ms = 20'000;  ///< what was sent and stays unacknowledged so long ends it too
};

/// Bytes that keys add to each frame (CURVE's MESSAGE): sockets must take frames so much longer.
inline constexpr int kSealBytes = 33;

}  // namespace oblique::protocol
