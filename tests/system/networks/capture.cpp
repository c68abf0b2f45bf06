#include "tests/system/networks/capture.h"

#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

namespace oblique::test {
namespace {

/// So that none is lost while this machine is busy.
constexpr int kWaitingBytes = 64 << 20;
/// Virtual cables carry what a real one would in several packets.
constexpr std::size_t kLongestPacket = std::size_t{1} << 17U;
constexpr int kPoll_ms = 20;

}  // namespace

Capture::Capture(const Host& host)
    : socket_(socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, htons(ETH_P_ALL))) {
  sockaddr_ll cable{};
  cable.sll_family = AF_PACKET;
  cable.sll_protocol = htons(ETH_P_ALL);
  cable.sll_ifindex = static_cast<int>(if_nametoindex(("to-" + host.name()).c_str()));
  // As root of the namespace one may go beyond the system's bound; if not, its default has to do.
  static_cast<void>(setsockopt(socket_.number(), SOL_SOCKET, SO_RCVBUFFORCE, &kWaitingBytes,
                               sizeof kWaitingBytes));
  if (bind(socket_.number(), reinterpret_cast<const sockaddr*>(&cable), sizeof cable) != 0) {
    throw std::runtime_error(std::string("cannot capture: ") + std::strerror(errno));
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Capture::~Capture() = default;

const std::string& Capture::bytes() {
  thread_.request_stop();
  if (thread_.joinable()) {
    thread_.join();
  }
  return bytes_;
}

void Capture::run(const std::stop_token& stop) {
  std::vector<char> packet(kLongestPacket);
  while (!stop.stop_requested()) {
    pollfd polled{socket_.number(), POLLIN, 0};
    poll(&polled, 1, kPoll_ms);
    ssize_t count = 0;
    while ((count = recv(socket_.number(), packet.data(), packet.size(), 0)) > 0) {
      bytes_.append(packet.data(), static_cast<std::size_t>(count));
    }
  }
}

}  // namespace oblique::test
