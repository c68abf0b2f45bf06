#include "server/scheduler/scheduler.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

namespace oblique::server {
namespace {

/// Longest gap between two ticks that counts as silence of the workers. In a longer one it was the
/// server that did not run, and what the workers said meanwhile still waits to be read.
constexpr std::int64_t kLongestTick_ms = 1000;

}  // namespace

std::vector<Effect> Scheduler::handle(const Event& event, std::int64_t now_ms) {
  now_ms_ = std::max(now_ms_, now_ms);
  effects_.clear();
  seeks_stragglers_ = std::holds_alternative<Tick>(event);
  std::visit([this](const auto& e) { on(e); }, event);
  dispatch();
  return std::exchange(effects_, {});
}

// ---- Studies ----------------------------------------------------------------------------------

void Scheduler::on(const StudyAdded& event) {
  if (studies_.contains(event.study)) {
    return;
  }
  studies_.emplace(event.study,
                   Study{StudyPoints(event.table, event.settled, settings_.loss_limits),
                         event.failed, event.cancelled, event.paused, false, event.terms,
                         least_served(event.study), event.solver_version});
  studies_.at(event.study).points.count_attempts(event.attempts);
  finish_if_complete(event.study);
  requeue(event.study);
}

void Scheduler::on(const StudyCancelled& event) {
  const auto found = studies_.find(event.study);
  if (found == studies_.end() || found->second.cancelled || found->second.finished) {
    return;
  }
  found->second.cancelled = true;
  found->second.overlaps = false;  // all leases end: whose point it was does not matter
  for (const LeaseId id : found->second.leases.all()) {
    end_lease(id, std::nullopt);
  }
  found->second.points.rest();
  requeue(event.study);
  for (auto& [id, worker] : workers_) {
    if (worker.defined.erase(event.study) != 0) {
      effects_.emplace_back(WithdrawStudy{id, event.study});
    }
  }
}

void Scheduler::on(const StudyPaused& event) {
  const auto found = studies_.find(event.study);
  if (found != studies_.end() && found->second.is_open()) {
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

void Scheduler::on(const StudyTermsChanged& event) {
  const auto found = studies_.find(event.study);
  if (found == studies_.end()) {
    return;
  }
  Study& study = found->second;
  study.terms = event.terms;
  study.served = least_served(event.study);
  for (const LeaseId id : study.leases.all()) {
    const WorkerId worker = leases_.at(id).worker;
    if (!admits(study, workers_.at(worker))) {  // it takes part no more
      effects_.emplace_back(ReleaseBatch{worker, id});
      end_lease(id, std::nullopt);
    }
  }
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

/// Where a study begins that opens now: level with the one served least, so that it neither waits
/// for nor catches up with what went before.
double Scheduler::least_served(StudyId but) const {
  return queue_.least_served(but).value_or(0.0);
}

StudyQueue::Place Scheduler::place_of(const Study& study) const {
  if (!study.has_work()) {
    return {};
  }
  return {study.points.has_free(), study.has_suspect(), study.terms.priority, study.served,
          study.terms.mixes_versions ? std::string() : study.solver_version};
}

void Scheduler::requeue(StudyId id) {
  queue_.put(id, place_of(studies_.at(id)));
}

void Scheduler::finish_if_complete(StudyId id) {
  Study& study = studies_.at(id);
  if (!study.finished && study.points.is_complete()) {
    study.finished = true;
    study.cancelled = false;
    study.paused = false;
    study.points.rest();
    effects_.emplace_back(StudyFinished{id});
  }
}

// ---- Workers ----------------------------------------------------------------------------------

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
}

Scheduler::Worker* Scheduler::heard_from(WorkerId worker) {
  const auto found = workers_.find(worker);
  if (found == workers_.end()) {
    return nullptr;
  }
  found->second.last_heard_ms = now_ms_;
  return &found->second;
}

void Scheduler::on(const CreditGiven& event) {
  if (Worker* worker = heard_from(event.worker)) {
    const std::uint32_t room = settings_.max_credit - worker->credit;
    worker->credit += std::min(event.batches, room);
    queue(event.worker, *worker);
  }
}

void Scheduler::queue(WorkerId id, Worker& worker) {
  if (!worker.queued && worker.credit > 0) {
    worker.queued = true;
    ready_workers_.push_back(id);
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
  fail_condemned();
  std::vector<WorkerId> lost;
  for (auto& [id, worker] : workers_) {
    if (gap_ms > kLongestTick_ms) {
      worker.last_heard_ms = std::min(now_ms_, worker.last_heard_ms + gap_ms - kLongestTick_ms);
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
  if (found->second.queued) {
    std::erase(ready_workers_, id);
  }
  threads_ -= found->second.threads;
  workers_.erase(found);
  processes_.leave(process, id);
}

void Scheduler::on(const WorkerBusy& event) {
  const auto found = workers_.find(event.worker);
  if (found != workers_.end()) {
    found->second.is_busy = event.is_busy;
    found->second.draining = found->second.draining && !event.is_busy;
  }
}

void Scheduler::on(const DispatchHeld& event) {
  held_ = event.held;
}

// ---- Views of the state -----------------------------------------------------------------------

StudyCounts Scheduler::study(StudyId id) const {
  const Study& study = studies_.at(id);
  const bool lacks_worker = study.has_work() && !workers_.empty() &&
                            std::none_of(workers_.begin(), workers_.end(), [&](const auto& entry) {
                              return admits(study, entry.second);
                            });
  return {study.points.size(), study.points.settled() - study.failed,
          study.failed,        study.points.leased(),
          study.cancelled,     study.solver_version,
          lacks_worker};
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
    for (const Interval& interval : leased.within(lease.batch.first_point, lease.batch.end())) {
      counts.leased_points += interval.end - interval.begin;
    }
  }
  return counts;
}

void Scheduler::check_invariants() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) {
      throw std::logic_error(what);
    }
  };
  std::map<StudyId, IntervalSet> under_lease;
  std::map<StudyId, std::size_t> leases_of;
  for (const auto& [id, lease] : leases_) {
    const auto worker = workers_.find(lease.worker);
    require(worker != workers_.end() && worker->second.leases.contains(id),
            "a lease has no worker");
    require(studies_.contains(lease.study), "a lease has no study");
    require(!lease.alone || worker->second.leases.size() == 1, "a suspect lease is not alone");
    require(lease.batch.count > 0 && id < next_lease_, "a lease is malformed");
    IntervalSet& covered = under_lease[lease.study];
    require(studies_.at(lease.study).overlaps ||
                covered.within(lease.batch.first_point, lease.batch.end()).empty(),
            "two leases hold one point");
    require(lease.twin == 0 || (leases_.contains(lease.twin) && leases_.at(lease.twin).twin == id &&
                                leases_.at(lease.twin).worker != lease.worker),
            "a batch's second lease is not one");
    require(admits(studies_.at(lease.study), worker->second),
            "a worker of another solver version holds a lease");
    ++leases_of[lease.study];
    covered.insert(lease.batch.first_point, lease.batch.end());
  }
  for (const auto& [id, study] : studies_) {
    study.points.check_invariants();
    require(study.finished == study.points.is_complete(), "a study is finished and is not");
    require(study.failed <= study.points.settled(), "more points failed than were settled");
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
  for (const auto& [id, worker] : workers_) {
    threads += worker.threads;
    leases += worker.leases.size();
    require(worker.queued == (std::count(ready_workers_.begin(), ready_workers_.end(), id) == 1),
            "a worker stands in the queue twice or not as noted");
    require(worker.queued == (worker.credit > 0), "a worker with credit is not in the queue");
  }
  check_losses();
  require(threads == threads_, "the number of threads is wrong");
  require(leases == leases_.size(), "a worker holds a lease that does not exist");
}

}  // namespace oblique::server
