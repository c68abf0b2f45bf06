#include "tests/system/storms/cutting_proxy.h"

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <map>
#include <stdexcept>
#include <vector>

namespace oblique::test {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kLongestPoll_ms = 10;

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

const sockaddr* generic(const sockaddr_in& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

int new_socket() {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) {
    throw std::runtime_error("socket: " + std::string(std::strerror(errno)));
  }
  return descriptor;
}

/// False when either side has ended.
bool pass_on(int from, int to) {
  std::array<char, 65536> bytes{};
  const ssize_t count = recv(from, bytes.data(), bytes.size(), 0);
  if (count <= 0) {
    return false;
  }
  for (ssize_t sent = 0; sent < count;) {
    const ssize_t more =
        send(to, bytes.data() + sent, static_cast<std::size_t>(count - sent), MSG_NOSIGNAL);
    if (more <= 0) {
      return false;
    }
    sent += more;
  }
  return true;
}

/// Open connections: each end with the other one.
class Ends {
 public:
  ~Ends() { cut_all(); }
  void add(int one, int other) {
    other_end_[one] = other;
    other_end_[other] = one;
  }
  void cut(int end) {
    const int other = other_end_.at(end);
    for (const int descriptor : {end, other}) {
      other_end_.erase(descriptor);
      close(descriptor);
    }
  }
  /// How many connections they were.
  int cut_all() {
    int count = 0;
    for (; !other_end_.empty(); ++count) {
      cut(other_end_.begin()->first);
    }
    return count;
  }
  const std::map<int, int>& all() const { return other_end_; }

 private:
  std::map<int, int> other_end_;
};

}  // namespace

CuttingProxy::CuttingProxy(const std::string& server_url, std::chrono::milliseconds interval)
    : server_port_(
          static_cast<std::uint16_t>(std::stoul(server_url.substr(server_url.rfind(':') + 1)))),
      interval_(interval),
      listener_(new_socket()) {
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  if (bind(listener_, generic(address), sizeof address) != 0 || listen(listener_, 16) != 0 ||
      getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("cannot listen: " + std::string(std::strerror(errno)));
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

CuttingProxy::~CuttingProxy() {
  thread_.request_stop();
  thread_.join();
  close(listener_);
}

std::string CuttingProxy::url() const {
  return "tcp://127.0.0.1:" + std::to_string(port_);
}

void CuttingProxy::run(const std::stop_token& stop) {
  Ends ends;
  auto next_cut = Clock::now() + interval_;
  while (!stop.stop_requested()) {
    std::vector<pollfd> polled{{listener_, POLLIN, 0}};
    for (const auto& [end, other] : ends.all()) {
      polled.push_back({end, POLLIN, 0});
    }
    poll(polled.data(), polled.size(), kLongestPoll_ms);
    for (std::size_t i = 1; i < polled.size(); ++i) {
      const int end = polled[i].fd;
      if (polled[i].revents != 0 && ends.all().contains(end) && !pass_on(end, ends.all().at(end))) {
        ends.cut(end);
      }
    }
    if ((polled[0].revents & POLLIN) != 0) {
      const int peer = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      const int server = new_socket();
      const sockaddr_in address = loopback(server_port_);
      if (peer >= 0 && connect(server, generic(address), sizeof address) == 0) {
        ends.add(peer, server);
      } else {
        close(peer);
        close(server);
      }
    }
    if (Clock::now() >= next_cut) {
      cuts_ += ends.cut_all();
      next_cut = Clock::now() + interval_;
    }
  }
}

}  // namespace oblique::test
