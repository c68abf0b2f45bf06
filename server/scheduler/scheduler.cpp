#include "server/scheduler/scheduler.h"

#include <algorithm>
#include <utility>

namespace oblique::server {

std::vector<Effect> Scheduler::handle(const Event& event, std::int64_t now_ms) {
  now_ms_ = std::max(now_ms_, now_ms);
  effects_.clear();
  seeks_stragglers_ = std::holds_alternative<Tick>(event);
  std::visit([this](const auto& e) { on(e); }, event);
  dispatch();
  return std::exchange(effects_, {});
}

void Scheduler::on(const DispatchHeld& event) {
  held_ = event.held;
}

// ---- Studies ----------------------------------------------------------------------------------

void Scheduler::on(const StudyAdded& event) {
  if (studies_.contains(event.study)) {
    return;
  }
  studies_.emplace(
      event.study,
      Study{StudyPoints(event.table, event.settled, event.left_out, settings_.loss_limits),
            event.failed, event.cancelled, event.paused, false, event.priority,
            least_served(event.study), event.solver_version});
  studies_.at(event.study).points.count_attempts(event.attempts);
  studies_.at(event.study).held = event.held;
  finish_if_complete(event.study);
  requeue(event.study);
}

void Scheduler::on(const StudyHeld& event) {
  const auto found = studies_.find(event.study);
  if (found == studies_.end() || found->second.held == event.held) {
    return;
  }
  found->second.held = event.held;
  found->second.served = least_served(event.study);
  requeue(event.study);
}

void Scheduler::on(const PointsTaken& event) {
  const auto found = studies_.find(event.study);
  if (found == studies_.end()) {
    return;
  }
  Study& study = found->second;
  const std::uint64_t settled = study.points.settle_unsolved(event.points);
  if (settled > 0 && study.solver_version.empty()) {
    study.solver_version = event.solver_version;
  }
  for (const LeaseId id : study.leases.all()) {
    release_if_answered(id);
  }
  finish_if_complete(event.study);
  requeue(event.study);
}

void Scheduler::on(const StudyCancelled& event) {
  const auto found = studies_.find(event.study);
  if (found == studies_.end() || found->second.cancelled || found->second.finished) {
    return;
  }
  found->second.cancelled = true;
  end_all_leases(event.study);
  found->second.points.rest(false);
  requeue(event.study);
  withdraw(event.study);
}

/// None of its points counts as lost.
void Scheduler::end_all_leases(StudyId id) {
  Study& study = studies_.at(id);
  study.overlaps = false;  // all leases end: whose point it was does not matter
  for (const LeaseId lease : study.leases.all()) {
    end_lease(lease, std::nullopt);
  }
}

/// Who was told of the study is told to drop it.
void Scheduler::withdraw(StudyId study) {
  for (auto& [id, worker] : workers_) {
    if (worker.defined.erase(study) != 0) {
      effects_.emplace_back(WithdrawStudy{id, study});
    }
  }
}

void Scheduler::on(const StudyPaused& event) {
  const auto found = studies_.find(event.study);
  if (found != studies_.end() && !found->second.cancelled && !found->second.finished) {
    found->second.paused = true;
    requeue(event.study);
  }
}

void Scheduler::on(const StudyReopened& event) {
  const auto found = studies_.find(event.study);
  if (found != studies_.end() && !found->second.is_open()) {
    found->second.cancelled = false;
    found->second.paused = false;
    found->second.served = least_served(event.study);
    requeue(event.study);
  }
}

void Scheduler::on(const PriorityChanged& event) {
  const auto found = studies_.find(event.study);
  if (found == studies_.end()) {
    return;
  }
  Study& study = found->second;
  study.priority = event.priority;
  study.served = least_served(event.study);
  requeue(event.study);
}

void Scheduler::on(const FailuresForgotten& event) {
  const auto found = studies_.find(event.study);
  if (found == studies_.end()) {
    return;
  }
  Study& study = found->second;
  study.failed -= std::min(study.failed, study.points.reopen(event.points));
  study.points.count_attempts(event.attempts);
  study.overlaps = !study.leases.empty();  // the lease that a point failed in may still be there
  if (study.leases.empty() && !study.points.has_results()) {
    study.solver_version.clear();
  }
  if (study.finished && !study.points.is_complete()) {
    study.finished = false;
    study.served = least_served(event.study);
  }
  requeue(event.study);
}

void Scheduler::on(const StudyGrown& event) {
  const auto found = studies_.find(event.study);
  if (found == studies_.end() || event.table.size() <= found->second.points.size()) {
    return;
  }
  Study& study = found->second;
  const bool was_open = study.is_open();
  study.points.grow(event.table);
  study.cancelled = false;
  study.paused = false;
  study.finished = false;
  if (!was_open || study.priority != event.priority) {
    study.priority = event.priority;
    study.served = least_served(event.study);
  }
  requeue(event.study);
}

void Scheduler::on(const StudyRemoved& event) {
  if (!studies_.contains(event.study)) {
    return;
  }
  end_all_leases(event.study);
  withdraw(event.study);
  for (auto& [id, worker] : workers_) {
    worker.paces.erase(event.study);
  }
  std::erase_if(condemned_, [&](const Condemned& point) { return point.study == event.study; });
  processes_.forget_study(event.study);
  queue_.put(event.study, {});
  studies_.erase(event.study);
  wake_all();  // suspect points of it may have kept some from others
}

/// Where a study begins that opens now: level with the one served least, so that it neither waits
/// for nor catches up with what went before.
double Scheduler::least_served(StudyId but) const {
  return queue_.least_served(but).value_or(0.0);
}

StudyQueue::Place Scheduler::place_of(const Study& study) const {
  const bool has_free = study.points.has_free();
  if (!study.is_open() || !(has_free || study.has_suspect())) {
    return {};
  }
  return {has_free, study.has_suspect(), study.priority, study.served, study.solver_version};
}

void Scheduler::requeue(StudyId id) {
  const StudyQueue::Place* known = queue_.find(id);
  const StudyQueue::Place before = known == nullptr ? StudyQueue::Place{} : *known;
  const StudyQueue::Place place = place_of(studies_.at(id));
  queue_.put(id, place);
  // Of free points there may be more now, for whom they are and before what; suspect ones stop some
  // workers.
  if ((place.has_free && (!before.has_free || place.solver_version != before.solver_version ||
                          place.priority > before.priority)) ||
      place.has_suspect != before.has_suspect) {
    wake_all();
  }
}

void Scheduler::finish_if_complete(StudyId id) {
  Study& study = studies_.at(id);
  if (!study.finished && study.points.is_complete()) {
    study.finished = true;
    study.cancelled = false;
    study.paused = false;
    study.points.rest(!study.leases.empty());
    effects_.emplace_back(StudyFinished{id});
  }
}

// ---- Views of the state -----------------------------------------------------------------------

StudyCounts Scheduler::study(StudyId id) const {
  const Study& study = studies_.at(id);
  const bool lacks_worker = study.has_work() && !workers_.empty() &&
                            !study.solver_version.empty() &&
                            !versions_.contains(study.solver_version);
  const PointCounts counts = points(id);
  return {counts.points, counts.solved(), counts.failed,        counts.left_out,
          counts.leased, study.cancelled, study.solver_version, lacks_worker};
}

PointCounts Scheduler::points(StudyId id) const {
  const Study& study = studies_.at(id);
  return {study.points.size(), study.points.settled(), study.failed, study.points.left_out(),
          study.points.leased()};
}

QuietWorkers Scheduler::quiet_workers(StudyId id, std::int64_t now_ms) const {
  std::set<WorkerId> holders;
  std::int64_t last_stored_ms = 0;
  for (const LeaseId lease : studies_.at(id).leases.all()) {
    const WorkerId worker = leases_.at(lease).worker;
    holders.insert(worker);
    last_stored_ms = std::max(last_stored_ms, workers_.at(worker).stored_ms);
  }
  return {holders.size(), std::max<std::int64_t>(0, now_ms - last_stored_ms)};
}

bool Scheduler::sets_all_aside() const {
  return std::ranges::all_of(workers_,
                             [this](const auto& entry) { return is_set_aside(entry.second); });
}

std::array<Crew, kCrewStates> Scheduler::crews(std::int64_t now_ms,
                                               std::int64_t silent_after_ms) const {
  std::array<Crew, kCrewStates> crews{};
  for (const auto& [id, worker] : workers_) {
    CrewState state = CrewState::kIdle;
    if (now_ms - worker.last_heard_ms >= silent_after_ms) {
      state = CrewState::kSilent;
    } else if (is_set_aside(worker)) {
      state = CrewState::kSetAside;
    } else if (!worker.leases.empty() || worker.probe != 0) {
      state = CrewState::kWorking;
    }
    Crew& crew = crews.at(static_cast<std::size_t>(state));
    ++crew.workers;
    crew.threads += worker.threads;
  }
  return crews;
}

std::int64_t Scheduler::silent_ms(WorkerId id, std::int64_t now_ms) const {
  return std::max<std::int64_t>(0, now_ms - workers_.at(id).last_heard_ms);
}

WorkerCounts Scheduler::worker(WorkerId id, std::int64_t now_ms) const {
  const Worker& worker = workers_.at(id);
  WorkerCounts counts{0,
                      worker.solved_points,
                      silent_ms(id, now_ms),
                      processes_.at(worker.process).losses,
                      is_proven(worker),
                      is_set_aside(worker)};
  for (const LeaseId lease_id : worker.leases) {
    const Lease& lease = leases_.at(lease_id);
    const IntervalSet& leased = studies_.at(lease.study).points.leased_set();
    for (const Interval& interval : leased.within(lease.batch.first_place, lease.batch.end())) {
      counts.leased_points += interval.end - interval.begin;
    }
  }
  return counts;
}

}  // namespace oblique::server
