#include "server/scheduler/scheduler.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

namespace oblique::server {
namespace {

/// Maximum time between two ticks that counts as silence of workers. A longer gap means that the
/// server itself did not run, and that messages of workers may still be unread.
constexpr std::int64_t kLongestTick_ms = 1000;

constexpr double kPaceWeight = 0.5;
/// Weight of all earlier messages in the average pace of all workers.
constexpr double kPaceFades = 0.98;
/// Maximum time per point. A message with a longer time does not change the pace.
constexpr double kLongestPoint_s = 86'400.0;

}  // namespace

std::vector<Effect> Scheduler::handle(const Event& event, std::int64_t now_ms) {
  now_ms_ = std::max(now_ms_, now_ms);
  effects_.clear();
  std::visit([this](const auto& e) { pass(e); }, event);
  dispatch();
  if (std::holds_alternative<Tick>(event)) {
    duplicate_stragglers();
  }
  return std::exchange(effects_, {});
}

/// Passes an event to its handler. Ignores the event if the handler needs a study or worker that is
/// unknown.
template <typename Kind>
void Scheduler::pass(const Kind& event) {
  if constexpr (requires(Study & study) { on(study, event); }) {
    if (const auto found = studies_.find(event.study); found != studies_.end()) {
      on(found->second, event);
      requeue(event.study);
    }
  } else if constexpr (requires(Worker & worker) { on(worker, event); }) {
    if (const auto found = workers_.find(event.worker); found != workers_.end()) {
      found->second.last_heard_ms = now_ms_;
      ready_workers_.unpark(event.worker);
      on(found->second, event);
    }
  } else {
    on(event);
  }
}

void Scheduler::on(const DispatchHeld& event) {
  held_ = event.held;
}

// ---- Studies ----------------------------------------------------------------------------------

void Scheduler::on(const StudyAdded& event) {
  if (studies_.contains(event.study)) {
    return;
  }
  studies_.emplace(event.study, Study{StudyPoints(event.table, event.completed, event.left_out),
                                      event.failed, event.cancelled, event.paused, false,
                                      event.priority, 0.0, event.solver_version});
  studies_.at(event.study).held = event.held;
  level(studies_.at(event.study));
  finish_if_complete(event.study);
  requeue(event.study);
}

void Scheduler::on(Study& study, const StudyHeld& event) {
  if (study.held != event.held) {
    study.held = event.held;
    level(study);
  }
}

void Scheduler::on(Study& study, const PointsReused& event) {
  const std::uint64_t completed = study.points.complete_reused(event.points);
  if (completed > 0 && study.solver_version.empty()) {
    study.solver_version = solver_version_;
  }
  for (const LeaseId id : std::set<LeaseId>(study.leases)) {
    release_if_answered(id);
  }
  finish_if_complete(event.study);
}

void Scheduler::on(Study& study, const StudyCancelled& event) {
  if (study.cancelled || study.finished) {
    return;
  }
  study.cancelled = true;
  withdraw(event.study);
  study.points.rest(false);
}

/// Ends all leases of a study and makes workers drop the study. No point counts as lost.
void Scheduler::withdraw(StudyId study) {
  for (const LeaseId lease : std::set<LeaseId>(studies_.at(study).leases)) {
    end_lease(lease);
  }
  for (auto& [id, worker] : workers_) {
    if (worker.defined.erase(study) != 0) {
      effects_.emplace_back(WithdrawStudy{id, study});
    }
  }
}

void Scheduler::on(Study& study, const StudyPaused& /*event*/) {
  if (!study.cancelled && !study.finished) {
    study.paused = true;
  }
}

void Scheduler::on(Study& study, const StudyReopened& /*event*/) {
  if (!is_open(study)) {
    study.cancelled = false;
    study.paused = false;
    level(study);
  }
}

void Scheduler::on(Study& study, const PriorityChanged& event) {
  study.priority = event.priority;
  level(study);
}

void Scheduler::on(Study& study, const FailuresForgotten& event) {
  // Ends old leases of the failed points, which may still run, before the points get a new lease.
  release_leases(study, study.points.order().places(event.points));
  study.failed -= std::min(study.failed, study.points.reopen(event.points));
  if (study.leases.empty() && !study.points.has_results()) {
    study.solver_version.clear();
  }
  if (study.finished && !study.points.is_complete()) {
    study.finished = false;
    level(study);
  }
}

void Scheduler::on(Study& study, const StudyGrown& event) {
  if (event.table.size() <= study.points.size()) {
    return;
  }
  const bool was_open = is_open(study);
  study.points.grow(event.table);
  study.cancelled = false;
  study.paused = false;
  study.finished = false;
  if (!was_open || study.priority != event.priority) {
    study.priority = event.priority;
    level(study);
  }
}

void Scheduler::on(const StudyRemoved& event) {
  const auto study = studies_.find(event.study);
  if (study == studies_.end()) {
    return;
  }
  withdraw(event.study);
  for (auto& [id, worker] : workers_) {
    worker.paces.erase(event.study);
  }
  if (study->second.rank) {
    free_.erase(*study->second.rank);
  }
  suspects_.erase(event.study);
  studies_.erase(study);
  ready_workers_.unpark_all();  // workers may have waited for suspect points of this study
}

/// Sets the study's `served` to the smallest `served` of the studies in `free_` with its priority.
/// So a study that becomes open neither waits for the others nor delays them.
void Scheduler::level(Study& study) const {
  const std::int64_t rank = -std::int64_t{study.priority};
  const auto least = free_.lower_bound({rank, 0.0, 0});
  study.served = least != free_.end() && std::get<0>(*least) == rank ? std::get<1>(*least) : 0.0;
}

/// Returns whether the study has no results, or results of the server's solver version.
bool Scheduler::is_current(const Study& study) const {
  return study.solver_version.empty() || study.solver_version == solver_version_;
}

bool Scheduler::is_open(const Study& study) const {
  return !study.cancelled && !study.paused && !study.finished && !study.held && is_current(study);
}

std::optional<Scheduler::Rank> Scheduler::rank_of(StudyId id, const Study& study) const {
  return is_open(study) && study.points.has_free()
             ? std::optional<Rank>({-std::int64_t{study.priority}, study.served, id})
             : std::nullopt;
}

void Scheduler::requeue(StudyId id) {
  Study& study = studies_.at(id);
  const std::optional<Rank> rank = rank_of(id, study);
  const bool had_free = study.rank.has_value();
  if (rank != study.rank) {
    if (study.rank) {
      free_.erase(*study.rank);
    }
    if (rank) {
      free_.insert(*rank);
    }
    study.rank = rank;
  }
  const bool has_suspect = is_open(study) && study.points.has_suspect();
  const bool changes_suspect = has_suspect ? suspects_.insert(id).second : suspects_.erase(id) > 0;
  if ((rank && !had_free) || changes_suspect) {  // other workers may be served now
    ready_workers_.unpark_all();
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

// ---- Workers ----------------------------------------------------------------------------------

void Scheduler::on(const WorkerJoined& event) {
  if (workers_.contains(event.worker)) {
    return;
  }
  end_connection(event.process, WorkerEnd::kReplaced, "its process has a new connection");
  Worker worker{};
  worker.threads = std::max(event.threads, 1U);
  worker.last_heard_ms = now_ms_;
  worker.process = event.process;
  const LostProcess returned = take_lost(event.process);
  forgive(returned);
  worker.losses = returned.losses;
  if (event.replaced) {
    end_connection(event.replaced->process, WorkerEnd::kLost, "its process has ended");
    const LostProcess ended = take_lost(event.replaced->process);
    blame(ended, *event.replaced);
    worker.losses += ended.losses;
    worker.is_spared = !ended.held.empty() && ended.held.front().alone;
  }
  if (!event.process.empty()) {
    connections_[event.process] = event.worker;
  }
  threads_ += worker.threads;
  workers_.emplace(event.worker, std::move(worker));
  ready_workers_.unpark_all();
}

void Scheduler::on(Worker& worker, const CreditGiven& event) {
  worker.credit += std::min(event.batches, settings_.max_credit - worker.credit);
  if (worker.credit > 0) {
    ready_workers_.add(event.worker);
  }
}

void Scheduler::on(Worker& worker, const HeartbeatReceived& event) {
  // A lease older than `lost_after_ms` that the heartbeat does not name never reached the worker.
  const std::set<LeaseId> held(event.leases.begin(), event.leases.end());
  std::vector<LeaseId> strayed;
  for (const LeaseId id : worker.leases) {
    if (!held.contains(id) && now_ms_ - leases_.at(id).granted_ms > settings_.lost_after_ms) {
      strayed.push_back(id);
    }
  }
  for (const LeaseId id : strayed) {
    end_lease(id);
  }
}

void Scheduler::on(Worker& worker, const BatchesReturned& event) {
  for (const LeaseId lease : event.leases) {
    if (worker.leases.contains(lease)) {
      end_lease(lease);
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
      end_lease(lease);
    }
  }
  remove_worker(event.worker, WorkerEnd::kLost);
  effects_.emplace_back(DropWorker{event.worker, event.reason});
}

void Scheduler::on(const Tick&) {
  const std::int64_t gap_ms = last_tick_ms_ < 0 ? 0 : now_ms_ - last_tick_ms_;
  last_tick_ms_ = now_ms_;
  ready_workers_.unpark_all();  // waiting workers may be served now
  std::vector<WorkerId> lost;
  for (auto& [id, worker] : workers_) {
    if (gap_ms > kLongestTick_ms) {
      worker.last_heard_ms = std::min(now_ms_, worker.last_heard_ms + gap_ms - kLongestTick_ms);
      worker.stored_ms = std::min(now_ms_, worker.stored_ms + gap_ms - kLongestTick_ms);
    }
    if (held_) {  // results may have arrived but wait to be read
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
  note_end(found->second, how);
  for (const LeaseId lease : std::set<LeaseId>(found->second.leases)) {
    end_lease(lease, how == WorkerEnd::kLost);
  }
  ready_workers_.remove(id);
  threads_ -= found->second.threads;
  if (const auto known = connections_.find(found->second.process);
      known != connections_.end() && known->second == id) {
    connections_.erase(known);
  }
  workers_.erase(found);
  ready_workers_.unpark_all();
}

void Scheduler::on(const WorkerBusy& event) {
  const auto found = workers_.find(event.worker);
  if (found != workers_.end()) {
    found->second.is_busy = event.is_busy;
    ready_workers_.unpark(event.worker);
  }
}

// ---- Leases and results ------------------------------------------------------------------------

/// Ends a lease. `is_lost` is true if the worker was lost or ended the batch without answers.
void Scheduler::end_lease(LeaseId id, bool is_lost) {
  Lease lease = leases_.at(id);
  leases_.erase(id);
  Worker& worker = workers_.at(lease.worker);
  worker.leases.erase(id);
  worker.paces.at(lease.study).held_points -= lease.batch.points;
  ready_workers_.unpark(lease.worker);
  Study& study = studies_.at(lease.study);
  study.leases.erase(id);
  const std::vector<Interval> held = open_places(lease);
  is_lost = is_lost && !held.empty();
  LeaseHistory& history = lease.batch.history;
  // If another worker has a lease for the rest of this batch, that lease keeps the points.
  if (const auto twin = leases_.find(lease.twin); twin != leases_.end()) {
    twin->second.twin = 0;
    twin->second.batch.history.losses += is_lost ? 1U : 0U;
  } else {
    ++history.attempts;
    history.losses += is_lost ? 1U : 0U;
    history.lost_alone = is_lost && lease.alone ? history.lost_alone + 1 : 0;
    if (history.lost_alone == 1) {
      history.lost_alone_since_ms = now_ms_;
    }
    study.points.give_back(held, history);
  }
  if (study.leases.empty() && !study.points.has_results()) {
    study.solver_version.clear();
  }
  requeue(lease.study);
  if (history.lost_alone >= settings_.failing_after &&
      now_ms_ - history.lost_alone_since_ms >= settings_.failing_after_ms) {
    fail_point(lease.study, study.points.order().point(lease.batch.first_place), history.attempts,
               std::to_string(history.lost_alone) +
                   " workers in a row were lost while they held only this point");
  }
}

/// Makes workers drop each batch of the study with open points at these places. No point counts as
/// lost.
void Scheduler::release_leases(const Study& study, const IntervalSet& places) {
  for (const LeaseId id : std::set<LeaseId>(study.leases)) {
    const Lease& lease = leases_.at(id);
    if (!places.within(lease.batch.first_place, lease.batch.end()).empty()) {
      effects_.emplace_back(ReleaseBatch{lease.worker, id});
      end_lease(id);
    }
  }
}

std::vector<Interval> Scheduler::open_places(const Lease& lease) const {
  return studies_.at(lease.study)
      .points.leased_set()
      .within(lease.batch.first_place, lease.batch.end());
}

/// If other workers have answered all points of a lease, ends it and makes its worker drop the
/// batch.
void Scheduler::release_if_answered(LeaseId id) {
  const auto lease = leases_.find(id);
  if (lease != leases_.end() && !has_open_points(lease->second)) {
    effects_.emplace_back(ReleaseBatch{lease->second.worker, id});
    end_lease(id);
  }
}

void Scheduler::on(Worker& worker, const ResultsReceived& event) {
  if (reports_foreign_points(event)) {
    remove_worker(event.worker, WorkerEnd::kLost);
    effects_.emplace_back(DropWorker{
        event.worker, "it reports that a filter leaves out points which it did not lease"});
    return;
  }
  StoreResults store{event.worker, event.study, event.sequence, {}};
  const auto study = studies_.find(event.study);
  if (study != studies_.end() && is_current(study->second)) {
    for (std::size_t i = 0; i < event.outcomes.size(); ++i) {
      if (study->second.points.receive(event.outcomes[i].point)) {
        store.accepted.push_back(i);
      }
    }
    if (!store.accepted.empty() && study->second.solver_version.empty()) {
      study->second.solver_version = solver_version_;
    }
    // If the lease has ended, its points were returned, and another worker will report them.
    if (worker.leases.contains(event.lease)) {
      store.left_out = study->second.points.receive(event.left_out);
    }
    if (!store.accepted.empty() || !store.left_out.empty()) {
      worker.stored_ms = now_ms_;
      worker.stalled_until_ms = 0;
    }
    requeue(event.study);
    update_pace(worker, event);
  }
  const bool is_empty = event.outcomes.empty() && store.left_out.empty();
  effects_.emplace_back(std::move(store));
  if (!has_lease(event.worker, event.lease, event.study)) {
    return;
  }
  const auto lease = leases_.find(event.lease);
  const LeaseId twin = lease->second.twin;
  if (event.batch_done) {
    const bool is_solved = !has_open_points(lease->second);
    worker.solved_batches += is_solved ? 1U : 0U;
    worker.losses += is_solved ? 0U : 1U;
    // Points without an answer in a finished batch count as lost. Otherwise a worker that never
    // answers them would get them again and again.
    end_lease(event.lease, !is_solved);
    if (!is_solved && is_empty) {
      stall(worker, settings_.shortest_stall_ms);
    }
  }
  release_if_answered(twin);
}

/// Returns whether the message reports left-out points that are not in the worker's lease.
bool Scheduler::reports_foreign_points(const ResultsReceived& event) const {
  const auto lease = leases_.find(event.lease);
  if (event.left_out.empty() || lease == leases_.end() || lease->second.worker != event.worker) {
    return false;
  }
  const StudyPoints& points = studies_.at(lease->second.study).points;
  const Batch& batch = lease->second.batch;
  // Refuses an impossible message before looking up its points, which may take long.
  if (event.left_out.size() > batch.points || lease->second.study != event.study ||
      !points.may_leave_out(event.left_out)) {
    return true;
  }
  const IntervalSet places = points.order().places(event.left_out);
  return places.front().begin < batch.first_place || places.back().end > batch.end();
}

void Scheduler::update_pace(Worker& worker, const ResultsReceived& event) {
  const auto solved = static_cast<double>(event.outcomes.size());
  const double points = solved + static_cast<double>(event.left_out.size());
  if (points == 0.0 || !std::isfinite(event.busy_s) || event.busy_s <= 0.0 ||
      event.busy_s / points > kLongestPoint_s) {
    return;
  }
  // Averages time and points separately. The first points of a model include its fall, so their
  // time per point is not typical.
  const auto learn = [&event](double& busy_s, double& number, double newest) {
    const double weight = number > 0.0 ? kPaceWeight : 1.0;
    busy_s += weight * (event.busy_s - busy_s);
    number += weight * (newest - number);
  };
  Pace& known = worker.paces[event.study];
  learn(known.busy_s, known.points, points);
  // A message that contains only left-out points does not show how long a point takes.
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
      if (study->second.points.complete(outcome.point)) {
        study->second.failed += outcome.failed ? 1U : 0U;
        if (worker != workers_.end()) {
          worker->second.solved_points += outcome.failed ? 0U : 1U;
        }
      }
    }
    study->second.points.complete(event.left_out);
    finish_if_complete(event.study);
    requeue(event.study);
  }
  if (worker != workers_.end()) {
    effects_.emplace_back(AcknowledgeResults{event.worker, event.sequence});
  }
}

// ---- Views of the state -----------------------------------------------------------------------

StudyCounts Scheduler::study(StudyId id) const {
  const Study& study = studies_.at(id);
  const StudyPoints& points = study.points;
  return {points.size(),        points.completed(),
          study.failed,         points.left_out(),
          points.leased(),      study.cancelled,
          study.solver_version, !is_current(study) && !points.is_complete()};
}

bool Scheduler::are_all_stalled() const {
  return std::ranges::all_of(workers_,
                             [this](const auto& entry) { return is_stalled(entry.second); });
}

WorkerState Scheduler::state_of(const Worker& worker, std::int64_t now_ms) const {
  constexpr std::int64_t kSilentAfter_ms = 1500;
  return now_ms - worker.last_heard_ms > kSilentAfter_ms ? WorkerState::kSilent
         : is_stalled(worker)                            ? WorkerState::kStalled
         : worker.is_busy                                ? WorkerState::kBusy
         : !worker.leases.empty()                        ? WorkerState::kWorking
                                                         : WorkerState::kIdle;
}

WorkerGroups Scheduler::groups(std::int64_t now_ms) const {
  WorkerGroups groups{};
  for (const auto& [id, worker] : workers_) {
    WorkerGroup& group = groups.at(static_cast<std::size_t>(state_of(worker, now_ms)));
    ++group.workers;
    group.threads += worker.threads;
  }
  return groups;
}

std::int64_t Scheduler::silent_ms(WorkerId id, std::int64_t now_ms) const {
  return std::max<std::int64_t>(0, now_ms - workers_.at(id).last_heard_ms);
}

WorkerCounts Scheduler::worker(WorkerId id, std::int64_t now_ms) const {
  const Worker& worker = workers_.at(id);
  WorkerCounts counts{0, worker.solved_points, silent_ms(id, now_ms), worker.losses,
                      state_of(worker, now_ms)};
  for (const LeaseId lease : worker.leases) {
    counts.leased_points += size_of(open_places(leases_.at(lease)));
  }
  return counts;
}

}  // namespace oblique::server
