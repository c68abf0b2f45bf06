#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <zmq.hpp>

#include "proto/oblique.pb.h"

namespace oblique::test {

/// A peer that speaks as a worker does and solves nothing. Its connection is gone when it is.
class PretendedWorker {
 public:
  /// Connects to where the server awaits workers.
  explicit PretendedWorker(const std::string& server_url);

  void hello(const std::string& solver_version, const std::string& process_id);
  void credit(std::uint32_t batches);
  void heartbeat(const std::vector<std::uint64_t>& leases);
  void goodbye();
  /// The next message, if one comes in that time.
  std::optional<protocol::ServerToWorker> receive(std::chrono::milliseconds within);

 private:
  void send(const protocol::WorkerMessage& message);

  zmq::context_t context_;
  zmq::socket_t socket_;
};

/// Version of the solver of the workers under test.
std::string worker_solver_version();

}  // namespace oblique::test
