#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "server/service.h"
#include "tests/simulation/network.h"
#include "tests/simulation/simulated_disk.h"
#include "tests/simulation/world.h"

namespace oblique::simulation {

/// The real service and scheduler on a simulated disk and network. It can be killed at any moment
/// and starts again from what the disk has.
class SimulatedServer final : public server::Outbox {
 public:
  /// Called with each acknowledgement before it is sent: its results must be durable.
  using OnAcknowledged = std::function<void(const std::string& identity, std::uint64_t sequence)>;

  SimulatedServer(World& world, SimulatedDisk& disk, std::uint32_t max_losses);

  void start();
  void crash(bool power_is_lost);
  bool runs() const { return service_.has_value(); }
  const server::Service& service() const { return *service_; }

  void worker_frame(const std::string& identity, const std::string& frame);
  void client_frame(const std::string& identity, const std::string& frame);

  bool to_worker(const std::string& identity, const protocol::ServerToWorker& message) override;
  void to_client(const std::string& identity, const protocol::ClientReply& reply) override;
  void write(server::WriteJob job) override;
  bool query(server::QueryJob) override { return false; }
  void note(server::Severity, const std::string&) override {}

  Network* workers = nullptr;
  Network* clients = nullptr;
  OnAcknowledged on_acknowledged;
  std::uint64_t crashes = 0;

 private:
  server::Instant now() const { return {world_.now_ms(), 1'700'000'000'000 + world_.now_ms()}; }
  void tick();
  void write_group();

  World& world_;
  SimulatedDisk& disk_;
  std::uint32_t max_losses_;
  std::optional<server::Service> service_;
  std::optional<server::GroupCommit> commits_;
  std::deque<server::WriteJob> jobs_;
  bool writing_ = false;
  std::uint64_t life_ = 0;  // counts starts: what an earlier life planned does not happen
};

}  // namespace oblique::simulation
