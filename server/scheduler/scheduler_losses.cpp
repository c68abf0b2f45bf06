// Consequences of lost and stalled workers for their points.
#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/scheduler/scheduler.h"

namespace oblique::server {

// ---- Lost workers and crashed solvers ---------------------------------------------------------

/// Ends the connection of a process, if it has one.
void Scheduler::end_connection(const std::string& process, WorkerEnd how,
                               const std::string& reason) {
  if (const auto found = connections_.find(process); found != connections_.end()) {
    const WorkerId worker = found->second;
    remove_worker(worker, how);
    effects_.emplace_back(DropWorker{worker, reason});
  }
}

/// Records the leases of a worker that ends, in case its process returns or is replaced.
void Scheduler::note_end(const Worker& worker, WorkerEnd how) {
  if (worker.process.empty() || how == WorkerEnd::kLeft) {
    return;
  }
  LostProcess& lost = lost_[worker.process];
  lost.losses = worker.losses + worker.leases.size();
  for (const LeaseId id : worker.leases) {
    if (how == WorkerEnd::kLost) {
      const Lease& lease = leases_.at(id);
      const std::vector<Interval> open = open_places(lease);
      LostProcess::Points held{lease.study, {}, worker.leases.size() == 1 && size_of(open) == 1};
      for (const Interval& places : open) {
        held.points.insert(studies_.at(lease.study).points.order().points(places));
      }
      lost.held.push_back(std::move(held));
    }
  }
  if (lost_.size() > settings_.most_lost_processes) {
    lost_.erase(lost_.begin());
  }
}

/// Removes the record of a lost process and returns it. The record is empty for other processes.
Scheduler::LostProcess Scheduler::take_lost(const std::string& process) {
  auto found = lost_.extract(process);
  return found.empty() ? LostProcess{} : std::move(found.mapped());
}

/// Ends the row of losses of the point that a returned process held alone: the process lives.
void Scheduler::forgive(const LostProcess& returned) {
  for (const auto& [study, points, alone] : returned.held) {
    if (alone && !points.empty() && studies_.contains(study)) {
      if (LeaseHistory* history = history_of(studies_.at(study), points.front().begin)) {
        history->lost_alone = 0;
      }
    }
  }
}

/// Makes the points on which the solver of a lost process crashed suspect. Points that the process
/// did not hold are ignored. A point fails at the second crash of a process that held it alone.
void Scheduler::blame(const LostProcess& lost, const EndedProcess& ended) {
  for (const auto& [id, point] : ended.points) {
    const auto held =
        std::ranges::find_if(lost.held, [&, study = id, number = point](const auto& e) {
          return e.study == study && e.points.contains(number);
        });
    const auto study = studies_.find(id);
    if (held == lost.held.end() || study == studies_.end()) {
      continue;
    }
    const std::uint64_t place = study->second.points.order().place(point);
    LeaseHistory* history = history_of(study->second, point);
    if (history == nullptr || !history->has_crashed) {
      if (study->second.points.leased_set().contains(place)) {
        release_leases(study->second, IntervalSet(place, place + 1));
      }
      history = study->second.points.suspect(point);
    }
    const bool was_alone = held->alone && ended.points.size() == 1;
    const int first_signal =
        history != nullptr && was_alone ? std::exchange(history->signal, ended.signal) : 0;
    requeue(id);
    if (first_signal != 0) {
      const std::string last = std::to_string(ended.signal);
      fail_point(
          id, point, history->attempts,
          "the solver crashed on this point: signal " +
              (first_signal == ended.signal ? last + ", twice"
                                            : std::to_string(first_signal) + ", then " + last));
    }
  }
}

/// Returns the history of a point that is returned or leased alone; null for other points.
LeaseHistory* Scheduler::history_of(Study& study, std::uint64_t point) {
  const std::uint64_t place = study.points.order().place(point);
  for (const LeaseId id : study.leases) {
    if (Lease& lease = leases_.at(id); lease.alone && lease.batch.first_place == place) {
      return &lease.batch.history;
    }
  }
  return study.points.returned_history(point);
}

void Scheduler::fail_point(StudyId id, std::uint64_t point, std::uint32_t attempts,
                           std::string reason) {
  Study& study = studies_.at(id);
  if (!study.points.receive(point)) {
    return;  // its result has arrived
  }
  effects_.emplace_back(StoreFailure{id, point, attempts, std::move(reason)});
  for (const LeaseId lease : std::set<LeaseId>(study.leases)) {
    release_if_answered(lease);
  }
  requeue(id);
}

// ---- Stalled workers --------------------------------------------------------------------------

/// Ends the leases of stalled workers, so that others get the points. A stalled worker may only be
/// slow, so no point counts as lost, and late results of the worker are stored.
void Scheduler::end_stalled() {
  FastestPaces paces;
  for (auto& [id, worker] : workers_) {
    const std::int64_t quiet_ms = now_ms_ - worker.stored_ms;
    if (!worker.leases.empty() && quiet_ms > settings_.shortest_stall_ms &&
        quiet_ms > longest_stall_ms(worker, paces)) {
      stall(worker, quiet_ms);
    }
  }
}

/// Ends the leases of a worker. The worker gets no batch for this time, unless it stores something.
void Scheduler::stall(Worker& worker, std::int64_t duration_ms) {
  worker.stalled_until_ms = now_ms_ + duration_ms;
  worker.solved_batches = 0;
  worker.losses += worker.leases.size();
  for (const LeaseId lease : std::set<LeaseId>(worker.leases)) {
    effects_.emplace_back(ReleaseBatch{leases_.at(lease).worker, lease});
    end_lease(lease);
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

}  // namespace oblique::server
