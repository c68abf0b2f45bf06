// The part of the scheduler that knows which workers there are and what they say of themselves.
#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/scheduler/scheduler.h"

namespace oblique::server {
namespace {

/// Longest gap between two ticks that counts as silence of the workers. In a longer one it was the
/// server that did not run, and what the workers said meanwhile still waits to be read.
constexpr std::int64_t kLongestTick_ms = 1000;

}  // namespace

void Scheduler::on(const WorkerJoined& event) {
  if (workers_.contains(event.worker)) {
    return;
  }
  Worker worker{};
  worker.threads = std::max(event.threads, 1U);
  worker.solver_version = event.solver_version;
  worker.last_heard_ms = now_ms_;
  worker.process = processes_.join(event.process, event.worker);
  threads_ += worker.threads;
  ++versions_[worker.solver_version];
  const ProcessNumber process = worker.process;
  workers_.emplace(event.worker, std::move(worker));
  if (event.process_has_one_worker) {
    for (const WorkerId earlier : std::set<WorkerId>(processes_.at(process).workers)) {
      if (earlier != event.worker) {
        remove_worker(earlier, WorkerEnd::kReplaced);
        effects_.emplace_back(DropWorker{earlier, "its process has a new connection"});
      }
    }
  }
  take_back_losses(process);
  standing_of_processes_changed();
}

Scheduler::Worker* Scheduler::heard_from(WorkerId worker) {
  const auto found = workers_.find(worker);
  if (found == workers_.end()) {
    return nullptr;
  }
  found->second.last_heard_ms = now_ms_;
  ready_workers_.wake(worker);
  return &found->second;
}

void Scheduler::on(const CreditGiven& event) {
  if (Worker* worker = heard_from(event.worker)) {
    const std::uint32_t room = settings_.max_credit - worker->credit;
    worker->credit += std::min(event.batches, room);
    queue(event.worker, *worker);
  }
}

/// Adds a worker with credit to those that are served.
void Scheduler::queue(WorkerId id, const Worker& worker) {
  if (worker.credit > 0) {
    ready_workers_.add(id);
  }
}

void Scheduler::on(const HeartbeatReceived& event) {
  Worker* worker = heard_from(event.worker);
  if (worker == nullptr) {
    return;
  }
  // A lease that the worker still does not name when a batch must long have reached it never did.
  const std::set<LeaseId> held(event.leases.begin(), event.leases.end());
  if (worker->probe != 0 && !held.contains(worker->probe) &&
      now_ms_ - *worker->probed_ms > settings_.lost_after_ms) {
    worker->probe = 0;
  }
  std::vector<LeaseId> strayed;
  for (const LeaseId id : worker->leases) {
    if (!held.contains(id) && now_ms_ - leases_.at(id).granted_ms > settings_.lost_after_ms) {
      strayed.push_back(id);
    }
  }
  for (const LeaseId id : strayed) {
    end_lease(id, std::nullopt);
  }
}

void Scheduler::on(const BatchesReturned& event) {
  Worker* worker = heard_from(event.worker);
  if (worker == nullptr) {
    return;
  }
  for (const LeaseId lease : event.leases) {
    if (worker->leases.contains(lease)) {
      end_lease(lease, std::nullopt);
    } else if (lease == worker->probe) {
      worker->probe = 0;
    }
  }
}

void Scheduler::on(const WorkerLeft& event) {
  remove_worker(event.worker, WorkerEnd::kLeft);
}

void Scheduler::on(const WorkerUnreachable& event) {
  const auto found = workers_.find(event.worker);
  if (found == workers_.end()) {
    return;
  }
  for (const LeaseId lease : event.unsent) {
    if (found->second.leases.contains(lease)) {
      end_lease(lease, std::nullopt);
    }
  }
  remove_worker(event.worker, WorkerEnd::kLost);
  effects_.emplace_back(DropWorker{event.worker, event.reason});
}

void Scheduler::on(const Tick&) {
  const std::int64_t gap_ms = last_tick_ms_ < 0 ? 0 : now_ms_ - last_tick_ms_;
  last_tick_ms_ = now_ms_;
  standing_of_processes_changed();  // time has passed
  fail_condemned();
  std::vector<WorkerId> lost;
  for (auto& [id, worker] : workers_) {
    if (gap_ms > kLongestTick_ms) {
      worker.last_heard_ms = std::min(now_ms_, worker.last_heard_ms + gap_ms - kLongestTick_ms);
      worker.stored_ms = std::min(now_ms_, worker.stored_ms + gap_ms - kLongestTick_ms);
    }
    if (held_) {  // results may wait to be taken
      worker.stored_ms = now_ms_;
    }
    if (now_ms_ - worker.last_heard_ms > settings_.lost_after_ms) {
      lost.push_back(id);
    }
  }
  for (const WorkerId id : lost) {
    const std::int64_t silent_ms = now_ms_ - workers_.at(id).last_heard_ms;
    remove_worker(id, WorkerEnd::kLost);
    effects_.emplace_back(DropWorker{id, "silent for " + std::to_string(silent_ms) + " ms"});
  }
  end_stalled();
}

void Scheduler::remove_worker(WorkerId id, WorkerEnd how) {
  const auto found = workers_.find(id);
  if (found == workers_.end()) {
    return;
  }
  const ProcessNumber process = found->second.process;
  note_end(found->second, how);
  std::optional<Loss> loss;
  const std::set<LeaseId> leases = found->second.leases;
  if (how == WorkerEnd::kLost) {
    loss = Loss{process, is_proven(found->second) && leases.size() == 1};
  }
  for (const LeaseId lease : leases) {
    end_lease(lease, loss);
  }
  ready_workers_.remove(id);
  set_draining(found->second, false);
  threads_ -= found->second.threads;
  if (const auto version = versions_.find(found->second.solver_version); --version->second == 0) {
    versions_.erase(version);
  }
  workers_.erase(found);
  processes_.leave(process, id);
  standing_of_processes_changed();
}

void Scheduler::on(const WorkerBusy& event) {
  const auto found = workers_.find(event.worker);
  if (found != workers_.end()) {
    found->second.is_busy = event.is_busy;
    set_draining(found->second, found->second.draining && !event.is_busy);
    ready_workers_.wake(event.worker);
  }
}

}  // namespace oblique::server
