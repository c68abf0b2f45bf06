#include "server/service/status.h"

#include <string>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {
namespace {

/// Why a running study makes no progress; empty: it does.
std::string reason_to_wait(StudyId id, const Core& core, const StudyCounts& counts,
                           const protocol::TakenOver& reused, Instant now) {
  constexpr std::int64_t kQuietAfter_ms = 20'000;
  const WriteLedger& ledger = core.ledger;
  if (ledger.is_gone()) {
    return ledger.fault();
  }
  if (!ledger.fault().empty()) {
    return "the database, which takes no results: " + ledger.fault();
  }
  if (ledger.is_slow()) {
    return fmt::format("the database, which stored nothing for over {} s",
                       WriteLedger::kSlowAfter_s);
  }
  if (reused.under_way()) {
    return fmt::format("the lookup of results of other studies, {} reused so far", reused.points());
  }
  if (counts.is_of_other_solver) {
    return fmt::format("a server with solver version {}, that of its results",
                       counts.solver_version);
  }
  if (counts.leased == 0 && core.scheduler.sets_all_aside()) {
    return "a worker";
  }
  const QuietWorkers quiet = core.scheduler.quiet_workers(id, now.steady_ms);
  if (counts.leased > 0 && quiet.quiet_ms >= kQuietAfter_ms) {
    return fmt::format("results of {} point{} from {} worker{}, which stored nothing for over {} s",
                       counts.leased, counts.leased == 1 ? "" : "s", quiet.workers,
                       quiet.workers == 1 ? "" : "s", kQuietAfter_ms / 1000);
  }
  return {};
}

const char* worker_state(const WorkerCounts& counts, bool is_busy) {
  constexpr std::int64_t kSilentAfter_ms = 1500;  // heartbeats come every 900 ms
  return counts.silent_ms > kSilentAfter_ms ? "silent"
         : counts.is_set_aside              ? "set aside"
         : is_busy                          ? "busy"
         : counts.leased_points > 0         ? "working"
                                            : "idle";
}

}  // namespace

protocol::StudyStatus study_status(StudyId id, const Core& core, Instant now) {
  const StudyRecord& record = core.states.record(id);
  const StudyState state = core.states.state(id);
  const StudyCounts counts = core.scheduler.study(id);
  protocol::StudyStatus status;
  status.set_study_id(id);
  status.set_name(record.name);
  status.set_state(state_name(counts.open() == 0 ? StudyState::kDone : state));
  status.set_points(counts.points);
  status.set_solved(counts.solved());
  status.set_failed(counts.failed);
  status.set_left_out(counts.left_out);
  status.set_leased(counts.leased);
  status.set_created_at(record.created_at);
  status.set_priority(record.priority);
  status.set_solver_version(counts.solver_version);
  status.set_submitted_by(record.submitted_by);
  const protocol::TakenOver reused = core.reuse.status(id);
  if (state == StudyState::kRunning) {
    status.set_points_per_s(core.rates.points_per_s(id, now.steady_ms));
    if (counts.open() > 0) {
      status.set_waits_for(reason_to_wait(id, core, counts, reused, now));
    }
  }
  if (reused.points() > 0 || reused.under_way() || reused.cut_short()) {
    *status.mutable_taken() = reused;
  }
  return status;
}

protocol::WorkerStatus worker_status(WorkerId id, const Core& core, Instant now) {
  const WorkerRecord& worker = *core.workers.find(id);
  const WorkerCounts counts = core.scheduler.worker(id, now.steady_ms);
  protocol::WorkerStatus status;
  status.set_worker_id(id);
  status.set_name(worker.name);
  status.set_threads(worker.threads);
  status.set_instruction_set(worker.instruction_set);
  status.set_solver_version(worker.solver_version);
  status.set_leased_points(counts.leased_points);
  status.set_solved_points(counts.solved_points);
  status.set_silent_ms(static_cast<std::uint32_t>(counts.silent_ms));
  status.set_losses(counts.losses);
  status.set_set_aside(counts.is_set_aside);
  status.set_proven(counts.is_proven);
  status.set_key(worker.key);
  status.set_host(worker.host);
  status.set_points_per_s(core.worker_rates.points_per_s(id, now.steady_ms));
  status.set_state(worker_state(counts, worker.is_busy));
  return status;
}

}  // namespace oblique::server
