// What must hold of the scheduler's state between two events.
#include <map>
#include <stdexcept>
#include <string>

#include "server/scheduler/scheduler.h"

namespace oblique::server {
namespace {

void require(bool holds, const char* what) {
  if (!holds) {
    throw std::logic_error(what);
  }
}

}  // namespace

void Scheduler::check_invariants() const {
  std::map<StudyId, IntervalSet> under_lease;
  std::map<StudyId, std::size_t> leases_of;
  for (const auto& [id, lease] : leases_) {
    const auto worker = workers_.find(lease.worker);
    require(worker != workers_.end() && worker->second.leases.contains(id),
            "a lease has no worker");
    require(studies_.contains(lease.study), "a lease has no study");
    require(!lease.alone || worker->second.leases.size() == 1, "a suspect lease is not alone");
    require(lease.batch.points > 0 && lease.batch.points <= lease.batch.count && id < next_lease_,
            "a lease is malformed");
    // Between the points of a batch, and of one that is answered, there may be settled ones.
    IntervalSet& covered = under_lease[lease.study];
    for (const Interval& held : studies_.at(lease.study)
                                    .points.leased_set()
                                    .within(lease.batch.first_place, lease.batch.end())) {
      require(studies_.at(lease.study).overlaps || covered.within(held.begin, held.end).empty(),
              "two leases hold one point");
      covered.insert(held.begin, held.end);
    }
    require(lease.twin == 0 || (leases_.contains(lease.twin) && leases_.at(lease.twin).twin == id &&
                                leases_.at(lease.twin).worker != lease.worker),
            "a batch's second lease is not one");
    require(admits(studies_.at(lease.study), worker->second),
            "a worker of another solver version holds a lease");
    ++leases_of[lease.study];
  }
  for (const auto& [id, study] : studies_) {
    study.points.check_invariants();
    require(study.finished == study.points.is_complete(), "a study is finished and is not");
    require(study.failed + study.points.left_out() <= study.points.settled(),
            "more points failed or are left out than were settled");
    require(!study.cancelled || study.points.leased() == 0, "a cancelled study holds leases");
    require(study.leases.size() == leases_of[id], "a study's leases are miscounted");
    const StudyQueue::Place* place = queue_.find(id);
    require(place_of(study) == (place == nullptr ? StudyQueue::Place{} : *place),
            "a study is not where it belongs in the queue");
    study.points.leased_set().for_each([&, study_id = id](const Interval& interval) {
      const auto covered = under_lease[study_id].within(interval.begin, interval.end);
      require(covered.size() == 1 && covered.front() == interval, "a leased point has no lease");
    });
  }
  std::uint64_t threads = 0;
  std::size_t leases = 0;
  std::size_t draining = 0;
  std::map<std::string, std::size_t> versions;
  for (const auto& [id, worker] : workers_) {
    std::map<StudyId, std::uint64_t> held;
    for (const LeaseId lease : worker.leases) {
      held[leases_.at(lease).study] += leases_.at(lease).batch.points;
    }
    for (const auto& [study, pace] : worker.paces) {
      require(pace.held_points == held[study], "points that a worker holds are miscounted");
    }
    threads += worker.threads;
    leases += worker.leases.size();
    draining += worker.draining ? 1U : 0U;
    ++versions[worker.solver_version];
  }
  check_losses();
  check_lines();
  require(draining == draining_ && versions == versions_, "workers are miscounted");
  require(threads == threads_, "the number of threads is wrong");
  require(leases == leases_.size(), "a worker holds a lease that does not exist");
}

void Scheduler::check_lines() const {
  for (const auto& [id, worker] : workers_) {
    require(ready_workers_.contains(id) == (worker.credit > 0),
            "a worker with credit is not in the line, or one without is");
  }
  require(ready_workers_.size() <= workers_.size(), "a worker that is gone stands in the line");
}

void Scheduler::check_losses() const {
  processes_.check_invariants();
  for (const auto& [id, worker] : workers_) {
    const WorkerProcess& process = processes_.at(worker.process);
    require(process.workers.contains(id), "a worker is not known as one of its process");
    require(worker.probe == 0 || worker.leases.empty(), "a probe is not alone");
    require(worker.leases.size() <= settings_.newcomer_batches + worker.solved_batches,
            "a worker has more batches than it has earned");
    require(worker.solved_batches == 0 || process.proven_since_ms,
            "a worker that is not proven has solved batches");
  }
  require(processes_.workers() == workers_.size(), "a process has workers that are not there");
  for (const auto& [id, lease] : leases_) {
    require(!lease.alone || is_proven(workers_.at(lease.worker)),
            "suspect points are with a newcomer");
  }
  require(vanished_ms_.size() <= settings_.vanished_newcomers, "too many newcomers are noted");
  std::map<StudyId, IntervalSet> to_fail;
  for (const Condemned& condemned : condemned_) {
    to_fail[condemned.study].insert(condemned.point);
  }
  for (const auto& [id, study] : studies_) {
    for (const std::uint64_t point : study.points.condemned()) {
      require(to_fail[id].contains(point), "a condemned point is forgotten");
    }
  }
}

}  // namespace oblique::server
