#include "proto/socket/socket.h"

#include <cstdint>

#include <spdlog/fmt/fmt.h>

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

/// Whether this attempt to connect is by IPv6. For that libzmq has to be told: it asks for
/// addresses of one family only, and, for IPv6, for such of IPv4 where a name has none.
bool is_by_v6(const std::string& url, unsigned attempt) {
  const auto [has_v4, has_v6] = families_of(host_of(url));
  return has_v6 && (!has_v4 || attempt % 2 == 1);
}

void set_keys(zmq::socket_t& socket, const KeyFile& key) {
  if (!key.server) {
    throw solver::InputError(
        fmt::format("{} is the key of a server: programs that connect to one take their own, as "
                    "`oblique keygen` makes them",
                    key.path));
  }
  socket.set(zmq::sockopt::curve_serverkey, z85(*key.server));
  socket.set(zmq::sockopt::curve_publickey, z85(key.pair.public_key));
  socket.set(zmq::sockopt::curve_secretkey,
             zmq::const_buffer(key.pair.secret_key.data(), key.pair.secret_key.bytes().size()));
}

}  // namespace

zmq::socket_t made_dealer(zmq::context_t& context, const DealerSettings& settings) {
  if (const auto objection = objection_to_address(settings.url); !objection.empty()) {
    refuse(settings, objection);
  }
  constexpr KeepAlive kKeepAlive;
  zmq::socket_t socket(context, zmq::socket_type::dealer);
  if (settings.key) {
    set_keys(socket, *settings.key);
  }
  socket.set(zmq::sockopt::linger, settings.linger_ms);
  socket.set(zmq::sockopt::immediate, !settings.queues_unconnected);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(kMaxFrameBytes) + kSealBytes);
  socket.set(zmq::sockopt::sndhwm, kQueuedMessages);
  socket.set(zmq::sockopt::rcvhwm, kQueuedMessages);
  socket.set(zmq::sockopt::reconnect_ivl, settings.shortest_pause_ms);
  socket.set(zmq::sockopt::reconnect_ivl_max, settings.longest_pause_ms);
  socket.set(zmq::sockopt::connect_timeout, kConnectTimeout_ms);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, kKeepAlive.idle_s);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, kKeepAlive.interval_s);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, kKeepAlive.probes);
  socket.set(zmq::sockopt::tcp_maxrt, kKeepAlive.unacknowledged_ms);
  return socket;
}

void connect(zmq::socket_t& socket, const DealerSettings& settings, unsigned attempt) {
  try {
    socket.set(zmq::sockopt::ipv6, is_by_v6(settings.url, attempt));
    socket.connect(settings.url);
  } catch (const zmq::error_t& error) {
    refuse(settings, std::string(error.what()) + ": write tcp://HOST:PORT");
  }
}

void connect_again(zmq::socket_t& socket, const DealerSettings& settings, unsigned attempt) {
  socket.disconnect(settings.url);
  connect(socket, settings, attempt);
}

}  // namespace oblique::protocol
