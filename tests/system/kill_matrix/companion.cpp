#include "tests/system/kill_matrix/companion.h"

#include <chrono>
#include <vector>

#include "tests/system/storms/pretended_worker.h"

namespace oblique::test {
namespace {

constexpr std::chrono::milliseconds kBetweenHeartbeats{200};

/// Sends heartbeats and holds a batch until it is told to stop.
void accompany(const std::stop_token& stop, const std::string& server_url) {
  PretendedWorker peer(server_url);
  peer.hello(worker_solver_version(), "companion");
  peer.credit(1);
  std::vector<std::uint64_t> leases;
  while (!stop.stop_requested()) {
    const auto message = peer.receive(kBetweenHeartbeats);
    if (message && message->has_batch()) {
      leases.push_back(message->batch().lease_id());
    }
    if (message && message->has_hello_again()) {
      return;  // the server was started again
    }
    if (!message) {
      peer.heartbeat(leases);
    }
  }
}

}  // namespace

Companion::Companion(const std::string& point, const std::string& server_url) {
  if (point.ends_with(":release")) {
    thread_ = std::jthread([=](const std::stop_token& stop) { accompany(stop, server_url); });
  }
}

}  // namespace oblique::test
