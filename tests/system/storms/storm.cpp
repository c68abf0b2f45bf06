#include "tests/system/storms/storm.h"

#include <chrono>
#include <csignal>
#include <random>
#include <sstream>
#include <vector>

#include <zmq.hpp>

#include "proto/frames.h"
#include "proto/result_message.h"

namespace oblique::test {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kBetweenCuts{150};
constexpr int kShortestLife_ms = 20;
constexpr int kLongestLife_ms = 900;
constexpr std::uint32_t kRequestedBatches = 1000;

const std::vector<std::string> kOneThread{"--threads", "1"};

std::string worker_solver_version() {
  const TemporaryFolder folder;
  Process process(folder, worker_program(), {"--version"});
  process.wait();
  std::istringstream words(process.out());  // "oblique-worker 0.2.0 (commit ...)"
  std::string program;
  std::string version;
  words >> program >> version;
  return version;
}

/// Joins as a worker, requests batches and disappears. Returns true if it got a batch of a
/// study.
bool vanish_with_points(const std::string& server_url, const std::string& solver_version,
                        int number) {
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::dealer);
  socket.set(zmq::sockopt::linger, 0);
  socket.set(zmq::sockopt::rcvtimeo, 200);
  socket.connect(server_url);
  protocol::WorkerMessage hello;
  protocol::set_protocol(*hello.mutable_hello());
  hello.mutable_hello()->set_solver_version(solver_version);
  hello.mutable_hello()->set_name("fake");
  hello.mutable_hello()->set_threads(1);
  hello.mutable_hello()->set_process_id("vanishing " + std::to_string(number));
  protocol::WorkerMessage credit;
  credit.mutable_credit()->set_batches(kRequestedBatches);
  for (const auto* message : {&hello, &credit}) {
    static_cast<void>(
        socket.send(zmq::buffer(protocol::encode(*message)), zmq::send_flags::dontwait));
  }
  constexpr int kMaxMessages = 4;  // the server sends a welcome, a study and two batches
  for (int i = 0; i < kMaxMessages; ++i) {
    zmq::message_t frame;
    protocol::ServerToWorker message;
    if (!socket.recv(frame) || !protocol::decode(frame.to_string_view(), message)) {
      return false;
    }
    if (message.has_batch()) {
      return true;
    }
  }
  return false;
}

}  // namespace

Storm::Storm(StormKind kind, const TemporaryFolder& folder, const std::string& server_url,
             const Environment& environment)
    : folder_(folder), server_url_(server_url), environment_(environment) {
  if (kind == StormKind::kCutConnections) {
    proxy_ = std::make_unique<TcpProxy>(server_url, milliseconds(0), kBetweenCuts);
    behind_proxy_ = std::make_unique<Worker>(folder, proxy_->url(), kOneThread, environment);
  } else {
    thread_ = std::jthread([this, kind](const std::stop_token& stop) {
      kind == StormKind::kKilledWorkers ? kill_workers(stop) : let_peers_vanish(stop);
    });
  }
}

Storm::~Storm() {
  end();
}

void Storm::end() {
  thread_.request_stop();
  if (thread_.joinable()) {
    thread_.join();
  }
  behind_proxy_.reset();
}

void Storm::kill_workers(const std::stop_token& stop) {
  std::mt19937 random(1);
  while (!stop.stop_requested()) {
    Worker worker(folder_, server_url_, kOneThread, environment_);
    const auto life_ms = static_cast<int>(random() % (kLongestLife_ms - kShortestLife_ms));
    std::this_thread::sleep_for(milliseconds(kShortestLife_ms + life_ms));
    for (const pid_t solver : children_of(worker.pid())) {
      kill(solver, faults_ % 2 == 0 ? SIGKILL : SIGCONT);  // else it leaves when its parent ends
    }
    worker.send(SIGKILL);
    worker.wait();
    ++faults_;
  }
}

void Storm::let_peers_vanish(const std::stop_token& stop) {
  const std::string solver_version = worker_solver_version();
  for (int number = 1; !stop.stop_requested(); ++number) {
    faults_ += vanish_with_points(server_url_, solver_version, number) ? 1 : 0;
    std::this_thread::sleep_for(milliseconds(10));
  }
}

}  // namespace oblique::test
