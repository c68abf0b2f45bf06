#include "client/service/socket_monitor.h"

namespace oblique::client {
namespace {

// Each context has one monitored socket, so that the name is taken once.
constexpr const char* kEvents = "inproc://connections";

}  // namespace

SocketMonitor::SocketMonitor(zmq::context_t& context, zmq::socket_t& socket)
    : socket_(socket), events_(context, zmq::socket_type::pair) {
  if (zmq_socket_monitor(socket_.handle(), kEvents, ZMQ_EVENT_HANDSHAKE_SUCCEEDED) != 0) {
    throw zmq::error_t();
  }
  events_.set(zmq::sockopt::linger, 0);
  events_.connect(kEvents);
}

SocketMonitor::~SocketMonitor() {
  zmq_socket_monitor(socket_.handle(), nullptr, 0);
}

std::uint64_t SocketMonitor::connections() {
  zmq::message_t frame;
  while (events_.recv(frame, zmq::recv_flags::dontwait)) {
    // An event is two frames: its number, and the address.
    if (!frame.more()) {
      ++connections_;
    }
  }
  return connections_;
}

}  // namespace oblique::client
