#include "server/loop.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>
#include <variant>

#include <arpa/inet.h>

#include <spdlog/spdlog.h>
#include <zmq.hpp>

#include "proto/frames.h"
#include "server/file_system.h"

namespace oblique::server {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTick{100};
constexpr int kLinger_ms = 500;
constexpr int kTcpHeartbeat_ms = 2000;
constexpr int kTcpTimeout_ms = 10'000;
/// Messages taken from one socket before the others get their turn.
constexpr int kMessagesPerTurn = 256;
/// What has arrived when the server is told to stop is still read, for so long at most.
constexpr std::chrono::milliseconds kLongestDrain{1000};

Instant now() {
  using std::chrono::duration_cast;
  using std::chrono::milliseconds;
  return {duration_cast<milliseconds>(Clock::now().time_since_epoch()).count(),
          duration_cast<milliseconds>(std::chrono::system_clock::now().time_since_epoch()).count()};
}

/// Reports of the other threads, kept for the loop, which an inproc socket wakes.
class ReportBox {
 public:
  using Item = std::variant<WriteReport, QueryReport>;

  ReportBox(zmq::context_t& context, const std::string& name)
      : wake_(context, zmq::socket_type::push), woken_(context, zmq::socket_type::pull) {
    wake_.set(zmq::sockopt::linger, 0);
    woken_.bind("inproc://" + name);
    wake_.connect("inproc://" + name);
  }

  /// From the one thread that fills this box.
  template <typename Reports>
  void put(Reports reports) {
    {
      const std::lock_guard lock(mutex_);
      for (auto& report : reports) {
        items_.emplace_back(std::move(report));
      }
    }
    // When the socket is full the loop has wake-ups enough to read.
    (void)wake_.send(zmq::message_t(), zmq::send_flags::dontwait);
  }

  /// From the loop: everything put so far.
  std::deque<Item> take() {
    zmq::message_t ignored;
    while (woken_.recv(ignored, zmq::recv_flags::dontwait)) {
    }
    const std::lock_guard lock(mutex_);
    return std::exchange(items_, {});
  }

  void* socket() { return woken_.handle(); }

 private:
  zmq::socket_t wake_;
  zmq::socket_t woken_;
  std::mutex mutex_;
  std::deque<Item> items_;  // guarded by mutex_
};

zmq::socket_t bound_router(zmq::context_t& context, const std::string& address,
                           const std::string& port) {
  zmq::socket_t socket(context, zmq::socket_type::router);
  socket.set(zmq::sockopt::router_mandatory, 1);
  socket.set(zmq::sockopt::linger, kLinger_ms);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(protocol::kMaxFrameBytes));
  socket.set(zmq::sockopt::heartbeat_ivl, kTcpHeartbeat_ms);
  socket.set(zmq::sockopt::heartbeat_timeout, kTcpTimeout_ms);
  socket.set(zmq::sockopt::ipv6, address.find(':') != std::string::npos);
  const std::string host = address.find(':') != std::string::npos ? "[" + address + "]" : address;
  const std::string endpoint = "tcp://" + host + ":" + port;
  try {
    socket.bind(endpoint);
  } catch (const zmq::error_t& error) {
    throw std::runtime_error("cannot listen on " + endpoint + ": " + error.what() +
                             (error.num() == EADDRINUSE ? ": does a server run already?" : ""));
  }
  return socket;
}

/// One message of two frames, identity and body; nothing when none waits. `well_formed` is false
/// for any other number of frames; all of them are taken off the socket.
struct Incoming {
  std::string identity;
  zmq::message_t body;
  bool well_formed;
};
std::optional<Incoming> receive(zmq::socket_t& socket) {
  zmq::message_t identity;
  if (!socket.recv(identity, zmq::recv_flags::dontwait)) {
    return std::nullopt;
  }
  Incoming incoming{identity.to_string(), {}, false};
  bool more = identity.more();
  for (int frames = 1; more; ++frames) {
    zmq::message_t frame;
    (void)socket.recv(frame, zmq::recv_flags::none);
    more = frame.more();
    incoming.well_formed = frames == 1 && !more;
    incoming.body = std::move(frame);
  }
  return incoming;
}

/// False when the peer is gone or takes nothing any more.
bool send(zmq::socket_t& socket, const std::string& identity, const std::string& body) {
  try {
    return socket.send(zmq::buffer(identity),
                       zmq::send_flags::sndmore | zmq::send_flags::dontwait) &&
           socket.send(zmq::buffer(body), zmq::send_flags::dontwait);
  } catch (const zmq::error_t& error) {
    if (error.num() == EHOSTUNREACH) {
      return false;
    }
    throw;
  }
}

}  // namespace

namespace {

/// Throws StorageError for a path where a database would be in danger.
const std::string& safe_path(const LoopSettings& settings) {
  const std::string objection = objection_to_file_system(settings.database);
  if (!objection.empty() && !settings.allow_network_disk) {
    throw StorageError(objection);
  }
  return settings.database;
}

}  // namespace

std::string loopback_address(const std::string& address) {
  if (address == "localhost") {
    return "127.0.0.1";
  }
  in_addr v4{};
  in6_addr v6{};
  if (inet_pton(AF_INET, address.c_str(), &v4) == 1 && (ntohl(v4.s_addr) >> 24U) == 127) {
    return address;
  }
  if (inet_pton(AF_INET6, address.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6)) {
    return address;
  }
  throw std::runtime_error("--listen " + address +
                           " is refused: without keys the server listens on loopback only, as "
                           "127.0.0.1 or ::1");
}

class Loop::Parts final : public Outbox {
 public:
  explicit Parts(LoopSettings settings)
      : address_(loopback_address(settings.listen)),
        store_(safe_path(settings)),
        written_(context_, "written"),
        queried_(context_, "queried"),
        writer_(store_, [this](std::vector<WriteReport> r) { written_.put(std::move(r)); }),
        queries_(settings.database, settings.queries,
                 [this](QueryReport r) { queried_.put(std::array{std::move(r)}); }),
        workers_(bound_router(context_, address_, settings.worker_port)),
        clients_(bound_router(context_, address_, settings.client_port)) {
    ServiceSettings service = std::move(settings.service);
    service.database_id = store_.database_id();
    service.last_study_id = store_.last_study_id();
    service.last_worker_id = store_.last_worker_id();
    // Above every number that an earlier run can have given, whatever the clock says.
    service.scheduler.first_lease_id = store_.count_start() << 40U;
    service_.emplace(std::move(service), *this, store_.studies(), now());
  }

  LoopEnd run(int stop_fd) {
    auto next_tick = Clock::now();
    std::array<zmq::pollitem_t, 5> items{{{workers_.handle(), 0, ZMQ_POLLIN, 0},
                                          {clients_.handle(), 0, ZMQ_POLLIN, 0},
                                          {written_.socket(), 0, ZMQ_POLLIN, 0},
                                          {queried_.socket(), 0, ZMQ_POLLIN, 0},
                                          {nullptr, stop_fd, ZMQ_POLLIN, 0}}};
    while (items.back().revents == 0) {
      const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next_tick - Clock::now());
      poll(items, std::max(wait, std::chrono::milliseconds(0)));
      take_reports();
      take_worker_messages();
      take_client_messages();
      if (Clock::now() >= next_tick) {
        service_->tick(now());
        next_tick = Clock::now() + kTick;
      }
    }
    return finish();
  }

  bool to_worker(const std::string& identity, const protocol::ServerToWorker& message) override {
    return send(workers_, identity, protocol::encode(message));
  }
  bool to_client(const std::string& identity, const protocol::ClientReply& reply) override {
    return forward_to_client(identity, protocol::encode(reply));
  }
  bool forward_to_client(const std::string& identity, const std::string& frame) override {
    return send(clients_, identity, frame);
  }
  void write(WriteJob job) override { writer_.submit(std::move(job)); }
  bool query(QueryJob job) override { return queries_.submit(std::move(job)); }
  void cancel_query(std::uint64_t ticket) override { queries_.cancel(ticket); }
  void note(Severity severity, const std::string& text) override {
    constexpr std::array kLevels{spdlog::level::info, spdlog::level::warn, spdlog::level::err};
    spdlog::log(kLevels.at(static_cast<std::size_t>(severity)), "{}", text);
  }

  std::string client_endpoint() const { return clients_.get(zmq::sockopt::last_endpoint); }
  std::string worker_endpoint() const { return workers_.get(zmq::sockopt::last_endpoint); }

 private:
  static void poll(std::array<zmq::pollitem_t, 5>& items, std::chrono::milliseconds wait) {
    try {
      zmq::poll(items, wait);
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) {
        throw;
      }
    }
  }

  void take_reports() {
    for (const auto& report : written_.take()) {
      service_->written(std::get<WriteReport>(report), now());
    }
    for (auto& report : queried_.take()) {
      service_->queried(std::get<QueryReport>(std::move(report)));
    }
  }

  /// False when messages may be left.
  bool take_worker_messages() {
    for (int i = 0; i < kMessagesPerTurn; ++i) {
      const auto message = receive(workers_);
      if (!message) {
        return true;
      }
      service_->worker_frame(message->identity, body_of(*message), now());
    }
    return false;
  }

  void take_client_messages() {
    for (int i = 0; i < kMessagesPerTurn; ++i) {
      const auto message = receive(clients_);
      if (!message) {
        return;
      }
      service_->client_frame(message->identity, body_of(*message), now());
    }
  }

  /// What is not of two frames is passed on as a frame that no message has.
  static std::string_view body_of(const Incoming& message) {
    return message.well_formed ? message.body.to_string_view() : std::string_view("\xff", 1);
  }

  LoopEnd finish() {
    spdlog::info("stopping");
    queries_.stop();
    service_->stop(now());
    const auto until = Clock::now() + kLongestDrain;
    while (!take_worker_messages() && Clock::now() < until) {
    }
    take_client_messages();
    const std::size_t lost = writer_.finish();
    take_reports();
    if (lost > 0) {
      spdlog::error("{} changes could not be made durable and were not acknowledged", lost);
    }
    return {lost};
  }

  zmq::context_t context_;
  std::string address_;
  Store store_;
  ReportBox written_;
  ReportBox queried_;
  Writer writer_;
  QueryPool queries_;
  zmq::socket_t workers_;
  zmq::socket_t clients_;
  std::optional<Service> service_;
};

Loop::Loop(LoopSettings settings) : parts_(std::make_unique<Parts>(std::move(settings))) {}
Loop::~Loop() = default;

std::string Loop::client_endpoint() const {
  return parts_->client_endpoint();
}
std::string Loop::worker_endpoint() const {
  return parts_->worker_endpoint();
}
LoopEnd Loop::run(int stop_fd) {
  return parts_->run(stop_fd);
}

}  // namespace oblique::server
