#include "tests/simulation/simulated_server.h"

#include <utility>

#include "proto/frames.h"

namespace oblique::simulation {

SimulatedServer::SimulatedServer(World& world, SimulatedDisk& disk, std::uint32_t max_losses)
    : world_(world), disk_(disk), max_losses_(max_losses) {}

void SimulatedServer::start() {
  Found found = disk_.load();
  server::ServiceSettings settings;
  settings.scheduler.max_losses = max_losses_;
  settings.scheduler.first_lease_id = static_cast<std::uint64_t>(world_.now_ms()) << 12U;
  settings.solver_version = "1";
  settings.database_id = "disk";
  settings.last_study_id = found.last_study_id;
  settings.last_worker_id = found.last_worker_id;
  ++life_;
  commits_.emplace(disk_);
  service_.emplace(settings, *this, std::move(found.studies), now());
  tick();
}

void SimulatedServer::crash(bool power_is_lost) {
  ++crashes;
  ++life_;
  service_.reset();
  jobs_.clear();
  writing_ = false;
  workers->break_all();
  clients->break_all();
  if (power_is_lost) {
    disk_.lose_power(static_cast<std::uint64_t>(world_.between(1, 5)));
  }
  world_.after(world_.faults ? world_.between(1, 5000) : 10, [this] { start(); });
}

void SimulatedServer::tick() {
  service_->tick(now());
  world_.after(250, [this, life = life_] {
    if (life == life_) {
      tick();
    }
  });
}

void SimulatedServer::worker_frame(const std::string& identity, const std::string& frame) {
  if (service_) {
    service_->worker_frame(identity, frame, now());
  }
}

void SimulatedServer::client_frame(const std::string& identity, const std::string& frame) {
  if (service_) {
    service_->client_frame(identity, frame, now());
  }
}

bool SimulatedServer::to_worker(const std::string& identity,
                                const protocol::ServerToWorker& message) {
  if (message.has_results_stored()) {
    on_acknowledged(identity, message.results_stored().sequence());
  }
  return workers->send_to(identity, protocol::encode(message));
}

void SimulatedServer::to_client(const std::string& identity, const protocol::ClientReply& reply) {
  clients->send_to(identity, protocol::encode(reply));
}

void SimulatedServer::write(server::WriteJob job) {
  jobs_.push_back(std::move(job));
  if (!writing_) {
    writing_ = true;
    world_.after(world_.between(1, 20), [this, life = life_] {
      if (life == life_) {
        write_group();
      }
    });
  }
}

void SimulatedServer::write_group() {
  const auto reports = commits_->write(jobs_);
  if (world_.faults && world_.chance(0.003)) {
    crash(false);  // after the commit and before anybody knows of it
    return;
  }
  writing_ = false;
  for (const auto& report : reports) {
    service_->written(report, now());
  }
  if (!jobs_.empty() && !writing_) {
    writing_ = true;
    world_.after(commits_->is_faulty() ? 500 : 1, [this, life = life_] {
      if (life == life_) {
        write_group();
      }
    });
  }
}

}  // namespace oblique::simulation
