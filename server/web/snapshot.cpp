#include "server/web/snapshot.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "server/service/service.h"

namespace oblique::server {
namespace {

/// A worker that is sound says something in each heartbeat interval of 900 ms.
constexpr std::int64_t kSilentAfter_ms = 1800;

/// The open work is to be done within this time by the threads that are wanted.
constexpr double kWantedWithin_s = 60.0;

struct Ranked {
  std::int32_t priority;
  StudyId id;

  /// The one of the higher priority comes first, then the older one.
  bool operator<(const Ranked& other) const {
    return priority != other.priority ? priority > other.priority : id < other.id;
  }
};

StudyNumbers numbers_of(StudyId id, const Service& service, std::int64_t now_ms) {
  const PointCounts points = service.scheduler().points(id);
  return {service.states().record(id).name,
          points.solved(),
          points.failed,
          points.leased,
          points.open() - points.leased,
          service.rates().points_per_s(id, points.settled, now_ms)};
}

void count_studies(const Service& service, std::int64_t now_ms, bool for_page, Snapshot& snapshot) {
  const StudyStates& states = service.states();
  snapshot.studies = states.counts();
  std::vector<Ranked> ranked;
  ranked.reserve(states.unfinished().size());
  for (const StudyId id : states.unfinished()) {
    if (!service.scheduler().knows_study(id)) {
      continue;  // it is not durable yet
    }
    const PointCounts points = service.scheduler().points(id);
    snapshot.points_open += states.state(id) == StudyState::kRunning ? points.open() : 0;
    snapshot.points_leased += points.leased;
    const StudyRecord& record = states.record(id);
    ranked.push_back({record.priority, id});
    if (!record.submitted_by.empty()) {
      OpenNumbers& open = snapshot.open_by_key[record.submitted_by];
      ++open.studies;
      open.points += points.open();
    }
  }
  const std::size_t listed = std::min(ranked.size(), kListedStudies);
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(listed),
                    ranked.end());
  snapshot.unlisted = ranked.size() - listed;
  ranked.resize(listed);
  for (const Ranked& study : ranked) {
    snapshot.listed.push_back(numbers_of(study.id, service, now_ms));
    if (for_page) {
      snapshot.shown_studies.push_back(service.study_status(study.id, {now_ms, 0}));
    }
  }
}

void count_peers(const SnapshotSources& sources, Snapshot& snapshot) {
  const Network& network = sources.network;
  snapshot.held_in_bytes = network.held_in_bytes();
  snapshot.waiting_out_bytes = network.waiting_out_bytes();
  snapshot.clients = {network.connections(sources.client_port), sources.client_traffic};
  snapshot.workers = {network.connections(sources.worker_port), sources.worker_traffic};
  snapshot.connections_ended = sources.connections_ended;
  snapshot.refusals = network.refusals();
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

Snapshot take_snapshot(const SnapshotSources& sources, std::int64_t now_ms, bool for_page) {
  const Service& service = sources.service;
  const Scheduler& scheduler = service.scheduler();
  Snapshot snapshot;
  snapshot.made_ms = now_ms;
  snapshot.is_for_page = for_page;
  snapshot.points_solved = service.stored_points().solved;
  snapshot.points_failed = service.stored_points().failed;
  snapshot.points_per_s = service.points_per_s(now_ms);
  snapshot.thread_s_per_point = scheduler.thread_s_per_point();
  count_studies(service, now_ms, for_page, snapshot);
  if (for_page) {
    snapshot.shown_workers = service.worker_statuses(kShownWorkers, {now_ms, 0});
  }
  snapshot.batches_leased = scheduler.leases();
  snapshot.batch_s = scheduler.batch_s();
  snapshot.crews = scheduler.crews(now_ms, kSilentAfter_ms);
  snapshot.commits = sources.writer.commits();
  snapshot.writer_jobs = service.ledger().jobs();
  snapshot.writer_bytes = service.ledger().bytes();
  snapshot.database_fault = service.ledger().fault();
  snapshot.is_stopping = service.is_stopping();
  count_peers(sources, snapshot);
  snapshot.bad_frames = service.bad_frames();
  snapshot.queries = service.query_counts();
  return snapshot;
}

}  // namespace oblique::server
