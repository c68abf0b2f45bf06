#include "proto/socket/socket_monitor.h"

#include <cerrno>
#include <cstring>
#include <string>

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

}  // namespace

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
