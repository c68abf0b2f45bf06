#include "tests/system/kill_matrix/companion.h"

#include <chrono>
#include <cstdint>
#include <vector>

#include "tests/system/storms/pretended_worker.h"

namespace oblique::test {
namespace {

constexpr std::chrono::milliseconds kBetweenHeartbeats{200};

/// Says that it lives, and holds what batches it gets, until it is told to stop.
void accompany(const std::stop_token& stop, const std::string& server_url,
               const std::string& solver_version, std::uint32_t batches) {
  PretendedWorker peer(server_url);
  peer.hello(solver_version, "companion");
  if (batches > 0) {
    peer.credit(batches);
  }
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
  const bool gets_notice = point.ends_with(":notice");
  if (gets_notice || point.ends_with(":release")) {
    thread_ = std::jthread([=](const std::stop_token& stop) {
      accompany(stop, server_url, gets_notice ? "0" : worker_solver_version(), gets_notice ? 0 : 1);
    });
  }
}

}  // namespace oblique::test
