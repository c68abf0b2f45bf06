// Dispatch: chooses the next batch of each worker.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "server/scheduler/scheduler.h"

namespace oblique::server {

void Scheduler::dispatch() {
  while (!held_ && !ready_workers_.active().empty() && !(free_.empty() && suspects_.empty())) {
    const WorkerId id = ready_workers_.active().begin()->second;
    ++examined_workers_;
    if (!serve(id, workers_.at(id))) {
      ready_workers_.park(id);
    }
  }
}

/// Uses one credit of the worker for a batch, and moves the worker to the end of the queue.
void Scheduler::use_credit(WorkerId id, Worker& worker) {
  worker.credit -= std::min(worker.credit, 1U);
  ready_workers_.remove(id);
  if (worker.credit > 0) {
    ready_workers_.add(id);
  }
}

/// Returns whether the worker reads messages, solves batches, and holds no suspect point.
bool Scheduler::may_hold_more(const Worker& worker) const {
  const bool holds_suspect = !worker.leases.empty() && leases_.at(*worker.leases.begin()).alone;
  return !worker.is_busy && !holds_suspect && !is_stalled(worker) &&
         worker.leases.size() < settings_.newcomer_batches + worker.solved_batches;
}

bool Scheduler::serve(WorkerId id, Worker& worker) {
  if (!may_hold_more(worker)) {
    return false;
  }
  if (!suspects_.empty() && (free_.empty() || !worker.is_spared)) {
    // A suspect point waits for a worker that holds nothing, so no worker gets a further batch.
    if (!worker.leases.empty()) {
      return false;
    }
    const StudyId study = *suspects_.begin();
    grant(id, worker, study, studies_.at(study).points.take_suspect(), true);
    return true;
  }
  const StudyId study = std::get<StudyId>(*free_.begin());
  const BatchSize wanted = batch_size_for(worker, study);
  grant(id, worker, study, *studies_.at(study).points.take(wanted), false);
  worker.is_spared = false;
  // Stores the wanted size. A batch that is smaller because the run of points ends early says
  // nothing about the worker's capacity.
  auto& fit_for = worker.paces.at(study).last_batch_points;
  fit_for = std::max(fit_for, wanted.points);
  return true;
}

/// If no other points can be leased, leases the rest of slow batches to idle workers too. The first
/// answer counts.
void Scheduler::duplicate_stragglers() {
  const auto is_old = [this](const Lease& lease) {
    return now_ms_ - lease.granted_ms >= settings_.straggler_after_ms;
  };
  if (held_ || !free_.empty() || !suspects_.empty() || leases_.empty() ||
      !is_old(leases_.begin()->second)) {
    return;
  }
  std::vector<WorkerId> helpers;
  for (const auto* workers : {&ready_workers_.active(), &ready_workers_.parked()}) {
    for (const auto& [place, id] : *workers) {
      if (may_hold_more(workers_.at(id))) {
        helpers.push_back(id);
      }
    }
  }
  FastestPaces paces;
  // Lease numbers ascend, so the oldest lease comes first.
  for (auto entry = leases_.begin(); entry != leases_.end() && is_old(entry->second); ++entry) {
    Lease& lease = entry->second;
    const auto helper = std::find_if(helpers.begin(), helpers.end(),
                                     [&](WorkerId id) { return id != lease.worker; });
    if (helper == helpers.end() || !is_straggling(lease, paces)) {
      continue;
    }
    const std::vector<Interval> left = open_places(lease);
    Batch rest{left.front().begin, left.back().end - left.front().begin, lease.batch.history,
               size_of(left)};
    ++rest.history.attempts;
    lease.twin = grant(*helper, workers_.at(*helper), lease.study, rest, false);
    leases_.at(lease.twin).twin = entry->first;
    helpers.erase(helper);
  }
}

bool Scheduler::is_straggling(const Lease& lease, FastestPaces& paces) const {
  if (lease.twin != 0 || lease.alone || lease.batch.history.losses > 0 ||
      !is_open(studies_.at(lease.study)) || !has_open_points(lease)) {
    return false;
  }
  const Worker& holder = workers_.at(lease.worker);
  if (leases_.at(*holder.leases.begin()).granted_ms < lease.granted_ms) {
    return true;  // an older batch delays this one
  }
  const double expected_ms = 1e3 * fastest_pace(lease.study, paces) *
                             static_cast<double>(lease.batch.points) / holder.threads;
  return static_cast<double>(now_ms_ - lease.granted_ms) > settings_.straggler_factor * expected_ms;
}

BatchSize Scheduler::batch_size_for(const Worker& worker, StudyId id) const {
  const auto known = worker.paces.find(id);
  const Pace pace = known == worker.paces.end() ? Pace{} : known->second;
  std::uint64_t points = settings_.first_batch_points * worker.threads;
  std::uint64_t fewest = 1;
  if (pace.s_per_point() > 0.0) {
    const double by_pace = settings_.batch_target_s * worker.threads / pace.s_per_point();
    const auto largest = static_cast<double>(
        std::min(settings_.largest_batch_points * worker.threads,
                 settings_.growth * std::max<std::uint64_t>(pace.last_batch_points, 1)));
    points = static_cast<std::uint64_t>(std::min(by_pace, largest));
    fewest = static_cast<std::uint64_t>(
        std::min(by_pace * settings_.shortest_batch_s / settings_.batch_target_s, largest));
  }
  if (studies_.at(id).points.has_filter()) {
    // All points of the next batch may pass the filter, even if most of the last batch did not.
    const double in_time =
        pace.s_per_solved() > 0.0
            ? settings_.lanes_batch_s * worker.threads / pace.s_per_solved()
            : static_cast<double>(settings_.unsolved_batch_points) * worker.threads;
    points = static_cast<std::uint64_t>(std::min(in_time, static_cast<double>(points)));
  }
  const std::uint64_t shares = settings_.tail_batches_per_thread * threads_;
  const std::uint64_t fair =
      studies_.at(id).points.free() / std::max<std::uint64_t>(shares, 1) * worker.threads;
  BatchSize wanted{std::max<std::uint64_t>(std::min(points, std::max(fair, fewest)), 1)};
  if (pace.last_end != 0) {
    wanted.follows = pace.last_end;
  }
  wanted.falls = studies_.at(id).leases.empty() ? settings_.lanes * worker.threads : 0;
  fill_lanes(wanted, studies_.at(id).points, worker.threads, pace);
  return wanted;
}

/// Adds points or models to a batch if SIMD lanes would be empty and the batch takes hardly longer.
void Scheduler::fill_lanes(BatchSize& wanted, const StudyPoints& points, std::uint32_t threads,
                           const Pace& pace) const {
  const auto lanes = static_cast<double>(settings_.lanes);
  const bool has_models = points.has_models();
  if (!has_models && pace.s_per_point() * lanes <= settings_.batch_target_s) {
    return;  // the batch fills the lanes anyway, because its points are quick
  }
  // A worker gets at most its share of all open points, counting those it already holds, so that
  // all workers have points until the end of a study.
  const std::uint64_t open = points.free() + points.leased();
  const std::uint64_t all_threads = std::max<std::uint64_t>(threads_, 1);
  const std::uint64_t part = (open * threads + all_threads - 1) / all_threads;
  const std::uint64_t share = part - std::min(part, pace.held_points);
  const double s_per_point = pace.s_per_point();
  const double a_thread =
      s_per_point > 0.0 ? std::clamp(settings_.lanes_batch_s / s_per_point, 1.0, lanes) : lanes;
  wanted.points =
      std::max(wanted.points, std::min(static_cast<std::uint64_t>(a_thread) * threads, share));
  if (has_models && s_per_point > 0.0) {
    const double in_time =
        std::max(settings_.models_batch_s, settings_.batch_target_s) * threads / s_per_point;
    const std::uint64_t grown =
        settings_.growth *
        std::min(pace.last_batch_points, settings_.largest_batch_points * threads);
    const std::uint64_t most = std::min(grown, share);
    wanted.most_points =
        in_time < static_cast<double>(most) ? static_cast<std::uint64_t>(in_time) : most;
  }
  wanted.groups = has_models && !points.order().is_arranged() ? settings_.lanes * threads : 1;
}

LeaseId Scheduler::grant(WorkerId id, Worker& worker, StudyId study, const Batch& batch,
                         bool alone) {
  const std::uint64_t numbers = studies_.at(study).points.size();
  if (std::exchange(worker.defined[study], numbers) != numbers) {
    effects_.emplace_back(DefineStudy{id, study});
  }
  Study& served = studies_.at(study);
  Pace& pace = worker.paces[study];
  const double takes_s = pace.s_per_point() * static_cast<double>(batch.points) / worker.threads;
  // Limits the duration that counts for the study, because a worker may report a wrong pace.
  const double counted_s = std::clamp(takes_s, settings_.batch_target_s,
                                      settings_.lanes_batch_s + settings_.batch_target_s);
  served.served += counted_s / settings_.batch_target_s;
  if (served.solver_version.empty()) {
    served.solver_version = solver_version_;
  }
  worker.stored_ms = worker.leases.empty() ? now_ms_ : worker.stored_ms;
  const LeaseId lease = next_lease_++;
  leases_.emplace(lease, Lease{id, study, batch, alone, now_ms_});
  served.leases.insert(lease);
  worker.leases.insert(lease);
  use_credit(id, worker);
  pace.last_batch_points = batch.points;
  pace.last_end = batch.end();
  pace.held_points += batch.points;
  requeue(study);
  SendBatch send{id, study, {}, batch.history.attempts + 1, lease};
  for (const Interval& places : open_places(leases_.at(lease))) {
    const auto points = served.points.order().points(places);
    send.points.insert(send.points.end(), points.begin(), points.end());
  }
  effects_.emplace_back(std::move(send));
  return lease;
}

}  // namespace oblique::server
