// What keys cost the server: each refused peer, and each message.
//   oblique-network-bench refusals [COUNT]
//   oblique-network-bench messages
//   oblique-network-bench flood
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <deque>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <poll.h>
#include <unistd.h>

#include <zmq.hpp>

#include "server/network/network.h"
#include "tests/server/network/curve_client.h"

namespace oblique::server {
namespace {

using Clock = std::chrono::steady_clock;

double resident_MB() {
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0;
  double resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// A network that a thread of its own turns, as the server's loop does. Port 0 wants keys, port 1
/// does not.
class TurnedNetwork {
 public:
  using Take = std::function<void(Network&, const Incoming&)>;
  explicit TurnedNetwork(Take take) : take_(std::move(take)) {
    authenticator_.add(own_.public_key, "bench");
    network_.listen("127.0.0.1", "*", PortSecurity{server_, authenticator_});
    network_.listen("127.0.0.1", "*");
    thread_ = std::thread([this] { turn(); });
  }
  ~TurnedNetwork() { stop(); }
  TurnedNetwork(const TurnedNetwork&) = delete;
  TurnedNetwork& operator=(const TurnedNetwork&) = delete;

  /// CPU that the thread took, in all. Then it is gone.
  double stop() {
    is_stopped_ = true;
    if (thread_.joinable()) {
      thread_.join();
    }
    return cpu_s_;
  }
  std::string endpoint(Network::Port port) const { return network_.endpoint(port); }
  const protocol::KeyPair& own() const { return own_; }
  const protocol::CurveKey& server_key() const { return server_.public_key; }
  /// Connections that have gone, and those that are there. Only when it has stopped.
  std::uint64_t accepted() const { return disconnected_ + network_.connections(); }

 private:
  void turn() {
    const double before_s = thread_cpu_s();
    while (!is_stopped_) {
      pollfd item{network_.descriptor(), POLLIN, 0};
      ::poll(&item, 1, network_.has_more() ? 0 : 10);
      network_.collect(
          std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now().time_since_epoch())
              .count());
      for (const Network::Port port : {0U, 1U}) {
        while (const auto incoming = network_.next(port, [](const std::string&) { return true; })) {
          take_(network_, *incoming);
        }
      }
      disconnected_ += network_.take_disconnects().size();
    }
    cpu_s_ = thread_cpu_s() - before_s;
  }

  protocol::KeyPair server_ = protocol::made_key_pair();
  protocol::KeyPair own_ = protocol::made_key_pair();
  ListAuthenticator authenticator_;
  Network network_{{}};
  Take take_;
  std::atomic<bool> is_stopped_ = false;
  double cpu_s_ = 0.0;
  std::uint64_t disconnected_ = 0;
  std::thread thread_;
};

// ---- Refusals ---------------------------------------------------------------------------------

void be_unknown(const TurnedNetwork& server) {
  RawPeer peer(server.endpoint(0));
  CurveClient client(protocol::made_key_pair(), server.server_key());
  peer.send(curve_greeting() + command_frame("HELLO", client.hello()));
  std::string heard;
  constexpr std::size_t kWelcomeEnds = kGreetingBytes + 170;
  while (heard.size() < kWelcomeEnds) {
    heard += peer.receive();
  }
  client.take_welcome(std::string_view(heard).substr(kGreetingBytes + 10));
  peer.send(command_frame("INITIATE", client.initiate()));
  peer.read_to_the_end();
}

void be_astray(const TurnedNetwork& server) {
  RawPeer peer(server.endpoint(0));
  CurveClient client(server.own(), server.own().public_key);
  peer.send(curve_greeting() + command_frame("HELLO", client.hello()));
  peer.read_to_the_end();
}

void be_without_key(const TurnedNetwork& server) {
  RawPeer peer(server.endpoint(0));
  peer.send(zmtp_greeting());
  peer.read_to_the_end();
}

void measure_refusals(const char* what, int count, void (*be_refused)(const TurnedNetwork&)) {
  TurnedNetwork server([](Network&, const Incoming&) {});
  for (int i = 0; i < 100; ++i) {
    be_refused(server);
  }
  const double before_MB = resident_MB();
  for (int i = 0; i < count; ++i) {
    be_refused(server);
  }
  const double after_MB = resident_MB();
  const double cpu_s = server.stop();
  std::printf("%-18s %8d %12.3f %12.2f %12.2f\n", what, count, 1e3 * cpu_s / (count + 100),
              before_MB, after_MB);
}

void refusals(int count) {
  std::printf("%-18s %8s %12s %12s %12s\n", "refused for", "times", "CPU each, ms", "before, MB",
              "after, MB");
  measure_refusals("no key", count, be_without_key);
  measure_refusals("wrong server key", count, be_astray);
  measure_refusals("unknown key", count, be_unknown);
}

// ---- Messages ---------------------------------------------------------------------------------

struct Cost {
  double per_second;  ///< messages there and back
  double cpu_us;      ///< of the server, for one in and one out
};

zmq::socket_t connected(zmq::context_t& context, const TurnedNetwork& server, bool has_keys) {
  zmq::socket_t socket(context, zmq::socket_type::dealer);
  socket.set(zmq::sockopt::linger, 0);
  if (has_keys) {
    socket.set(zmq::sockopt::curve_publickey, zmq::buffer(server.own().public_key));
    socket.set(zmq::sockopt::curve_secretkey,
               zmq::const_buffer(server.own().secret_key.data(), kKeyBytes));
    socket.set(zmq::sockopt::curve_serverkey, zmq::buffer(server.server_key()));
  }
  socket.connect(server.endpoint(has_keys ? 0 : 1));
  return socket;
}

Cost measure_messages(std::size_t bytes, bool has_keys, int count) {
  constexpr int kUnderWay = 64;
  TurnedNetwork server([](Network& network, const Incoming& incoming) {
    network.send(incoming.identity, incoming.body);
  });
  zmq::context_t context;
  zmq::socket_t socket = connected(context, server, has_keys);
  const std::string body(bytes, 'm');
  const auto start = Clock::now();
  for (int i = 0; i < count + kUnderWay; ++i) {
    if (i < count) {
      socket.send(zmq::buffer(body), zmq::send_flags::none);
    }
    zmq::message_t echo;
    if (i >= kUnderWay && !socket.recv(echo)) {
      throw std::runtime_error("no echo");
    }
  }
  const std::chrono::duration<double> wall = Clock::now() - start;
  return {count / wall.count(), 1e6 * server.stop() / count};
}

void messages() {
  std::printf("%10s %14s %14s %7s %14s %14s %7s\n", "bytes", "echoes/s, off", "on", "ratio",
              "CPU off, us", "on", "ratio");
  for (const std::size_t bytes : {std::size_t{100}, std::size_t{4'000}, std::size_t{64'000}}) {
    const int count = bytes < 10'000 ? 100'000 : 10'000;
    const Cost off = measure_messages(bytes, false, count);
    const Cost on = measure_messages(bytes, true, count);
    std::printf("%10zu %14.0f %14.0f %7.2f %14.2f %14.2f %7.2f\n", bytes, off.per_second,
                on.per_second, on.per_second / off.per_second, off.cpu_us, on.cpu_us,
                on.cpu_us / off.cpu_us);
  }
}

// ---- Floods -----------------------------------------------------------------------------------

/// One HELLO, said over and over on new connections: it costs whoever says it nothing.
void say_hello_without_end(const TurnedNetwork& server, const std::atomic<bool>& is_over) {
  constexpr std::size_t kAtATime = 200;
  CurveClient client(protocol::made_key_pair(), server.server_key());
  const std::string hello = curve_greeting() + command_frame("HELLO", client.hello());
  std::deque<std::unique_ptr<RawPeer>> peers;
  while (!is_over) {
    try {
      peers.push_back(std::make_unique<RawPeer>(server.endpoint(0)));
      peers.back()->send_what_fits(hello);
    } catch (const std::runtime_error&) {
      // it was made to leave
    }
    if (peers.size() > kAtATime) {
      peers.pop_front();
    }
  }
}

void measure_flood(bool is_flooded) {
  TurnedNetwork server([](Network& network, const Incoming& incoming) {
    network.send(incoming.identity, incoming.body);
  });
  zmq::context_t context;
  zmq::socket_t socket = connected(context, server, true);
  std::atomic<bool> is_over = false;
  std::thread flood;
  if (is_flooded) {
    flood = std::thread([&] { say_hello_without_end(server, is_over); });
  }
  std::vector<double> waits_ms;
  for (int i = 0; i < 2000; ++i) {
    const auto start = Clock::now();
    socket.send(zmq::str_buffer("ask"), zmq::send_flags::none);
    zmq::message_t echo;
    if (!socket.recv(echo)) {
      throw std::runtime_error("no echo");
    }
    waits_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  is_over = true;
  if (flood.joinable()) {
    flood.join();
  }
  server.stop();
  std::sort(waits_ms.begin(), waits_ms.end());
  std::printf("%-14s %10.2f %10.2f %10.2f %12llu\n", is_flooded ? "flooded" : "left in peace",
              waits_ms[waits_ms.size() / 2], waits_ms[waits_ms.size() * 99 / 100], waits_ms.back(),
              static_cast<unsigned long long>(server.accepted()));
}

void flood() {
  std::printf("%-14s %10s %10s %10s %12s\n", "one who is in", "median, ms", "p99, ms", "worst, ms",
              "connections");
  measure_flood(false);
  measure_flood(true);
}

}  // namespace
}  // namespace oblique::server

int main(int count, char** arguments) {
  const std::string what = count > 1 ? arguments[1] : "";
  if (what == "refusals") {
    oblique::server::refusals(count > 2 ? std::stoi(arguments[2]) : 2000);
  } else if (what == "messages") {
    oblique::server::messages();
  } else if (what == "flood") {
    oblique::server::flood();
  } else {
    std::puts("oblique-network-bench refusals [COUNT] | messages | flood");
    return 2;
  }
}
