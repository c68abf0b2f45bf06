#include "server/service/status.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {
namespace {

std::string reason_to_wait(const Core& core, const StudyCounts& counts, const Reuse& reuse) {
  const WriteLedger& ledger = core.ledger;
  if (ledger.is_gone()) {
    return ledger.fault();
  }
  if (!ledger.fault().empty()) {
    return "the database, which accepts no results: " + ledger.fault();
  }
  if (ledger.is_slow()) {
    return fmt::format("the database, which has stored nothing for over {} s",
                       WriteLedger::kSlowAfter_s);
  }
  if (reuse.lookup) {
    return fmt::format("the lookup of results of other studies ({} reused so far)", reuse.points);
  }
  if (counts.is_of_other_solver) {
    return fmt::format("a server with solver version {}, which solved its results",
                       counts.solver_version);
  }
  if (counts.leased == 0 && core.scheduler.are_all_stalled()) {
    return "a worker";
  }
  return {};
}

}  // namespace

protocol::StudyStatus study_status(StudyId id, const Core& core, Instant now) {
  const StudyRecord& record = core.states.record(id);
  const StudyCounts counts = core.scheduler.study(id);
  protocol::StudyStatus status;
  status.set_study_id(id);
  status.set_name(record.name);
  status.set_state(state_name(counts.open() == 0 ? StudyState::kDone : record.state));
  status.set_points(counts.points);
  status.set_solved(counts.solved());
  status.set_failed(counts.failed);
  status.set_left_out(counts.left_out);
  status.set_leased(counts.leased);
  status.set_created_at(record.created_at);
  status.set_priority(record.priority);
  status.set_solver_version(counts.solver_version);
  status.set_submitted_by(record.submitted_by);
  if (record.state == StudyState::kRunning) {
    status.set_points_per_s(core.rates.points_per_s(id, now.steady_ms));
    if (counts.open() > 0) {
      status.set_waits_for(reason_to_wait(core, counts, record.reuse));
    }
  }
  if (record.reuse.points > 0 || record.reuse.lookup || record.reuse.cut_short) {
    *status.mutable_reused() = reuse_status(record.reuse);
  }
  return status;
}

protocol::ReusedPoints reuse_status(const Reuse& reuse) {
  constexpr std::size_t kMaxOrigins = 20;
  protocol::ReusedPoints message;
  message.set_points(reuse.points);
  message.set_under_way(reuse.lookup.has_value());
  message.set_cut_short(reuse.cut_short);
  std::vector<std::pair<std::string, std::uint64_t>> origins(reuse.origins.begin(),
                                                             reuse.origins.end());
  std::ranges::stable_sort(origins, std::ranges::greater(),
                           [](const auto& origin) { return origin.second; });
  origins.resize(std::min(origins.size(), kMaxOrigins));
  for (const auto& [study, points] : origins) {
    auto& origin = *message.add_from();
    origin.set_study(study);
    origin.set_points(points);
  }
  return message;
}

protocol::WorkerStatus worker_status(WorkerId id, const Core& core, Instant now) {
  const WorkerRecord& worker = core.workers.all().at(id);
  const WorkerCounts counts = core.scheduler.worker(id, now.steady_ms);
  protocol::WorkerStatus status;
  status.set_worker_id(id);
  status.set_name(worker.row.name);
  status.set_threads(worker.row.threads);
  status.set_instruction_set(worker.row.instruction_set);
  status.set_solver_version(worker.row.solver_version);
  status.set_leased_points(counts.leased_points);
  status.set_solved_points(counts.solved_points);
  status.set_silent_ms(static_cast<std::uint32_t>(counts.silent_ms));
  status.set_losses(counts.losses);
  status.set_key(worker.key);
  status.set_host(worker.host);
  status.set_points_per_s(core.worker_rates.points_per_s(id, now.steady_ms));
  status.set_state(kWorkerStates.at(static_cast<std::size_t>(counts.state)));
  return status;
}

}  // namespace oblique::server
