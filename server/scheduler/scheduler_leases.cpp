// The part of the scheduler that takes results and gives points back.
#include <algorithm>
#include <cmath>
#include <utility>

#include "server/scheduler/scheduler.h"

namespace oblique::server {
namespace {

/// Weight of the newest message in a worker's pace.
constexpr double kPaceWeight = 0.5;

/// What a message weighs in the pace of all workers when the next has come.
constexpr double kPaceFades = 0.98;
/// No point takes longer, and who says so does not count.
constexpr double kLongestPoint_s = 86'400.0;

}  // namespace

void Scheduler::end_lease(LeaseId id, const std::optional<Loss>& loss) {
  const Lease lease = leases_.at(id);
  leases_.erase(id);
  Worker& worker = workers_.at(lease.worker);
  worker.leases.erase(id);
  worker.paces.at(lease.study).held_points -= lease.batch.points;
  ready_workers_.wake(lease.worker);
  if (const auto twin = leases_.find(lease.twin); twin != leases_.end()) {
    twin->second.twin = 0;
  }
  Study& study = studies_.at(lease.study);
  study.leases.erase(id, lease.batch);
  const std::vector<Interval> held = held_by(lease);
  if (loss) {
    note_loss(lease, held, *loss);
  } else if (!held.empty()) {
    study.points.give_back(held, lease.batch.attempts + 1, lease.batch.losses, now_ms_);
  }
  if (study.leases.empty()) {
    study.overlaps = false;
    if (!study.points.has_results()) {
      study.solver_version.clear();
    }
  }
  requeue(lease.study);
}

/// Points that are leased by this lease, which has ended, and by no other.
std::vector<Interval> Scheduler::held_by(const Lease& lease) const {
  const Study& study = studies_.at(lease.study);
  const auto leased = study.points.leased_set().within(lease.batch.first_place, lease.batch.end());
  if (!study.overlaps || leased.empty()) {
    return leased;
  }
  IntervalSet held;
  for (const Interval& interval : leased) {
    held.insert(interval.begin, interval.end);
  }
  for (const LeaseId id : study.leases.near(lease.batch)) {
    const Batch& other = leases_.at(id).batch;
    held.erase(other.first_place, other.end());
  }
  return held.within(lease.batch.first_place, lease.batch.end());
}

bool Scheduler::has_open_points(const Lease& lease) const {
  const IntervalSet& leased = studies_.at(lease.study).points.leased_set();
  return !leased.within(lease.batch.first_place, lease.batch.end()).empty();
}

/// A batch whose points were all answered by others is nobody's work any more.
void Scheduler::release_if_answered(LeaseId id) {
  const auto lease = leases_.find(id);
  if (lease != leases_.end() && !has_open_points(lease->second)) {
    effects_.emplace_back(ReleaseBatch{lease->second.worker, id});
    end_lease(id, std::nullopt);
  }
}

void Scheduler::on(const ResultsReceived& event) {
  Worker* worker = heard_from(event.worker);
  if (worker == nullptr) {
    return;
  }
  if (names_other_points(event)) {
    remove_worker(event.worker, WorkerEnd::kLost);
    effects_.emplace_back(
        DropWorker{event.worker, "it says that a filter leaves out points which it was not given"});
    return;
  }
  StoreResults store{event.worker, event.study, event.sequence, {}};
  const auto study = studies_.find(event.study);
  // What a worker of another solver version solved before the study was given to this one's is
  // not wanted, though acknowledged: those points are solved again.
  if (study != studies_.end() && admits(study->second, *worker)) {
    for (std::size_t i = 0; i < event.outcomes.size(); ++i) {
      if (study->second.points.receive(event.outcomes[i].point)) {
        store.accepted.push_back(i);
      }
    }
    if (!store.accepted.empty() && study->second.solver_version.empty()) {
      study->second.solver_version = worker->solver_version;
    }
    // Of a lease that has ended since others name them again.
    if (worker->leases.contains(event.lease)) {
      store.left_out = study->second.points.receive(event.left_out);
    }
    if (!store.accepted.empty() || !store.left_out.empty()) {
      worker->stored_ms = now_ms_;
    }
    requeue(event.study);
    learn_pace(*worker, event);
  }
  note_answers(*worker, event, !store.accepted.empty());
  effects_.emplace_back(std::move(store));
  const auto lease = leases_.find(event.lease);
  if (lease == leases_.end() || lease->second.worker != event.worker ||
      lease->second.study != event.study) {
    return;
  }
  const LeaseId twin = lease->second.twin;
  if (event.batch_done) {
    const bool is_solved = is_proven(*worker) && !has_open_points(lease->second);
    worker->solved_batches += is_solved ? 1U : 0U;
    batch_s_.observe(1e-3 * static_cast<double>(now_ms_ - lease->second.granted_ms));
    // Points of a finished batch that got no answer count as lost, or a worker that never answers
    // them would take them for ever.
    end_lease(event.lease, Loss{kNobody, is_proven(*worker) && worker->leases.size() == 1});
  }
  release_if_answered(twin);
}

/// A lease of the worker does not have all the points that the message says a filter leaves out.
bool Scheduler::names_other_points(const ResultsReceived& event) const {
  const auto lease = leases_.find(event.lease);
  if (event.left_out.empty() || lease == leases_.end() || lease->second.worker != event.worker) {
    return false;
  }
  const StudyPoints& points = studies_.at(lease->second.study).points;
  const Batch& batch = lease->second.batch;
  // So many are not even looked up: that could take long.
  if (event.left_out.size() > batch.points || lease->second.study != event.study ||
      !points.may_leave_out(event.left_out)) {
    return true;
  }
  const IntervalSet places = points.order().places(event.left_out);
  return places.front().begin < batch.first_place || places.back().end > batch.end();
}

void Scheduler::learn_pace(Worker& worker, const ResultsReceived& event) {
  const auto solved = static_cast<double>(event.outcomes.size());
  const double points = solved + static_cast<double>(event.left_out.size());
  if (points == 0.0 || !std::isfinite(event.busy_s) || event.busy_s <= 0.0 ||
      event.busy_s / points > kLongestPoint_s) {
    return;
  }
  // Time and points by themselves: the first points of a model come with its fall, which says
  // little of those that follow.
  const auto learn = [&event](double& busy_s, double& number, double newest) {
    const double weight = number > 0.0 ? kPaceWeight : 1.0;
    busy_s += weight * (event.busy_s - busy_s);
    number += weight * (newest - number);
  };
  Pace& known = worker.paces[event.study];
  learn(known.busy_s, known.points, points);
  // A message that only names left-out points says nothing of the time that a solved one takes.
  if (solved > 0.0) {
    learn(known.solved_busy_s, known.solved, solved);
    pace_s_ = kPaceFades * pace_s_ + event.busy_s;
    pace_points_ = kPaceFades * pace_points_ + solved;
  }
}

void Scheduler::on(const ResultsStored& event) {
  const auto study = studies_.find(event.study);
  const auto worker = workers_.find(event.worker);
  if (study != studies_.end()) {
    for (const PointOutcome& outcome : event.outcomes) {
      if (study->second.points.settle(outcome.point)) {
        study->second.failed += outcome.failed ? 1U : 0U;
        if (worker != workers_.end()) {
          worker->second.solved_points += outcome.failed ? 0U : 1U;
        }
      }
    }
    study->second.points.settle(event.left_out);
    finish_if_complete(event.study);
    requeue(event.study);
  }
  if (worker != workers_.end()) {
    effects_.emplace_back(AcknowledgeResults{event.worker, event.sequence});
  }
}

}  // namespace oblique::server
