#include "tests/system/storms/storm.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <random>
#include <vector>

#include "tests/system/storms/pretended_worker.h"

namespace oblique::test {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kBetweenCuts{150};
constexpr int kShortestLife_ms = 20;
constexpr int kLongestLife_ms = 300;
constexpr std::uint32_t kGreed = 1000;  ///< batches that a vanishing peer asks for

const std::vector<std::string> kOneThread{"--threads", "1"};

/// Whether it got a batch of a study before it vanished.
bool vanish_with_points(const std::string& server_url, const std::string& solver_version,
                        int number) {
  PretendedWorker peer(server_url);
  peer.hello(solver_version, "vanishing " + std::to_string(number));
  peer.credit(kGreed);
  constexpr int kMostMessages = 4;  // welcome, study, two batches
  for (int i = 0; i < kMostMessages; ++i) {
    const auto message = peer.receive(milliseconds(200));
    if (!message || (message->has_batch() && message->batch().study_id() != 0)) {
      return message.has_value();
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
    worker.send(SIGKILL);
    worker.wait();
    ++blows_;
  }
}

void Storm::let_peers_vanish(const std::stop_token& stop) {
  const std::string solver_version = worker_solver_version();
  for (int number = 1; !stop.stop_requested(); ++number) {
    blows_ += vanish_with_points(server_url_, solver_version, number) ? 1 : 0;
    std::this_thread::sleep_for(milliseconds(10));
  }
}

}  // namespace oblique::test
