#include "server/network/connection.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "proto/socket/limits.h"

namespace oblique::server {
namespace {

static_assert(CurveTraffic::kAddedBytes == protocol::kSealBytes);

constexpr std::size_t kReadBytes = 64 * 1024;
/// Of a peer whose handshake is not done.
constexpr std::size_t kReadOfStranger_bytes = 4 * 1024;

void set(int socket, int level, int option, int value) {
  // A peer that is gone already may make this fail; reading tells.
  static_cast<void>(setsockopt(socket, level, option, &value, sizeof value));
}

bool would_block() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

}  // namespace

Connection::Connection(protocol::Descriptor socket, const PortGuard* guard)
    : socket_(std::move(socket)), zmtp_(guard) {
  constexpr protocol::KeepAlive kKeepAlive;
  const int fd = socket_.number();
  set(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  set(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set(fd, IPPROTO_TCP, TCP_KEEPIDLE, kKeepAlive.idle_s);
  set(fd, IPPROTO_TCP, TCP_KEEPINTVL, kKeepAlive.interval_s);
  set(fd, IPPROTO_TCP, TCP_KEEPCNT, kKeepAlive.probes);
  set(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, kKeepAlive.unacknowledged_ms);
}

Connection::Read Connection::read() {
  std::array<char, kReadBytes> bytes;
  const std::size_t most = zmtp_.is_open() ? bytes.size() : kReadOfStranger_bytes;
  const ssize_t count = ::recv(socket_.number(), bytes.data(), most, 0);
  if (count < 0 && would_block()) {
    return Read::kNothingYet;
  }
  if (count <= 0) {
    return Read::kEnd;
  }
  zmtp_.receive({bytes.data(), static_cast<std::size_t>(count)});
  send_answers();
  return Read::kBytes;
}

void Connection::send_answers() {
  const std::string answers = zmtp_.take_answers();
  if (can_send_ && !answers.empty()) {
    out_ += answers;
    flush();
  }
}

ZmtpMessage Connection::take_message() {
  ZmtpMessage message = zmtp_.take_message();
  send_answers();
  return message;
}

void Connection::do_work() {
  zmtp_.do_work();
  send_answers();
}

void Connection::send(std::string_view body) {
  const std::string header = zmtp_.header_or_sealed(body);
  if (zmtp_.seals()) {
    body = {};
  }
  std::size_t taken = 0;
  if (waiting_out_bytes() == 0) {
    // The system copies; sendmsg only reads what it is given.
    std::array<iovec, 2> parts{{{const_cast<char*>(header.data()), header.size()},
                                {const_cast<char*>(body.data()), body.size()}}};
    msghdr message{};
    message.msg_iov = parts.data();
    message.msg_iovlen = parts.size();
    const ssize_t count = ::sendmsg(socket_.number(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0 && !would_block()) {
      sending_failed();
      return;
    }
    taken = static_cast<std::size_t>(std::max<ssize_t>(count, 0));
  }
  const std::size_t of_header = std::min(taken, header.size());
  out_ += std::string_view(header).substr(of_header);
  out_ += body.substr(taken - of_header);
}

void Connection::flush() {
  while (waiting_out_bytes() > 0) {
    const ssize_t count = ::send(socket_.number(), out_.data() + sent_, waiting_out_bytes(),
                                 MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0 && !would_block()) {
      sending_failed();
      return;
    }
    if (count < 0) {
      break;
    }
    sent_ += static_cast<std::size_t>(count);
  }
  if (waiting_out_bytes() == 0) {
    out_ = {};
    sent_ = 0;
  } else if (sent_ > out_.size() / 2) {
    out_.erase(0, std::exchange(sent_, 0));
  }
}

void Connection::sending_failed() {
  can_send_ = false;
  out_ = {};
  sent_ = 0;
}

}  // namespace oblique::server
