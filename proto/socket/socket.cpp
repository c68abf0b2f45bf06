#include "proto/socket/socket.h"

#include <cstdint>

#include <zmq.hpp>

#include "proto/frames.h"

namespace oblique::protocol {

void prepare_dealer(zmq::socket_t& socket, int linger_ms, int shortest_pause_ms,
                    int longest_pause_ms) {
  constexpr KeepAlive kKeepAlive;
  socket.set(zmq::sockopt::linger, linger_ms);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(kMaxFrameBytes));
  socket.set(zmq::sockopt::reconnect_ivl, shortest_pause_ms);
  socket.set(zmq::sockopt::reconnect_ivl_max, longest_pause_ms);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, kKeepAlive.idle_s);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, kKeepAlive.interval_s);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, kKeepAlive.probes);
  socket.set(zmq::sockopt::tcp_maxrt, kKeepAlive.unacknowledged_ms);
}

}  // namespace oblique::protocol
