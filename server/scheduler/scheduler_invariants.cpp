// Checks the invariants of the scheduler's state between two events.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <stdexcept>

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
  check_leases();
  check_workers();
  std::size_t with_free = 0;
  for (const auto& [id, study] : studies_) {
    study.points.check_invariants();
    require(study.finished == study.points.is_complete(),
            "the flag `finished` of a study is wrong");
    require(study.failed + study.points.left_out() <= study.points.completed(),
            "more points failed or are left out than were completed");
    require(!study.cancelled || study.points.leased() == 0, "a cancelled study holds leases");
    require(study.rank == rank_of(id, study) && (!study.rank || free_.contains(*study.rank)) &&
                suspects_.contains(id) == (is_open(study) && study.points.has_suspect()),
            "the place of a study in the queue is wrong");
    with_free += study.rank ? 1U : 0U;
  }
  require(with_free == free_.size(), "the queue contains a removed study");
  std::uint64_t threads = 0;
  std::size_t leases = 0;
  for (const auto& [id, worker] : workers_) {
    std::map<StudyId, std::uint64_t> held;
    for (const LeaseId lease : worker.leases) {
      held[leases_.at(lease).study] += leases_.at(lease).batch.points;
    }
    for (const auto& [study, pace] : worker.paces) {
      require(pace.held_points == held[study], "the number of points that a worker holds is wrong");
    }
    require(ready_workers_.contains(id) == (worker.credit > 0),
            "the queue does not contain exactly the workers with credit");
    threads += worker.threads;
    leases += worker.leases.size();
  }
  require(ready_workers_.size() <= workers_.size(), "the queue contains a removed worker");
  require(threads == threads_, "the number of threads is wrong");
  require(leases == leases_.size(), "a worker holds a lease that does not exist");
}

void Scheduler::check_leases() const {
  std::map<StudyId, IntervalSet> under_lease;
  std::map<StudyId, std::set<LeaseId>> leases_of;
  for (const auto& [id, lease] : leases_) {
    const auto worker = workers_.find(lease.worker);
    require(worker != workers_.end() && worker->second.leases.contains(id),
            "a lease has no worker");
    require(studies_.contains(lease.study), "a lease has no study");
    require(!lease.alone || (worker->second.leases.size() == 1 && lease.batch.count == 1),
            "a suspect point is not the only one that its worker holds");
    require(lease.batch.points > 0 && lease.batch.points <= lease.batch.count && id < next_lease_,
            "a lease is malformed");
    // Completed points in a batch are ignored, because another lease may have answered them.
    IntervalSet& covered = under_lease[lease.study];
    for (const Interval& held : open_places(lease)) {
      require(lease.twin != 0 || covered.within(held.begin, held.end).empty(),
              "two leases hold one point");
      covered.insert(held.begin, held.end);
    }
    require(lease.twin == 0 || (leases_.contains(lease.twin) && leases_.at(lease.twin).twin == id &&
                                leases_.at(lease.twin).worker != lease.worker),
            "the twin of a lease does not refer back to it");
    require(is_current(studies_.at(lease.study)), "a study of another solver version is leased");
    leases_of[lease.study].insert(id);
  }
  for (const auto& [id, study] : studies_) {
    require(study.leases == leases_of[id], "the leases of a study are wrong");
    require(study.points.leased_set() == under_lease[id], "a leased point has no lease");
  }
}

void Scheduler::check_workers() const {
  for (const auto& [id, worker] : workers_) {
    require(worker.process.empty() || connections_.at(worker.process) == id,
            "a process has two connections");
    require(worker.leases.size() <= settings_.newcomer_batches + worker.solved_batches,
            "a worker holds more batches than its solved ones allow");
  }
  require(connections_.size() <= workers_.size(), "a removed worker is connected");
  require(lost_.size() <= settings_.most_lost_processes, "too many lost processes are kept");
}

}  // namespace oblique::server
