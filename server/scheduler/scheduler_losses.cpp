// Consequences of lost workers for their points and their processes.
#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/scheduler/scheduler.h"

namespace oblique::server {
namespace {

/// Splits the interval into up to `parts` parts of nearly equal size.
std::vector<Interval> split(const Interval& interval, std::uint64_t parts) {
  const std::uint64_t size = (interval.end - interval.begin + parts - 1) / parts;
  std::vector<Interval> all;
  for (std::uint64_t begin = interval.begin; begin < interval.end; begin += size) {
    all.push_back({begin, std::min(begin + size, interval.end)});
  }
  return all;
}

}  // namespace

// ---- Points -----------------------------------------------------------------------------------

/// Records that the process was lost with points of this study and may return.
void Scheduler::note_process(StudyId study, ProcessNumber process) {
  if (process != kNoProcess) {
    processes_.at(process).in_histories.insert(study);
  }
}

/// Handles a lease that ended without an answer to the points at `held`.
void Scheduler::note_loss(const Lease& lease, const std::vector<Interval>& held, Loss loss) {
  StudyPoints& points = studies_.at(lease.study).points;
  loss.alone = loss.alone && size_of(held) == 1;
  LossHistory losses = lease.batch.losses;
  losses.add(loss);
  const Suspicion suspicion = losses.suspicion(settings_.loss_limits);
  // The parts are suspect too. Parts without the harmful point are solved; the rest is split again.
  const std::uint64_t parts = suspicion == Suspicion::kSound ? 1 : settings_.suspect_parts;
  for (const Interval& interval : held) {
    points.give_back(split(interval, parts), lease.batch.attempts + 1, losses, now_ms_);
  }
  if (suspicion == Suspicion::kFailing) {
    failing_.insert(lease.study);
  }
}

/// Removes the losses of a process that is alive: the points that it held did not kill it.
void Scheduler::take_back_losses(ProcessNumber number) {
  const std::set<StudyId> in_histories = std::exchange(processes_.at(number).in_histories, {});
  for (const StudyId study : in_histories) {
    studies_.at(study).points.take_back_losses(number);
    for (const LeaseId lease : studies_.at(study).leases) {
      leases_.at(lease).batch.losses.take_back(number);
    }
    requeue(study);
  }
}

/// Fails each failing point if no process that was lost with it has returned in time.
void Scheduler::fail_due_points() {
  for (const StudyId id : std::set<StudyId>(failing_)) {
    StudyPoints& points = studies_.at(id).points;
    for (const auto& [point, attempts, alone] :
         points.take_due_failures(now_ms_ - settings_.return_within_ms)) {
      effects_.emplace_back(StoreFailure{
          id, point, attempts,
          "no answer: " + std::to_string(attempts) + " leases of this point ended without one, " +
              std::to_string(alone) +
              " of them because the worker was lost or gave up while it held only this point"});
    }
    if (!points.has(Suspicion::kFailing)) {
      failing_.erase(id);
    }
  }
}

// ---- Workers ----------------------------------------------------------------------------------

/// If the worker has ended with leases, updates the loss counts of its process.
void Scheduler::note_end(const Worker& worker, WorkerEnd how) {
  if (worker.leases.empty()) {
    return;
  }
  WorkerProcess& process = processes_.at(worker.process);
  if (how != WorkerEnd::kLeft) {
    ++process.lost_in_a_row;
    process.losses += worker.leases.size();
  }
  if (how != WorkerEnd::kReplaced && !process.proven_since_ms) {
    vanished_ms_.push_back(now_ms_);
    while (vanished_ms_.size() > settings_.vanished_newcomers) {
      vanished_ms_.pop_front();
    }
  }
}

void Scheduler::note_answers(Worker& worker, const ResultsReceived& event, bool any_accepted) {
  WorkerProcess& process = processes_.at(worker.process);
  const bool was_proven = process.proven_since_ms.has_value();
  const std::uint32_t lost_before = process.lost_in_a_row;
  const auto lease = leases_.find(event.lease);
  const bool is_probe = event.lease != 0 && event.lease == worker.probe;
  const bool is_its_lease = lease != leases_.end() && worker.leases.contains(event.lease) &&
                            lease->second.study == event.study;
  const auto is_of_lease = [&](std::uint64_t point) {
    const std::uint64_t place = studies_.at(event.study).points.order().place(point);
    const Batch& batch = lease->second.batch;
    return place >= batch.first_place && place < batch.end();
  };
  const bool solved =
      std::any_of(event.outcomes.begin(), event.outcomes.end(), [&](const PointOutcome& outcome) {
        return !outcome.failed && (is_probe || (is_its_lease && is_of_lease(outcome.point)));
      });
  if (is_probe) {
    worker.probe = 0;
  }
  if (solved && !process.proven_since_ms) {
    process.proven_since_ms = now_ms_;
  }
  if (solved || any_accepted) {
    process.lost_in_a_row = 0;
  } else if (is_its_lease && event.batch_done && event.outcomes.empty() &&
             has_open_points(lease->second)) {
    ++process.lost_in_a_row;
    ++process.losses;
  }
  if (process.proven_since_ms.has_value() != was_proven || process.lost_in_a_row != lost_before) {
    ready_workers_.unpark_all();
  }
}

/// Ends the leases of stalled workers, so that others get the points. A stalled worker may only be
/// slow, so no point counts as lost, and late results of the worker are stored. The worker gets
/// points again after it has solved a point.
void Scheduler::end_stalled() {
  FastestPaces paces;
  bool any_stalled = false;
  for (auto& [id, worker] : workers_) {
    const std::int64_t quiet_ms = now_ms_ - worker.stored_ms;
    if (worker.leases.empty() || quiet_ms <= settings_.shortest_stall_ms ||
        quiet_ms <= longest_stall_ms(worker, paces)) {
      continue;
    }
    any_stalled = true;
    worker.solved_batches = 0;
    stop_draining(id);
    WorkerProcess& process = processes_.at(worker.process);
    process.lost_in_a_row = std::max(process.lost_in_a_row, settings_.set_aside_after);
    process.losses += worker.leases.size();
    for (const LeaseId lease : std::set<LeaseId>(worker.leases)) {
      effects_.emplace_back(ReleaseBatch{id, lease});
      end_lease(lease, std::nullopt);
    }
  }
  if (any_stalled) {
    ready_workers_.unpark_all();
  }
}

double Scheduler::fastest_pace(StudyId id, FastestPaces& known) const {
  const auto [fastest, is_new] = known.try_emplace(id, 0.0);
  if (is_new) {
    for (const auto& [number, worker] : workers_) {
      const auto pace = worker.paces.find(id);
      const double s_per_point = pace == worker.paces.end() ? 0.0 : pace->second.s_per_solved();
      if (s_per_point > 0.0 && (fastest->second == 0.0 || s_per_point < fastest->second)) {
        fastest->second = s_per_point;
      }
    }
  }
  return fastest->second;
}

/// Returns the time without stored points after which the worker counts as stalled [ms].
std::int64_t Scheduler::longest_stall_ms(const Worker& worker, FastestPaces& paces) const {
  double longest_s = 0.0;
  for (const LeaseId id : worker.leases) {
    const Lease& lease = leases_.at(id);
    // A thread solves its lanes side by side, so a single point takes as long as a full set of
    // lanes.
    const double points = std::max(static_cast<double>(lease.batch.points) / worker.threads,
                                   static_cast<double>(settings_.lanes));
    longest_s = std::max(longest_s, fastest_pace(lease.study, paces) * points);
  }
  return static_cast<std::int64_t>(std::clamp(1e3 * settings_.stall_factor * longest_s,
                                              static_cast<double>(settings_.shortest_stall_ms),
                                              static_cast<double>(settings_.longest_stall_ms)));
}

bool Scheduler::is_proven(const Worker& worker) const {
  return processes_.at(worker.process).proven_since_ms.has_value();
}

/// Returns whether the worker's process was lost several times in a row, or is new while other new
/// processes are being lost.
bool Scheduler::is_set_aside(const Worker& worker) const {
  const WorkerProcess& process = processes_.at(worker.process);
  return process.lost_in_a_row >= settings_.set_aside_after ||
         (!process.proven_since_ms && vanished_ms_.size() >= settings_.vanished_newcomers &&
          now_ms_ - vanished_ms_.front() <= settings_.newcomers_watched_ms);
}

/// Returns whether no other worker has been proven longer than this one. Ignores workers that are
/// set aside.
bool Scheduler::is_longest_proven(const Worker& worker) const {
  const auto since_ms = processes_.at(worker.process).proven_since_ms;
  return since_ms && std::ranges::none_of(workers_, [&](const auto& entry) {
           const auto other_ms = processes_.at(entry.second.process).proven_since_ms;
           return other_ms && *other_ms < *since_ms && !is_set_aside(entry.second);
         });
}

/// Sends a probe, which is an easy point, unless the worker got one recently. Returns whether it
/// did.
bool Scheduler::probe(WorkerId id, Worker& worker) {
  if (!worker.leases.empty() ||
      (worker.probed_ms && now_ms_ - *worker.probed_ms < settings_.probe_interval_ms)) {
    return false;
  }
  worker.probe = next_lease_++;
  worker.probed_ms = now_ms_;
  use_credit(id, worker);
  effects_.emplace_back(SendProbe{id, worker.probe});
  return true;
}

// ---- Processes --------------------------------------------------------------------------------

ProcessNumber WorkerProcesses::join(const std::string& id, WorkerId worker) {
  const auto known = id.empty() ? numbers_.end() : numbers_.find(id);
  const ProcessNumber number = known == numbers_.end() ? ++last_number_ : known->second;
  WorkerProcess& process = processes_[number];
  if (known == numbers_.end()) {
    process.id = id;
    if (!id.empty()) {
      numbers_.emplace(id, number);
    }
  } else if (process.workers.empty()) {
    std::erase(absent_, number);
  }
  process.workers.insert(worker);
  return number;
}

void WorkerProcesses::leave(ProcessNumber number, WorkerId worker) {
  WorkerProcess& process = processes_.at(number);
  process.workers.erase(worker);
  if (!process.workers.empty()) {
    return;
  }
  if (process.id.empty()) {
    forget(number);
    return;
  }
  absent_.push_back(number);
  if (absent_.size() > most_absent_) {
    forget(absent_.front());
    absent_.pop_front();
  }
}

void WorkerProcesses::forget(ProcessNumber number) {
  numbers_.erase(processes_.at(number).id);
  processes_.erase(number);
}

void WorkerProcesses::forget_study(StudyId study) {
  for (auto& [number, process] : processes_) {
    process.in_histories.erase(study);
  }
}

}  // namespace oblique::server
