#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "server/service/service.h"
#include "tests/simulation/disk/simulated_disk.h"
#include "tests/simulation/network.h"
#include "tests/simulation/world.h"

namespace oblique::simulation {

/// The real service, scheduler and store on a simulated disk and network. It can be killed at any
/// moment, stopped in an orderly way or for a while, and starts again from what the disk has.
class SimulatedServer final : public server::Ports {
 public:
  /// Called with each acknowledgement before it is sent: its results must be durable.
  using OnAcknowledged = std::function<void(const std::string& identity, std::uint64_t sequence)>;

  /// Called with what a server that starts found.
  using OnStarted = std::function<void(const Found& found)>;

  SimulatedServer(World& world, SimulatedDisk& disk, std::uint32_t max_losses);

  /// Tries until the disk lets it.
  void start();
  void crash(bool power_is_lost);
  /// An orderly end, as after SIGTERM; another one starts after a while.
  void stop();
  /// The process stands still for a while, as after SIGSTOP.
  void freeze(std::int64_t duration_ms) { frozen_until_ms_ = world_.now_ms() + duration_ms; }
  bool runs() const { return service_.has_value(); }
  /// Nothing of deleted studies is left.
  bool has_cleared() const { return commits_.has_value() && !commits_->has_to_clear(); }
  const server::Service& service() const { return *service_; }

  void worker_frame(const std::string& identity, const std::string& frame);
  void client_frame(const std::string& identity, const std::string& frame);

  server::Delivery to_worker(const std::string& identity, const std::string& frame) override;
  bool is_busy(const std::string&) const override { return false; }
  bool to_client(const std::string& identity, const std::string& frame) override;
  void write(server::WriteJob job) override;
  bool query(server::QueryJob) override { return false; }
  void more_rows(std::uint64_t, std::uint64_t) override {}
  void cancel_query(std::uint64_t) override {}
  void run_check(Check check) override;
  void log(server::Severity, const std::string&) override {}

  Network* workers = nullptr;
  Network* clients = nullptr;
  OnAcknowledged on_acknowledged;
  OnStarted on_started;
  std::uint64_t crashes = 0;
  std::uint64_t power_losses = 0;      // of these
  std::uint64_t deaths_in_writes = 0;  // of the crashes
  std::uint64_t failed_syncs = 0;      // of the crashes

 private:
  server::Instant now() const { return {world_.now_ms(), world_.utc_ms()}; }
  /// Runs `what` of this process life after so long, or when it is no longer frozen.
  void after(std::int64_t delay_ms, std::function<void()> what);
  void take(std::function<void()> frame);
  void end();
  /// The process died while it wrote, or must end because a sync failed. False: neither.
  bool ends();
  void tick();
  void write_group();
  void clear_some();

  World& world_;
  SimulatedDisk& disk_;
  std::uint32_t max_losses_;
  std::optional<server::Service> service_;
  std::optional<server::GroupCommit> commits_;
  std::deque<server::WriteJob> jobs_;
  bool writing_ = false;
  bool clearing_ = false;  // a step is to come
  std::int64_t frozen_until_ms_ = 0;
  std::deque<std::function<void()>> held_;  // frames that came meanwhile, in order
  std::uint64_t life_ = 0;  // counts starts: what an earlier life planned does not happen
};

}  // namespace oblique::simulation
