#pragma once

#include <string>

namespace zmq {
class socket_t;
}

namespace oblique::protocol {

/// How a connection whose other end is gone without a word is found: by TCP, not by ZeroMQ's own
/// heartbeats, for libzmq 4.3.4 ends its process when these fire for a connection that is read no
/// more and whose peer has gone (`Assertion failed: !_io_error`).
struct KeepAlive {
  int idle_s = 10;     ///< silence before the first probe
  int interval_s = 5;  ///< between probes
  int probes = 3;      ///< unanswered, that end the connection
  int unacknowledged_ms =
      20'000;  ///< what was sent and is not acknowledged for so long ends it too
};

/// Sets on a DEALER socket, before it connects, what those of workers and clients have in common:
/// the largest frame, keepalive, and how long it pauses between attempts to connect.
/// @param linger_ms  what is not sent yet is still sent for so long after closing
void prepare_dealer(zmq::socket_t& socket, int linger_ms, int shortest_pause_ms,
                    int longest_pause_ms);

}  // namespace oblique::protocol
