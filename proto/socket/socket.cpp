#include "proto/socket/socket.h"

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <stop_token>
#include <thread>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/address.h"
#include "proto/frames.h"
#include "proto/socket/limits.h"
#include "worker/solver/model/errors.h"

namespace oblique::protocol {
namespace {

[[noreturn]] void refuse(const DealerSettings& settings, const std::string& error) {
  throw solver::InputError("server = \"" + settings.url + "\" is not an address: " + error +
                           ", as in " + settings.example_url);
}

void set_keys(zmq::socket_t& socket, const KeyFile& key) {
  if (!key.server) {
    throw solver::InputError(
        fmt::format("{} is the key of a server: give the program its own key, as "
                    "`oblique keygen` creates it",
                    key.path));
  }
  socket.set(zmq::sockopt::curve_serverkey, z85(*key.server));
  socket.set(zmq::sockopt::curve_publickey, z85(key.pair.public_key));
  socket.set(zmq::sockopt::curve_secretkey,
             zmq::const_buffer(key.pair.secret_key.data(), key.pair.secret_key.bytes().size()));
}

/// Returns why a server with keys has rejected our key. The server sends the same status for
/// unknown keys and for keys for its other port.
std::string rejection_reason(std::uint32_t status, const DealerSettings& settings) {
  constexpr std::uint32_t kNotAdmitted = 400;
  if (status != kNotAdmitted) {
    return "the server's public key in that file is wrong; the server logs the right one at its "
           "start";
  }
  if ((settings.key->role == Role::kWorker) != settings.is_worker) {
    return settings.is_worker ? "it is for clients, and this port is for workers"
                              : "it is for workers, and this port is for clients";
  }
  return fmt::format(
      "the key is not in the server's list, or this is not its port for {}. On the "
      "server, `oblique keys list` shows the list and `oblique keys add` adds to it",
      settings.is_worker ? "workers (by default 7601)" : "clients (by default 7600)");
}

}  // namespace

zmq::socket_t make_dealer(zmq::context_t& context, const DealerSettings& settings) {
  if (const auto error = address_error(settings.url); !error.empty()) {
    refuse(settings, error);
  }
  constexpr KeepAlive kKeepAlive;
  constexpr int kQueuedMessages = 1000;
  // Maximum time of one attempt to connect. Without this limit the kernel would double the pauses
  // between its own tries, and reconnecting could take a minute after the network is back.
  constexpr int kConnectTimeout_ms = 3000;
  // libzmq aborts if it cannot start its two threads. These two throw std::system_error instead.
  const auto wait = [](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      std::this_thread::yield();
    }
  };
  { const std::jthread first(wait), second(wait); }
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
  // libzmq resolves a name on its own thread, for only one IP version. This option selects it.
  const std::string host = host_of(settings.url);
  const bool is_v6 = host.find(':') != std::string::npos;
  try {
    socket.set(zmq::sockopt::ipv6, is_v6 || (is_name(host) && attempt % 2 == 1));
    socket.connect(settings.url);
  } catch (const zmq::error_t& error) {
    refuse(settings, std::string(error.what()) + ": write tcp://HOST:PORT");
  }
}

SocketMonitor::SocketMonitor(zmq::context_t& context, zmq::socket_t& socket,
                             DealerSettings settings)
    : socket_(socket), settings_(std::move(settings)), events_(context, zmq::socket_type::pair) {
  const int events = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                     ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL;
  const auto name = [](int number) { return "inproc://connections-" + std::to_string(number); };
  int number = 0;
  while (zmq_socket_monitor(socket_.handle(), name(number).c_str(), events) != 0) {
    if (zmq_errno() != EADDRINUSE) {  // the previous socket with this name is closing
      throw zmq::error_t();
    }
    ++number;
  }
  events_.set(zmq::sockopt::linger, 0);
  events_.connect(name(number));
}

SocketMonitor::~SocketMonitor() {
  zmq_socket_monitor(socket_.handle(), nullptr, 0);
}

void SocketMonitor::take_events() {
  zmq::message_t frame;
  while (events_.recv(frame, zmq::recv_flags::dontwait)) {
    // An event has two frames: the first has its number and a value, the second the address.
    std::uint16_t event = 0;
    std::uint32_t value = 0;
    if (!frame.more() || frame.size() != sizeof event + sizeof value) {
      continue;
    }
    std::memcpy(&event, frame.data(), sizeof event);
    std::memcpy(&value, frame.data<char>() + sizeof event, sizeof value);
    if (event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
      ++connections_;
      failure_.reset();
    } else {
      failure_ = {event, value};
    }
  }
}

std::uint64_t SocketMonitor::connections() {
  take_events();
  return connections_;
}

std::optional<std::string> SocketMonitor::rejection() {
  constexpr std::uint32_t kTryLater = 300;
  take_events();
  if (!failure_) {
    return std::nullopt;
  }
  const auto& key = settings_.key;
  if (failure_->event == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH && failure_->value == kTryLater) {
    return fmt::format(
        "the server at {} has too many connections, in all or from this key: try again later",
        settings_.url);
  }
  const bool is_mismatch = failure_->value == ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH;
  if (failure_->event == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL && !is_mismatch) {
    return fmt::format("the program at {} is not an oblique-server: check the address and port",
                       settings_.url);
  }
  if (!key) {
    return fmt::format("the server at {} {}", settings_.url,
                       is_mismatch
                           ? "requires a key, and none was given: give yours with --keys FILE or "
                             "OBLIQUE_KEYS"
                           : "did not accept this program");
  }
  return fmt::format(
      "the server at {} did not accept this key ({}, a {}'s key called \"{}\", public key {}): {}",
      settings_.url, key->path, name_of(key->role), key->name, z85(key->pair.public_key),
      is_mismatch
          ? "it has no keys. Start it with --keys, or leave out --keys and OBLIQUE_KEYS here "
            "to connect unencrypted"
          : rejection_reason(failure_->value, settings_));
}

}  // namespace oblique::protocol
