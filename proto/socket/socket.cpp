#include "proto/socket/socket.h"

#include <cstdint>

#include "proto/address.h"
#include "proto/frames.h"
#include "proto/socket/limits.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

[[noreturn]] void refuse(const DealerSettings& settings, const std::string& objection) {
  throw solver::InputError("server = \"" + settings.url + "\" is not an address: " + objection +
                           ", as in " + settings.example_url);
}

}  // namespace

zmq::socket_t made_dealer(zmq::context_t& context, const DealerSettings& settings) {
  if (const auto objection = objection_to_address(settings.url); !objection.empty()) {
    refuse(settings, objection);
  }
  constexpr KeepAlive kKeepAlive;
  zmq::socket_t socket(context, zmq::socket_type::dealer);
  socket.set(zmq::sockopt::linger, settings.linger_ms);
  socket.set(zmq::sockopt::immediate, !settings.queues_unconnected);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(kMaxFrameBytes) + kSealBytes);
  socket.set(zmq::sockopt::sndhwm, kQueuedMessages);
  socket.set(zmq::sockopt::rcvhwm, kQueuedMessages);
  socket.set(zmq::sockopt::reconnect_ivl, settings.shortest_pause_ms);
  socket.set(zmq::sockopt::reconnect_ivl_max, settings.longest_pause_ms);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, kKeepAlive.idle_s);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, kKeepAlive.interval_s);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, kKeepAlive.probes);
  socket.set(zmq::sockopt::tcp_maxrt, kKeepAlive.unacknowledged_ms);
  return socket;
}

void connect(zmq::socket_t& socket, const DealerSettings& settings) {
  try {
    socket.connect(settings.url);
  } catch (const zmq::error_t& error) {
    refuse(settings, std::string(error.what()) + ": write tcp://HOST:PORT");
  }
}

}  // namespace oblique::protocol
