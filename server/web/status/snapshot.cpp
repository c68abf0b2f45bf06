#include "server/web/status/snapshot.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "proto/result_message.h"
#include "server/service/service.h"
#include "server/web/http/http_message.h"

namespace oblique::server {
namespace {

/// A shorter silence of a worker is not shown, because heartbeats come every 900 ms.
constexpr std::uint32_t kSilence_ms = 2000;

/// The time in which `threads_wanted` threads would solve all open points.
constexpr double kWantedWithin_s = 60.0;

void count_studies(const Service& service, std::int64_t now_ms, Snapshot& snapshot) {
  const StudyStates& states = service.states();
  snapshot.studies_by_state = states.counts();
  std::vector<std::pair<std::int64_t, StudyId>> ranked;  // by descending priority, the oldest first
  ranked.reserve(states.unfinished().size());
  for (const StudyId id : states.unfinished()) {
    if (!service.scheduler().has_study(id)) {
      continue;  // the study is not durable yet
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
  snapshot.results_ignored = service.stored_points().ignored;
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

nlohmann::ordered_json study_json(const protocol::StudyStatus& study) {
  const auto open = static_cast<double>(protocol::open_points(study));
  const bool is_known = study.state() == "running" && study.points_per_s() > 0.0;
  return {{"id", study.study_id()},
          {"name", study.name()},
          {"state", study.state()},
          {"points", study.points()},
          {"solved", study.solved()},
          {"failed", study.failed()},
          {"left_out", study.left_out()},
          {"leased", study.leased()},
          {"points_per_s", study.points_per_s()},
          {"left_s", is_known ? nlohmann::ordered_json(open / study.points_per_s()) : nullptr},
          {"waits_for", study.waits_for()},
          {"priority", study.priority()},
          {"solver_version", study.solver_version()},
          {"created_at", study.created_at()},
          {"submitted_by", study.submitted_by()},
          {"taken_over", study.reused().points()}};
}

nlohmann::ordered_json worker_json(const protocol::WorkerStatus& worker) {
  return {{"id", worker.worker_id()},
          {"name", worker.name()},
          {"host", worker.host()},
          {"threads", worker.threads()},
          {"state", worker.state()},
          {"points_per_s", worker.points_per_s()},
          {"leased_points", worker.leased_points()},
          {"solved_points", worker.solved_points()},
          {"silent_s", worker.silent_ms() < kSilence_ms ? 0 : worker.silent_ms() / 1000},
          {"losses", worker.losses()},
          {"solver_version", worker.solver_version()},
          {"instruction_set", worker.instruction_set()}};
}

std::string overview_json(const Snapshot& snapshot) {
  using nlohmann::ordered_json;
  ordered_json states;
  for (std::size_t i = 0; i < snapshot.studies_by_state.size(); ++i) {
    states[state_name(static_cast<StudyState>(i))] = snapshot.studies_by_state.at(i);
  }
  std::uint64_t workers_there = 0;
  std::uint64_t threads = 0;
  for (const WorkerGroup& group : snapshot.groups) {
    workers_there += group.workers;
    threads += group.threads;
  }
  return json_text({{"studies", json_list(snapshot.studies, study_json)},
                    {"unlisted", snapshot.unlisted},
                    {"studies_by_state", std::move(states)},
                    {"workers", json_list(snapshot.workers, worker_json)},
                    {"workers_there", workers_there},
                    {"threads", threads},
                    {"points_open", snapshot.points_open},
                    {"points_leased", snapshot.points_leased},
                    {"points_per_s", snapshot.points_per_s},
                    {"threads_wanted", snapshot.threads_wanted()},
                    {"thread_s_per_point", snapshot.thread_s_per_point},
                    {"database_fault", snapshot.database_fault},
                    {"is_stopping", snapshot.is_stopping}});
}

}  // namespace oblique::server
