#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "proto/frames.h"
#include "server/service/service.h"
#include "tests/simulation/disk/simulated_disk.h"
#include "tests/simulation/world.h"

namespace oblique::simulation {

/// The real service, scheduler and store on a simulated disk and network. The server can be killed
/// at any moment, frozen, or stopped in an orderly way. After its end another server starts with
/// the contents of the disk.
class SimulatedServer final : public server::Ports {
 public:
  /// Called before each acknowledgement of results. The results must be durable by then.
  using OnAcknowledged = std::function<void(const std::string& identity, std::uint64_t sequence)>;

  /// Called with the contents that a starting server has read from the store.
  using OnStarted = std::function<void(const Found& found)>;

  SimulatedServer(World& world, SimulatedDisk& disk) : world_(world), disk_(disk) {}

  /// Starts the server, and tries again while the disk fails.
  void start() {
    ++life_;
    Found found;
    try {
      found = disk_.open();
    } catch (const server::StorageError& error) {
      if (!disk_.is_at_fault()) {
        throw Violation("a server cannot start: " + std::string(error.what()));
      }
      disk_.crash(false);
      after(500, [this] { start(); });
      return;
    }
    on_started(found);
    server::ServiceSettings settings;
    // server/event_loop/event_loop.cpp computes the first lease number in the same way.
    settings.scheduler.first_lease_id = found.starts << 40U;
    settings.solver_version = "1";
    settings.database_id = "disk";
    settings.last_study_id = found.last_study_id;
    settings.last_worker_id = found.last_worker_id;
    commits_.emplace(disk_);
    commits_->resume_deletions();
    service_.emplace(settings, *this, std::move(found.studies), now());
    clear_some();
    tick();
  }
  void crash(bool power_is_lost) {
    ++crashes;
    power_losses += power_is_lost ? 1U : 0U;
    deaths_in_writes += disk_.died() ? 1U : 0U;
    disk_.crash(power_is_lost);
    end();
  }
  /// Stops the server in an orderly way, as SIGTERM does. Another server starts later.
  void stop() {
    service_->stop(now());
    while (!jobs_.empty() && !disk_.died()) {
      for (const auto& report : commits_->write(jobs_)) {
        service_->written(report, now());
      }
      if (commits_->is_faulty() || commits_->is_gone()) {
        break;
      }
    }
    if (!disk_.died() && !commits_->is_gone()) {
      std::vector<server::WriteReport> ignored;
      commits_->merge(ignored);
    }
    disk_.close();
    if (disk_.died()) {
      disk_.crash(false);
    }
    end();
  }
  /// Freezes the process for a while, as SIGSTOP does.
  void freeze(std::int64_t duration_ms) { frozen_until_ms_ = world_.now_ms() + duration_ms; }
  bool runs() const { return service_.has_value(); }
  /// Returns true if no rows of deleted studies are left.
  bool has_cleared() const { return commits_.has_value() && !commits_->has_to_clear(); }
  const server::Service& service() const { return *service_; }

  void worker_frame(const std::string& identity, const std::string& frame) {
    take([this, identity, frame] { service_->worker_frame(identity, frame, now()); });
  }
  void client_frame(const std::string& identity, const std::string& frame) {
    take([this, identity, frame] { service_->client_frame(identity, frame, now()); });
  }

  server::Delivery to_worker(const std::string& identity, const std::string& frame) override {
    protocol::ServerToWorker message;
    if (protocol::decode(frame, message) && message.has_results_stored()) {
      on_acknowledged(identity, message.results_stored().sequence());
    }
    return workers->send_to(identity, frame) ? server::Delivery::kSent : server::Delivery::kGone;
  }
  bool is_busy(const std::string&) const override { return false; }
  bool to_client(const std::string& identity, const std::string& frame) override {
    return clients->send_to(identity, frame);
  }
  void write(server::WriteJob job) override {
    jobs_.push_back(std::move(job));
    if (!writing_) {
      writing_ = true;
      after(world_.between(1, 20), [this] { write_group(); });
    }
  }
  bool query(server::QueryJob) override { return false; }
  void more_rows(std::uint64_t, std::uint64_t) override {}
  void cancel_query(std::uint64_t) override {}
  void run_check(Check check) override {
    after(1, [this, check = std::move(check)] { check()(now()); });
  }
  void log(server::Severity, const std::string&) override {}

  Network* workers = nullptr;
  Network* clients = nullptr;
  OnAcknowledged on_acknowledged;
  OnStarted on_started;
  std::uint64_t crashes = 0;
  std::uint64_t power_losses = 0;      // number of crashes with a power failure
  std::uint64_t deaths_in_writes = 0;  // number of crashes during a write
  std::uint64_t failed_syncs = 0;      // number of crashes after a failed sync

 private:
  server::Instant now() const { return {world_.now_ms(), world_.utc_ms()}; }
  /// Runs `what` after a delay, as soon as the process is not frozen. Drops `what` if a new process
  /// starts first.
  void after(std::int64_t delay_ms, std::function<void()> what) {
    world_.after(delay_ms, [this, life = life_, what = std::move(what)] {
      if (life != life_) {
        return;
      }
      if (world_.now_ms() < frozen_until_ms_) {
        after(frozen_until_ms_ - world_.now_ms(), what);
        return;
      }
      what();
    });
  }
  void take(std::function<void()> frame) {
    if (!service_) {
      return;
    }
    if (held_.empty() && world_.now_ms() >= frozen_until_ms_) {
      frame();
      return;
    }
    held_.push_back(std::move(frame));
    if (held_.size() == 1) {
      after(0, [this] {
        for (const auto& held : std::exchange(held_, {})) {
          held();
        }
      });
    }
  }
  void end() {
    ++life_;
    service_.reset();
    jobs_.clear();
    held_.clear();
    writing_ = false;
    clearing_ = false;
    frozen_until_ms_ = 0;
    workers->break_links();
    clients->break_links();
    after(world_.faults ? world_.between(1, 5000) : 10, [this] { start(); });
  }
  /// If the process died in a write or a sync failed, crashes the server and returns true.
  bool ends() {
    const bool sync_failed = commits_->is_gone();
    if (!disk_.died() && !sync_failed) {
      return false;
    }
    failed_syncs += sync_failed ? 1U : 0U;
    crash(world_.chance(0.4));
    return true;
  }
  void tick() {
    service_->tick(now());
    after(250, [this] { tick(); });
  }
  void write_group() {
    const auto reports = commits_->write(jobs_);
    if (ends()) {
      return;
    }
    if (world_.faults &&
        world_.chance(0.003)) {  // a crash after a commit, before the service gets the reports
      crash(world_.chance(0.4));
      return;
    }
    writing_ = false;
    clear_some();
    for (const auto& report : reports) {
      service_->written(report, now());
    }
    if (!jobs_.empty() && !writing_) {
      writing_ = true;
      after(commits_->is_faulty() ? 500 : 1, [this] { write_group(); });
    } else if (jobs_.empty()) {
      commits_->maintain();
      ends();
    }
  }
  /// Clears rows of deleted studies in small steps between commits, as the server's writer does.
  void clear_some() {
    if (clearing_ || !commits_->has_to_clear()) {
      return;
    }
    clearing_ = true;
    after(world_.between(1, 40), [this] {
      clearing_ = false;
      std::vector<server::WriteReport> reports;
      const bool goes_on =
          commits_->clear(static_cast<std::size_t>(world_.between(1, 30)), reports);
      if (ends()) {
        return;
      }
      for (const auto& report : reports) {
        service_->written(report, now());
      }
      if (goes_on) {
        clear_some();
      } else {
        after(500, [this] { clear_some(); });
      }
    });
  }

  World& world_;
  SimulatedDisk& disk_;
  std::optional<server::Service> service_;
  std::optional<server::GroupCommit> commits_;
  std::deque<server::WriteJob> jobs_;
  bool writing_ = false;
  bool clearing_ = false;  // a step of clear_some() is planned
  std::int64_t frozen_until_ms_ = 0;
  std::deque<std::function<void()>> held_;  // frames received while frozen, in order
  std::uint64_t life_ = 0;  // number of processes; events of earlier processes are ignored
};

}  // namespace oblique::simulation
