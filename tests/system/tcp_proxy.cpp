#include "tests/system/tcp_proxy.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <deque>
#include <list>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "proto/system/descriptor.h"

namespace oblique::test {
namespace {

using Clock = std::chrono::steady_clock;
using protocol::Descriptor;
constexpr int kLongestPoll_ms = 5;
/// Maximum number of buffered bytes per direction; a full buffer stops reading. The limit is so
/// high that a delay does not reduce the rate.
constexpr std::size_t kMaxUnderWay = std::size_t{4} << 20U;

sockaddr_in on_loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

const sockaddr* any_address(const sockaddr_in& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

/// Bytes received from one side and not yet sent to the other.
class Direction {
 public:
  bool takes_more() const { return !has_end_ && bytes_ < kMaxUnderWay; }

  /// Reads the available bytes, which are forwarded at `due`.
  void take(int from, Clock::time_point due) {
    std::string bytes(65536, '\0');
    const ssize_t count = recv(from, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (count < 0 && errno == EAGAIN) {
      return;
    }
    has_end_ = count <= 0;
    bytes.resize(has_end_ ? 0 : static_cast<std::size_t>(count));
    bytes_ += bytes.size();
    under_way_.push_back({due, std::move(bytes)});
  }

  /// Sends the bytes that are due. Returns false after the end of the connection.
  bool pass_on(int to, Clock::time_point now) {
    while (!under_way_.empty() && under_way_.front().due <= now) {
      std::string& bytes = under_way_.front().bytes;
      const ssize_t count = send(to, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (bytes.empty() || (count < 0 && errno != EAGAIN)) {
        return false;
      }
      const std::size_t sent = count < 0 ? 0 : static_cast<std::size_t>(count);
      bytes_ -= sent;
      bytes.erase(0, sent);
      if (!bytes.empty()) {
        return true;  // the receiver's buffer is full
      }
      under_way_.pop_front();
    }
    return true;
  }

  void forget() {
    under_way_.clear();
    bytes_ = 0;
  }

 private:
  struct Piece {
    Clock::time_point due;
    std::string bytes;  ///< empty: the sender has closed the connection
  };
  std::deque<Piece> under_way_;
  std::size_t bytes_ = 0;
  bool has_end_ = false;
};

/// A forwarded connection: the sockets to peer and server, and the bytes between them.
struct Line {
  Descriptor peer;
  Descriptor server;
  Direction to_server = {};
  Direction to_peer = {};
  bool is_swallowed = false;

  /// Forwards bytes in both directions. Returns false if either connection has ended.
  bool move(Clock::time_point now, std::chrono::milliseconds delay, bool stalls) {
    for (auto [direction, from, to] :
         {std::tuple(&to_server, &peer, &server), std::tuple(&to_peer, &server, &peer)}) {
      if (direction->takes_more()) {
        direction->take(from->number(), now + delay);
      }
      if (is_swallowed) {
        direction->forget();
      } else if (!stalls && !direction->pass_on(to->number(), now)) {
        return false;
      }
    }
    return true;
  }
};

std::optional<Line> accepted(int listener, std::uint16_t server_port) {
  Line line{Descriptor(accept4(listener, nullptr, nullptr, SOCK_CLOEXEC)),
            Descriptor(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0))};
  const sockaddr_in address = on_loopback(server_port);
  if (!line.peer.is_open() ||
      connect(line.server.number(), any_address(address), sizeof address) != 0) {
    return std::nullopt;
  }
  const int yes = 1;
  for (const Descriptor* end : {&line.peer, &line.server}) {
    static_cast<void>(setsockopt(end->number(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes));
  }
  return line;
}

}  // namespace

TcpProxy::TcpProxy(const std::string& server_url, std::chrono::milliseconds delay,
                   std::chrono::milliseconds cut_interval)
    : server_port_(
          static_cast<std::uint16_t>(std::stoul(server_url.substr(server_url.rfind(':') + 1)))),
      delay_(delay),
      cut_interval_(cut_interval),
      listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = on_loopback(0);
  socklen_t size = sizeof address;
  if (bind(listener_, any_address(address), sizeof address) != 0 || listen(listener_, 16) != 0 ||
      getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error(std::string("cannot listen: ") + std::strerror(errno));
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

TcpProxy::~TcpProxy() {
  thread_.request_stop();
  thread_.join();
  close(listener_);
}

std::string TcpProxy::url() const {
  return "tcp://127.0.0.1:" + std::to_string(port_);
}

void TcpProxy::run(const std::stop_token& stop) {
  std::list<Line> lines;
  int swallowed = 0;
  auto next_cut = Clock::now() + cut_interval_;
  while (!stop.stop_requested()) {
    std::vector<pollfd> polled{{listener_, POLLIN, 0}};
    for (const Line& line : lines) {
      for (const auto& [end, direction] :
           {std::pair(&line.peer, &line.to_server), std::pair(&line.server, &line.to_peer)}) {
        if (direction->takes_more()) {
          polled.push_back({end->number(), POLLIN, 0});
        }
      }
    }
    poll(polled.data(), polled.size(), kLongestPoll_ms);
    if (swallowed_ > swallowed) {
      swallowed = swallowed_;
      for (Line& line : lines) {
        line.is_swallowed = true;
      }
    }
    if ((polled[0].revents & POLLIN) != 0) {
      if (auto line = accepted(listener_, server_port_)) {
        lines.push_back(*std::move(line));
        ++connections_;
      }
    }
    const auto now = Clock::now();
    if (cut_interval_.count() > 0 && now >= next_cut) {
      cuts_ += static_cast<int>(lines.size());
      lines.clear();
      next_cut = now + cut_interval_;
    }
    lines.remove_if([&](Line& line) { return !line.move(now, delay_, stalls_); });
  }
}

}  // namespace oblique::test
