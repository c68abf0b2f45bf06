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

/// An attempt to connect that is not answered is given up after this and made anew. The system
/// would wait ever longer between its own, up to a minute after the network is back.
inline constexpr int kConnectTimeout_ms = 3000;

/// Messages that a worker's or client's socket keeps in either direction.
inline constexpr int kQueuedMessages = 1000;

/// What keys add to each frame on its way (CURVE's MESSAGE): sockets must take frames so much
/// longer than the longest.
inline constexpr int kSealBytes = 33;

/// Connections that wait until the server accepts them.
inline constexpr int kWaitingConnections = 1024;

}  // namespace oblique::protocol
