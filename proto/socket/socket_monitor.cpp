#include "proto/socket/socket_monitor.h"

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string_view>

#include <spdlog/fmt/fmt.h>

namespace oblique::protocol {
namespace {

constexpr int kEvents = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                        ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL;

constexpr int kAttemptEvents = ZMQ_EVENT_CONNECTED | ZMQ_EVENT_CONNECT_RETRIED;

/// Lets libzmq tell `events` of `socket`, under a name that is free: that of a socket which was
/// closed just now may not be yet.
std::string monitored(zmq::socket_t& socket, int events) {
  for (int number = 0;; ++number) {
    std::string name = "inproc://connections-" + std::to_string(number);
    if (zmq_socket_monitor(socket.handle(), name.c_str(), events) == 0) {
      return name;
    }
    if (zmq_errno() != EADDRINUSE) {
      throw zmq::error_t();
    }
  }
}

/// What an event means that ended a handshake.
Rejection rejection_of(std::uint16_t event, std::uint32_t value) {
  if (event == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) {
    return value == ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH ? Rejection::kOtherMechanism
                                                               : Rejection::kNoServer;
  }
  constexpr std::uint32_t kTryLater = 300;
  constexpr std::uint32_t kNotAdmitted = 400;
  return value == kTryLater      ? Rejection::kForNow
         : value == kNotAdmitted ? Rejection::kKey
                                 : Rejection::kServersKey;
}

/// The key that was shown, and the file that it is from.
std::string key_of(const DealerSettings& settings) {
  return fmt::format("{}, a {}'s key called \"{}\", public key {}", settings.key->path,
                     name_of(settings.key->role), settings.key->name,
                     z85(settings.key->pair.public_key));
}

/// A server answers alike to unknown keys and to keys for its other port, and the address shows the
/// kind of port only where it is the usual one of this program.
std::string refused_key(const DealerSettings& settings) {
  constexpr std::array<std::string_view, 2> kKinds{"clients", "workers"};
  constexpr std::array<std::string_view, 2> kPorts{"7600", "7601"};
  const std::size_t ours = settings.is_worker ? 1 : 0;
  const std::size_t others = 1 - ours;
  const std::size_t role = settings.key->role == Role::kWorker ? 1 : 0;
  if (role != ours) {
    return fmt::format("it is for {}, and this port is for {}", kKinds.at(role), kKinds.at(ours));
  }
  const std::string_view port = std::string_view(settings.url).substr(settings.url.rfind(':') + 1);
  return fmt::format(
      "{}the key is not on the server's list, or was revoked. Where the server is, `oblique keys "
      "list` shows the list and `oblique keys add` adds to it",
      port == kPorts.at(ours)
          ? ""
          : fmt::format("either port {} is the server's port for {} (by default {}), and {} use "
                        "another one ({}); or ",
                        port, kKinds.at(others), kPorts.at(others), kKinds.at(ours),
                        kPorts.at(ours)));
}

}  // namespace

std::string sentence_of(Rejection rejection, const DealerSettings& settings) {
  const bool has_key = settings.key.has_value();
  const auto not_accepted = [&](const std::string& why) {
    return fmt::format("the server at {} did not accept this {}", settings.url,
                       has_key ? fmt::format("key ({}): {}", key_of(settings), why) : "program");
  };
  switch (rejection) {
    case Rejection::kKey:
      return not_accepted(has_key ? refused_key(settings) : "");
    case Rejection::kServersKey:
      return not_accepted(fmt::format(
          "the public key of the server in that file, {}, is not its own, which its log shows at "
          "the start",
          has_key ? z85(settings.key->server.value_or(CurveKey{})) : ""));
    case Rejection::kOtherMechanism:
      return has_key ? not_accepted(
                           "it has no keys. Start it with --keys, or leave out --keys and "
                           "OBLIQUE_KEYS here to connect unencrypted")
                     : fmt::format(
                           "the server at {} requires a key, and none was given: name yours "
                           "with --keys FILE or OBLIQUE_KEYS",
                           settings.url);
    case Rejection::kForNow:
      return fmt::format(
          "the server at {} has no room at present: it, or this key, has as many connections as it "
          "may have",
          settings.url);
    case Rejection::kNoServer:
      break;
  }
  return fmt::format("the program at {} is not an oblique-server: check the address and port",
                     settings.url);
}

SocketMonitor::SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, bool with_attempts)
    : socket_(socket), events_(context, zmq::socket_type::pair) {
  const std::string name = monitored(socket_, kEvents | (with_attempts ? kAttemptEvents : 0));
  events_.set(zmq::sockopt::linger, 0);
  events_.connect(name);
}

SocketMonitor::~SocketMonitor() {
  zmq_socket_monitor(socket_.handle(), nullptr, 0);
}

void SocketMonitor::take_events() {
  zmq::message_t frame;
  while (events_.recv(frame, zmq::recv_flags::dontwait)) {
    // An event is two frames: its number and a value, and the address.
    std::uint16_t event = 0;
    std::uint32_t value = 0;
    if (!frame.more() || frame.size() != sizeof event + sizeof value) {
      continue;
    }
    std::memcpy(&event, frame.data(), sizeof event);
    std::memcpy(&value, frame.data<char>() + sizeof event, sizeof value);
    if (event == ZMQ_EVENT_CONNECTED) {
      attempts_.was_accepted = true;
    } else if (event == ZMQ_EVENT_CONNECT_RETRIED) {
      ++attempts_.failed;
    } else if (event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
      ++connections_;
      rejection_.reset();
    } else {
      rejection_ = rejection_of(event, value);
    }
  }
}

std::uint64_t SocketMonitor::connections() {
  take_events();
  return connections_;
}

SocketMonitor::Attempts SocketMonitor::attempts() {
  take_events();
  return attempts_;
}

std::optional<Rejection> SocketMonitor::rejection() {
  take_events();
  return rejection_;
}

}  // namespace oblique::protocol
