#include "server/web/status/snapshot.h"

#include <algorithm>
#include <cmath>

#include "server/service/service.h"

namespace oblique::server {
namespace {

/// A worker sends something in each heartbeat interval of 900 ms.

/// Time in which the wanted threads would solve the open points.
constexpr double kWantedWithin_s = 60.0;

void count_studies(const Service& service, std::int64_t now_ms, Snapshot& snapshot) {
  const StudyStates& states = service.states();
  snapshot.studies_by_state = states.counts();
  std::vector<std::pair<std::int64_t, StudyId>> ranked;  // by falling priority, then by age
  ranked.reserve(states.unfinished().size());
  for (const StudyId id : states.unfinished()) {
    if (!service.scheduler().knows_study(id)) {
      continue;  // it is not durable yet
    }
    const StudyCounts points = service.scheduler().study(id);
    snapshot.points_open += states.record(id).state == StudyState::kRunning ? points.open() : 0;
    snapshot.points_leased += points.leased;
    ranked.emplace_back(-std::int64_t{states.record(id).priority}, id);
  }
  const std::size_t shown = std::min(ranked.size(), kShownStudies);
  snapshot.unlisted = ranked.size() - shown;
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(shown),
                    ranked.end());
  for (std::size_t i = 0; i < shown; ++i) {
    snapshot.studies.push_back(study_status(ranked[i].second, service.core(), {now_ms, 0}));
  }
}

}  // namespace

std::uint64_t Snapshot::threads_wanted() const {
  if (thread_s_per_point <= 0.0) {
    return std::min<std::uint64_t>(points_open, 1);
  }
  const double wanted =
      std::ceil(static_cast<double>(points_open) * thread_s_per_point / kWantedWithin_s);
  return wanted >= static_cast<double>(points_open) ? points_open
                                                    : static_cast<std::uint64_t>(wanted);
}

Snapshot take_snapshot(const SnapshotSources& sources, std::int64_t now_ms) {
  const Service& service = sources.service;
  const Scheduler& scheduler = service.scheduler();
  Snapshot snapshot;
  snapshot.made_ms = now_ms;
  snapshot.points_solved = service.stored_points().solved;
  snapshot.points_failed = service.stored_points().failed;
  snapshot.points_per_s = service.rates().points_per_s(now_ms);
  snapshot.thread_s_per_point = scheduler.thread_s_per_point();
  count_studies(service, now_ms, snapshot);
  snapshot.workers = service.worker_statuses(kShownWorkers, {now_ms, 0});
  snapshot.groups = scheduler.groups(now_ms);
  snapshot.commit_s = sources.writer.commits().duration_s;
  snapshot.writer_bytes = service.ledger().bytes();
  snapshot.database_fault = service.ledger().fault();
  snapshot.is_stopping = service.is_stopping();
  snapshot.refusals = sources.network.refusals();
  snapshot.queries = service.query_counts();
  return snapshot;
}

}  // namespace oblique::server
