#include "worker/session.h"

#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include <dlfcn.h>
#include <netdb.h>

#include <gtest/gtest.h>

#include "proto/frames.h"
#include "proto/result_message.h"
#include "proto/system/descriptor.h"
#include "tests/support/reserved_port.h"
#include "tests/worker/conversation_fixture.h"

namespace oblique::worker {
namespace {

using protocol::WorkerMessage;

/// Returns a welcome with a timeout of ten minutes, so that the worker waits for a slow server.
protocol::ServerToWorker patient_welcome() {
  protocol::ServerToWorker welcome = welcome_message();
  welcome.mutable_welcome()->set_lost_after_ms(600'000);
  return welcome;
}

/// The name of a host whose lookup does not end before the test releases it.
class SilentName {
 public:
  static constexpr const char* kName = "silent.example";

  static SilentName& instance() {
    static SilentName name;
    return name;
  }
  int look_up() {
    std::unique_lock lock(mutex_);
    is_looked_up_ = true;
    changed_.notify_all();
    changed_.wait(lock, [this] { return is_released_; });
    return EAI_AGAIN;
  }
  void wait_for_lookup() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_looked_up_; });
  }
  void release() {
    const std::lock_guard lock(mutex_);
    is_released_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_looked_up_ = false;
  bool is_released_ = false;
};

/// The server's side of the socket, controlled by the test. Waiting for a message fails after ten
/// minutes.
class ScriptedServer {
 public:
  explicit ScriptedServer(const std::string& endpoint = "tcp://127.0.0.1:*")
      : socket_(context_, zmq::socket_type::router) {
    constexpr int kNeverThatLong_ms = 600'000;
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::rcvtimeo, kNeverThatLong_ms);
    socket_.bind(endpoint);
  }

  std::string endpoint() const { return socket_.get(zmq::sockopt::last_endpoint); }

  /// Waits for a message of this kind and returns it. Discards other messages.
  WorkerMessage wait_for(WorkerMessage::KindCase kind) {
    while (true) {
      zmq::message_t identity;
      zmq::message_t frame;
      if (!socket_.recv(identity) || !socket_.recv(frame)) {
        throw std::runtime_error("the worker never sent the message that the test waits for");
      }
      WorkerMessage message;
      if (!protocol::decode({frame.data<char>(), frame.size()}, message)) {
        throw std::runtime_error("the worker sent a frame that is no message");
      }
      if (message.kind_case() == kind) {
        worker_ = identity.to_string();
        return message;
      }
    }
  }

  /// Sends a message to the worker from which the last message came.
  void send(const protocol::ServerToWorker& message) { send_frame(protocol::encode(message)); }
  void send_frame(const std::string& frame) {
    socket_.send(zmq::buffer(worker_), zmq::send_flags::sndmore);
    socket_.send(zmq::buffer(frame));
  }

  /// Welcomes the worker and sends it a batch of points 0 to `count − 1` of study 7.
  void welcome_and_hand_out(std::uint64_t count) {
    wait_for(WorkerMessage::kHello);
    protocol::ServerToWorker welcome = patient_welcome();
    welcome.mutable_welcome()->set_heartbeat_interval_ms(20);
    send(welcome);
    wait_for(WorkerMessage::kCredit);
    send(study_message(7));
    send(batch_message(7, 31, 0, count));
  }

 private:
  zmq::context_t context_;
  zmq::socket_t socket_;
  std::string worker_;
};

/// Runs a session on a thread of its own.
class RunningWorker {
 public:
  explicit RunningWorker(const std::string& server, BatchSolver::SolvePoints solve)
      : session_(settings(server), std::move(solve), fails_the_trace),
        exit_code_(std::async(std::launch::async, [this] {
          return session_.run(stop_.descriptor(), [this] { stop_.clear(); });
        })) {}
  ~RunningWorker() { stop_.wake(); }
  RunningWorker(const RunningWorker&) = delete;
  RunningWorker& operator=(const RunningWorker&) = delete;

  void stop() { stop_.wake(); }
  int exit_code() { return exit_code_.get(); }

 private:
  static protocol::PointResult fails_the_trace(const protocol::TraceOrder& order,
                                               const solver::Tracing::Sink& /*sink*/) {
    return protocol::failed_point(0, "H = " + std::to_string(order.h_m()) + " for the test");
  }
  static SessionSettings settings(const std::string& server) {
    SessionSettings settings;
    settings.server = server;
    settings.name = "test";
    return settings;
  }

  protocol::WakeUp stop_;
  Session session_;
  std::future<int> exit_code_;
};

void solved_at_once(const Batch&, solver::PointSource& points, const solver::TakeOutcome& take) {
  while (const auto point = points.next()) {
    take({*point, std::nullopt, "for the test"});
  }
}

TEST(SessionTest, ABatchIsSolvedAndReportedAndAStoppedWorkerSaysGoodbye) {
  ScriptedServer server;
  RunningWorker worker(server.endpoint(), solved_at_once);
  server.welcome_and_hand_out(10);
  std::uint64_t points = 0;
  bool batch_done = false;
  while (!batch_done) {
    const auto results = server.wait_for(WorkerMessage::kResults).results();
    points += static_cast<std::uint64_t>(results.results_size());
    batch_done = results.batch_done();
    server.send(stored_message(results.sequence()));
  }
  EXPECT_EQ(points, 10U);
  worker.stop();
  server.wait_for(WorkerMessage::kGoodbye);
  EXPECT_EQ(worker.exit_code(), 0);
}

TEST(SessionTest, ATraceIsSolvedDuringALongBatch) {
  ScriptedServer server;
  std::promise<void> release;
  const std::shared_future<void> released(release.get_future());
  RunningWorker worker(server.endpoint(), [&](const Batch& batch, auto& points, const auto& take) {
    released.wait();
    solved_at_once(batch, points, take);
  });
  server.welcome_and_hand_out(1);
  protocol::ServerToWorker order;
  order.mutable_trace_order()->set_trace_id(5);
  order.mutable_trace_order()->set_h_m(3.0);
  server.send(order);
  const auto trace = server.wait_for(WorkerMessage::kTrace).trace();
  EXPECT_EQ(trace.trace_id(), 5U);
  EXPECT_NE(trace.result().error().find("H = 3"), std::string::npos);
  release.set_value();
  const auto results = server.wait_for(WorkerMessage::kResults).results();
  server.send(stored_message(results.sequence()));
}

TEST(SessionTest, HeartbeatsContinueWhileAPointIsSolved) {
  ScriptedServer server;
  std::promise<void> release;
  const std::shared_future<void> released(release.get_future());
  RunningWorker worker(server.endpoint(), [&](const Batch& batch, auto& points, const auto& take) {
    released.wait();
    solved_at_once(batch, points, take);
  });
  server.welcome_and_hand_out(1);
  for (int i = 0; i < 5; ++i) {
    EXPECT_LE(server.wait_for(WorkerMessage::kHeartbeat).heartbeat().lease_ids_size(), 1);
  }
  release.set_value();
  const auto results = server.wait_for(WorkerMessage::kResults).results();
  EXPECT_EQ(results.results_size(), 1);
  server.send(stored_message(results.sequence()));
}

TEST(SessionTest, ResultsThatALostServerDidNotStoreAreSentToTheNextServerAtTheAddress) {
  const test::ReservedPort port;
  auto server = std::make_unique<ScriptedServer>(port.url());
  RunningWorker worker(port.url(), solved_at_once);
  server->welcome_and_hand_out(10);
  while (!server->wait_for(WorkerMessage::kResults).results().batch_done()) {
  }
  server.reset();

  ScriptedServer next(port.url());
  next.wait_for(WorkerMessage::kHeartbeat);
  next.send(hello_again_message());
  next.wait_for(WorkerMessage::kHello);
  next.send(patient_welcome());
  std::uint64_t points = 0;
  while (points < 10) {
    const auto results = next.wait_for(WorkerMessage::kResults).results();
    points += static_cast<std::uint64_t>(results.results_size());
    EXPECT_EQ(results.lease_id(), 0U);
    next.send(stored_message(results.sequence()));
  }
  EXPECT_EQ(points, 10U);
}

TEST(SessionTest, AWorkerStartedBeforeItsServerFindsIt) {
  const test::ReservedPort port;
  RunningWorker worker(port.url(), solved_at_once);
  ScriptedServer server(port.url());
  EXPECT_EQ(server.wait_for(WorkerMessage::kHello).hello().name(), "test");
}

TEST(SessionTest, InvalidFramesAreIgnored) {
  ScriptedServer server;
  RunningWorker worker(server.endpoint(), solved_at_once);
  server.wait_for(WorkerMessage::kHello);
  server.send_frame("");
  server.send_frame("GET / HTTP/1.1\r\n\r\n");
  server.send_frame(std::string(100'000, '\xFF'));
  server.send(patient_welcome());
  EXPECT_EQ(server.wait_for(WorkerMessage::kCredit).credit().batches(), 2U);
}

TEST(SessionTest, ARefusedWorkerExitsWithOne) {
  ScriptedServer server;
  RunningWorker worker(server.endpoint(), solved_at_once);
  server.wait_for(WorkerMessage::kHello);
  protocol::ServerToWorker refused;
  refused.mutable_refused()->set_reason("for the test");
  server.send(refused);
  EXPECT_EQ(worker.exit_code(), 1);
}

TEST(SessionTest, AnInvalidAddressIsAnErrorThatNamesIt) {
  for (const std::string address : {"", "localhost", "tcp://127.0.0.1", "tcp://127.0.0.1:port"}) {
    SessionSettings settings;
    settings.server = address;
    Session session(settings, solved_at_once);
    const protocol::WakeUp stop;
    try {
      session.run(stop.descriptor(), [] {});
      FAIL() << "connected to \"" << address << '"';
    } catch (const solver::InputError& error) {
      EXPECT_NE(std::string(error.what()).find('"' + address + '"'), std::string::npos);
    }
  }
}

TEST(Session, StopsWhileTheNameOfTheServerIsLookedUp) {
  RunningWorker worker(std::string("tcp://") + SilentName::kName + ":7601",
                       [](const Batch&, auto&, const auto&) {});
  SilentName::instance().wait_for_lookup();
  worker.stop();
  EXPECT_EQ(worker.exit_code(), 0);
  SilentName::instance().release();
}

}  // namespace
}  // namespace oblique::worker

/// Replaces the function of the C library, also for libzmq.
extern "C" int getaddrinfo(const char* host, const char* service, const addrinfo* hints,
                           addrinfo** found) {
  using oblique::worker::SilentName;
  if (host != nullptr && std::string_view(host) == SilentName::kName) {
    return SilentName::instance().look_up();
  }
  const auto next = reinterpret_cast<decltype(&getaddrinfo)>(dlsym(RTLD_NEXT, "getaddrinfo"));
  return next(host, service, hints, found);
}
