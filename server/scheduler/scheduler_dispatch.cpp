// The part of the scheduler that decides who gets what next.
#include <algorithm>
#include <utility>

#include "server/scheduler/scheduler.h"

namespace oblique::server {

void Scheduler::dispatch() {
  if (held_) {
    return;
  }
  const auto has_work = [this] { return seeks_stragglers_ || !queue_.empty(); };
  if (seeks_stragglers_) {
    // Each tick another worker comes first, in case this one may not help any straggler.
    ready_workers_.rotate();
  }
  while (ready_workers_.has_active() && has_work()) {
    const WorkerId id = ready_workers_.first_active();
    Worker& worker = workers_.at(id);
    ++examined_workers_;
    if (!serve(id, worker)) {
      ready_workers_.park(id);
      continue;
    }
    ready_workers_.remove(id);
    if (worker.credit > 0) {
      ready_workers_.add(id);
    }
  }
}

bool Scheduler::serve(WorkerId id, Worker& worker) {
  if (worker.is_busy) {
    return false;
  }
  const bool holds_suspect = !worker.leases.empty() && leases_.at(*worker.leases.begin()).alone;
  if (holds_suspect || worker.probe != 0) {
    return false;
  }
  if (is_set_aside(worker)) {
    return probe(id, worker);
  }
  const StudyId suspect_study = next_suspect_study(worker);
  if (suspect_study == 0) {
    set_draining(worker, false);
  } else if (!is_proven(worker)) {
    // It may have nothing else by which to show that it is fit for them.
    if (worker.leases.empty() && queue_.next_free() == 0) {
      return probe(id, worker);
    }
  } else if (worker.leases.empty()) {
    return serve_suspect(id, worker);
  } else if (worker.draining || draining_ == 0) {
    // Suspect points wait for one worker to empty, the others go on.
    set_draining(worker, true);
    return false;
  }
  if (worker.leases.size() >= settings_.newcomer_batches + worker.solved_batches) {
    return false;
  }
  const StudyId study = queue_.next_free();
  if (study == 0) {
    return seeks_stragglers_ && serve_straggler(id, worker);
  }
  const BatchSize wanted = portion_for(worker, study, true);
  grant(id, worker, study, *studies_.at(study).points.take(wanted), false);
  // A batch that ended early with its run of points says nothing of the worker's capacity.
  auto& fit_for = worker.paces.at(study).last_batch_points;
  fit_for = std::max(fit_for, wanted.points);
  return true;
}

bool Scheduler::serve_suspect(WorkerId id, Worker& worker) {
  const StudyId id_of_study = next_suspect_study(worker);
  Study& study = studies_.at(id_of_study);
  set_draining(worker, false);
  // The sooner these are known to be sound, the better: its lanes may stay empty.
  const BatchSize wanted = portion_for(worker, id_of_study, false);
  if (const auto batch = study.points.take(*suspect_for(study, worker), wanted)) {
    grant(id, worker, id_of_study, *batch, true);
  }
  return true;
}

/// What is left of the batch that straggles longest, also to this worker.
bool Scheduler::serve_straggler(WorkerId id, Worker& worker) {
  // Leases are numbered as they are granted: the first that straggles does so longest, and none
  // after one that is too young does.
  const auto longest = std::find_if(leases_.begin(), leases_.end(), [&](const auto& entry) {
    const Lease& lease = entry.second;
    return now_ms_ - lease.granted_ms < settings_.straggler_after_ms ||
           (lease.worker != id && is_straggling(lease, worker));
  });
  if (longest == leases_.end() ||
      now_ms_ - longest->second.granted_ms < settings_.straggler_after_ms) {
    seeks_stragglers_ = false;  // searching all leases costs: the next search is at the next tick
    return false;
  }
  Lease& straggler = longest->second;
  Study& study = studies_.at(straggler.study);
  const auto left =
      study.points.leased_set().within(straggler.batch.first_place, straggler.batch.end());
  study.overlaps = true;
  const Batch rest{left.front().begin, left.back().end - left.front().begin,
                   straggler.batch.attempts + 1, straggler.batch.losses, size_of(left)};
  const LeaseId twin = grant(id, worker, straggler.study, rest, false);
  straggler.twin = twin;
  leases_.at(twin).twin = longest->first;
  return true;
}

bool Scheduler::is_straggling(const Lease& lease, const Worker& helper) const {
  const Study& study = studies_.at(lease.study);
  const std::int64_t age_ms = now_ms_ - lease.granted_ms;
  if (lease.twin != 0 || lease.alone || !lease.batch.losses.empty() ||
      age_ms < settings_.straggler_after_ms || !is_open(study) ||
      study.points.leased_set().within(lease.batch.first_place, lease.batch.end()).empty()) {
    return false;
  }
  const Worker& holder = workers_.at(lease.worker);
  if (leases_.at(*holder.leases.begin()).granted_ms < lease.granted_ms) {
    return true;  // it waits behind another batch of its worker
  }
  for (const Worker* judge : {&helper, &holder}) {
    const auto pace = judge->paces.find(lease.study);
    if (pace != judge->paces.end() && pace->second.s_per_point() > 0.0) {
      const double expected_ms = 1e3 * pace->second.s_per_point() *
                                 static_cast<double>(lease.batch.points) / judge->threads;
      return static_cast<double>(age_ms) > settings_.straggler_factor * expected_ms;
    }
  }
  return true;
}

StudyId Scheduler::next_suspect_study(const Worker& worker) const {
  const auto& suspects = queue_.with_suspects();
  const auto found = std::find_if(suspects.begin(), suspects.end(), [&](StudyId study) {
    return suspect_for(studies_.at(study), worker).has_value();
  });
  return found == suspects.end() ? 0 : *found;
}

/// Which of the study's suspect points the worker may get. For accused ones the worker is wanted
/// that is least likely to be lost for a reason of its own. A newcomer gets none, but is told so
/// here, that it may be probed.
std::optional<Standing> Scheduler::suspect_for(const Study& study, const Worker& worker) const {
  const StudyPoints& points = study.points;
  if (points.has(Standing::kAccused) &&
      (!is_proven(worker) ||
       now_ms_ - points.returned_ms(Standing::kAccused) >= settings_.longest_proven_within_ms ||
       is_longest_proven(worker))) {
    return Standing::kAccused;
  }
  return points.has(Standing::kSuspect) ? std::optional(Standing::kSuspect) : std::nullopt;
}

void Scheduler::set_draining(Worker& worker, bool is_draining) {
  if (std::exchange(worker.draining, is_draining) == is_draining) {
    return;
  }
  if (is_draining) {
    ++draining_;
  } else {
    --draining_;
    ready_workers_.unpark_all();  // another one may have to
  }
}

/// How many points the worker should get of the study.
BatchSize Scheduler::portion_for(const Worker& worker, StudyId id, bool fills_lanes) const {
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
    fewest =
        static_cast<std::uint64_t>(by_pace * settings_.shortest_batch_s / settings_.batch_target_s);
  }
  if (studies_.at(id).points.has_filter()) {  // it may leave in all of the next batch
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
  if (fills_lanes) {
    wanted.falls = studies_.at(id).leases.empty() ? settings_.lanes * worker.threads : 0;
    fill_lanes(wanted, studies_.at(id).points, worker.threads, pace);
  }
  return wanted;
}

/// More points, or models, where a batch would leave lanes empty and take nearly as long.
void Scheduler::fill_lanes(BatchSize& wanted, const StudyPoints& points, std::uint32_t threads,
                           const Pace& pace) const {
  const auto lanes = static_cast<double>(settings_.lanes);
  const bool has_models = points.has_models();
  if (!has_models && pace.s_per_point() * lanes <= settings_.batch_target_s) {
    return;  // of quick points of one model a batch has enough
  }
  // Not more than its part of all that is open, of which it may hold something already: at the end
  // of a study every worker has a part.
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
  // A study may have grown since the worker was told of it.
  const std::uint64_t numbers = studies_.at(study).points.size();
  if (std::exchange(worker.defined[study], numbers) != numbers) {
    effects_.emplace_back(DefineStudy{id, study});
  }
  Study& served = studies_.at(study);
  Pace& pace = worker.paces[study];
  const double takes_s = pace.s_per_point() * static_cast<double>(batch.points) / worker.threads;
  // Whatever a worker says of its pace, no batch is to make its study wait for ever.
  const double counted_s = std::clamp(takes_s, settings_.batch_target_s,
                                      settings_.lanes_batch_s + settings_.batch_target_s);
  served.served += counted_s / settings_.batch_target_s;
  if (served.solver_version.empty()) {
    served.solver_version = settings_.solver_version;
  }
  worker.stored_ms = worker.leases.empty() ? now_ms_ : worker.stored_ms;
  const LeaseId lease = next_lease_++;
  leases_.emplace(lease, Lease{id, study, batch, alone, now_ms_});
  served.leases.insert(lease, batch);
  worker.leases.insert(lease);
  worker.credit -= std::min(worker.credit, 1U);
  pace.last_batch_points = batch.points;
  pace.last_end = batch.end();
  pace.held_points += batch.points;
  requeue(study);
  SendBatch send{id, study, {}, batch.attempts + 1, lease};
  for (const Interval& places : served.points.leased_set().within(batch.first_place, batch.end())) {
    const auto points = served.points.order().points(places);
    send.points.insert(send.points.end(), points.begin(), points.end());
  }
  effects_.emplace_back(std::move(send));
  return lease;
}

}  // namespace oblique::server
