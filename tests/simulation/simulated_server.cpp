#include "tests/simulation/simulated_server.h"

#include <utility>

#include "proto/frames.h"

namespace oblique::simulation {

SimulatedServer::SimulatedServer(World& world, SimulatedDisk& disk, std::uint32_t max_losses)
    : world_(world), disk_(disk), max_losses_(max_losses) {}

void SimulatedServer::start() {
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
  settings.scheduler.loss_limits.condemned_after = max_losses_;
  // As server/event_loop/event_loop.cpp does.
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

void SimulatedServer::end() {
  ++life_;
  service_.reset();
  jobs_.clear();
  held_.clear();
  writing_ = false;
  clearing_ = false;
  frozen_until_ms_ = 0;
  workers->break_all();
  clients->break_all();
  after(world_.faults ? world_.between(1, 5000) : 10, [this] { start(); });
}

void SimulatedServer::crash(bool power_is_lost) {
  ++crashes;
  power_losses += power_is_lost ? 1U : 0U;
  deaths_in_writes += disk_.died() ? 1U : 0U;
  disk_.crash(power_is_lost);
  end();
}

void SimulatedServer::stop() {
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

/// A server whose sync failed ends as at a crash: what it acknowledged before is in the files.
bool SimulatedServer::ends() {
  const bool sync_failed = commits_->is_gone();
  if (!disk_.died() && !sync_failed) {
    return false;
  }
  failed_syncs += sync_failed ? 1U : 0U;
  crash(world_.chance(0.4));
  return true;
}

void SimulatedServer::after(std::int64_t delay_ms, std::function<void()> what) {
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

void SimulatedServer::tick() {
  service_->tick(now());
  after(250, [this] { tick(); });
}

void SimulatedServer::worker_frame(const std::string& identity, const std::string& frame) {
  take([this, identity, frame] { service_->worker_frame(identity, frame, now()); });
}

void SimulatedServer::client_frame(const std::string& identity, const std::string& frame) {
  take([this, identity, frame] { service_->client_frame(identity, frame, now()); });
}

void SimulatedServer::take(std::function<void()> frame) {
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

server::Delivery SimulatedServer::to_worker(const std::string& identity, const std::string& frame) {
  protocol::ServerToWorker message;
  if (protocol::decode(frame, message) && message.has_results_stored()) {
    on_acknowledged(identity, message.results_stored().sequence());
  }
  return workers->send_to(identity, frame) ? server::Delivery::kSent : server::Delivery::kGone;
}

bool SimulatedServer::to_client(const std::string& identity, const std::string& frame) {
  return clients->send_to(identity, frame);
}

void SimulatedServer::run_check(Check check) {
  after(1, [this, check = std::move(check)] { check()(now()); });
}

void SimulatedServer::write(server::WriteJob job) {
  jobs_.push_back(std::move(job));
  if (!writing_) {
    writing_ = true;
    after(world_.between(1, 20), [this] { write_group(); });
  }
}

/// As the writer does, between groups, in steps of some rows.
void SimulatedServer::clear_some() {
  if (clearing_ || !commits_->has_to_clear()) {
    return;
  }
  clearing_ = true;
  after(world_.between(1, 40), [this] {
    clearing_ = false;
    std::vector<server::WriteReport> reports;
    const bool goes_on = commits_->clear(static_cast<std::size_t>(world_.between(1, 30)), reports);
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

void SimulatedServer::write_group() {
  const auto reports = commits_->write(jobs_);
  if (ends()) {
    return;
  }
  if (world_.faults && world_.chance(0.003)) {  // after the commit and before its reports are read
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
    commits_->tend();
    ends();
  }
}

}  // namespace oblique::simulation
