// The part of the scheduler that decides who gets what next.
#include <algorithm>
#include <utility>

#include "server/scheduler.h"

namespace oblique::server {

void Scheduler::dispatch() {
  if (held_) {
    return;
  }
  std::size_t served_nothing = 0;  // workers in a row
  while (served_nothing < ready_workers_.size() &&
         (next_free_study() != 0 || next_suspect_study() != 0)) {
    const WorkerId id = ready_workers_.front();
    ready_workers_.pop_front();
    Worker& worker = workers_.at(id);
    worker.queued = false;
    const bool served = serve(id, worker);
    queue(id, worker);
    served_nothing = served ? 0 : served_nothing + 1;
  }
}

bool Scheduler::serve(WorkerId id, Worker& worker) {
  const bool holds_suspect = !worker.leases.empty() && leases_.at(*worker.leases.begin()).alone;
  if (holds_suspect) {
    return false;
  }
  if (next_suspect_study() == 0) {
    worker.draining = false;
  } else if (worker.leases.empty()) {
    return serve_suspect(id, worker);
  } else if (worker.draining || !anyone_draining()) {
    // Suspect points wait for one worker to empty, the others go on.
    worker.draining = true;
    return false;
  }
  const StudyId study = next_free_study();
  if (study == 0) {
    return false;
  }
  if (const auto chunk = studies_.at(study).points.take(batch_points(worker, study))) {
    grant(id, worker, study, *chunk, false);
  }
  return true;
}

bool Scheduler::serve_suspect(WorkerId id, Worker& worker) {
  const StudyId study = next_suspect_study();
  worker.draining = false;
  if (const auto chunk = studies_.at(study).points.take_suspect(batch_points(worker, study))) {
    grant(id, worker, study, *chunk, true);
  }
  return true;
}

/// The highest priority, then the one served least for its weight, then the oldest.
StudyId Scheduler::next_free_study() const {
  auto best = studies_.end();
  for (auto study = studies_.begin(); study != studies_.end(); ++study) {
    const Study& candidate = study->second;
    if (!candidate.is_open() || !candidate.points.has_free()) {
      continue;
    }
    const bool is_better = best == studies_.end() ||
                           candidate.share.priority > best->second.share.priority ||
                           (candidate.share.priority == best->second.share.priority &&
                            candidate.served < best->second.served);
    if (is_better) {
      best = study;
    }
  }
  return best == studies_.end() ? 0 : best->first;
}

StudyId Scheduler::next_suspect_study() const {
  const auto found = std::find_if(studies_.begin(), studies_.end(), [](const auto& entry) {
    return entry.second.is_open() && entry.second.points.has_suspect();
  });
  return found == studies_.end() ? 0 : found->first;
}

bool Scheduler::anyone_draining() const {
  return std::any_of(workers_.begin(), workers_.end(),
                     [](const auto& entry) { return entry.second.draining; });
}

std::uint64_t Scheduler::batch_points(const Worker& worker, StudyId id) const {
  std::uint64_t points = settings_.first_batch_points * worker.threads;
  const auto pace = worker.paces.find(id);
  if (pace != worker.paces.end() && pace->second.s_per_point > 0.0) {
    const double wanted = settings_.batch_target_s * worker.threads / pace->second.s_per_point;
    const auto largest = static_cast<double>(
        std::min(settings_.largest_batch_points * worker.threads,
                 settings_.growth * std::max<std::uint64_t>(pace->second.last_batch_points, 1)));
    points = static_cast<std::uint64_t>(std::min(wanted, largest));
  }
  const std::uint64_t shares = settings_.tail_batches_per_thread * threads_;
  const std::uint64_t fair =
      studies_.at(id).points.free() / std::max<std::uint64_t>(shares, 1) * worker.threads;
  return std::max<std::uint64_t>(std::min(points, fair), 1);
}

void Scheduler::grant(WorkerId id, Worker& worker, StudyId study, const Chunk& chunk, bool alone) {
  if (worker.defined.insert(study).second) {
    effects_.emplace_back(DefineStudy{id, study});
  }
  studies_.at(study).served += 1.0 / studies_.at(study).share.weight;
  const LeaseId lease = next_lease_++;
  leases_.emplace(lease, Lease{id, study, chunk, alone, now_ms_});
  worker.leases.insert(lease);
  --worker.credit;
  worker.paces[study].last_batch_points = chunk.count;
  effects_.emplace_back(
      SendBatch{id, study, chunk.model, chunk.first_point, chunk.count, chunk.attempts + 1, lease});
}

}  // namespace oblique::server
