#include "server/service/views.h"

#include <spdlog/fmt/fmt.h>

namespace oblique::server {
namespace {

std::string what_it_waits_for(StudyId id, const StudySources& sources, const StudyCounts& counts,
                              const protocol::TakenOver& taken, Instant now) {
  constexpr std::int64_t kQuietAfter_ms = 20'000;
  const WriteLedger& ledger = sources.ledger;
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
  if (taken.under_way()) {
    return fmt::format("known points to be taken over from other studies, {} so far",
                       taken.points());
  }
  if (counts.is_of_other_solver) {
    return fmt::format("a server with solver version {}, that of its results",
                       counts.solver_version);
  }
  if (counts.leased == 0 && sources.scheduler.sets_all_aside()) {
    return "a worker";
  }
  const QuietWorkers quiet = sources.scheduler.quiet_workers(id, now.steady_ms);
  if (counts.leased > 0 && quiet.quiet_ms >= kQuietAfter_ms) {
    return fmt::format("results of {} point{} from {} worker{}, which stored nothing for over {} s",
                       counts.leased, counts.leased == 1 ? "" : "s", quiet.workers,
                       quiet.workers == 1 ? "" : "s", kQuietAfter_ms / 1000);
  }
  return {};
}

}  // namespace

StudyView view_of(StudyId id, const StudySources& sources, Instant now) {
  const StudyRecord& record = sources.states.record(id);
  const StudyState state = sources.states.state(id);
  const StudyCounts counts = sources.scheduler.study(id);
  StudyView view{id,
                 record.name,
                 state,
                 counts.points,
                 counts.solved,
                 counts.failed,
                 counts.left_out,
                 counts.leased,
                 record.created_at,
                 record.priority,
                 counts.solver_version,
                 {},
                 0.0,
                 record.submitted_by,
                 sources.known.message_of(id)};
  const bool is_complete = view.settled() == view.points;
  if (is_complete) {
    view.state = StudyState::kDone;
  }
  if (state == StudyState::kRunning) {
    view.points_per_s = sources.rates.points_per_s(id, view.settled(), now.steady_ms);
    view.waits_for =
        is_complete ? std::string() : what_it_waits_for(id, sources, counts, view.taken, now);
  }
  return view;
}

protocol::StudyStatus to_message(const StudyView& view) {
  protocol::StudyStatus message;
  message.set_study_id(view.id);
  message.set_name(view.name);
  message.set_state(state_name(view.state));
  message.set_points(view.points);
  message.set_solved(view.solved);
  message.set_failed(view.failed);
  message.set_left_out(view.left_out);
  message.set_leased(view.leased);
  message.set_created_at(view.created_at);
  message.set_priority(view.priority);
  message.set_solver_version(view.solver_version);
  message.set_waits_for(view.waits_for);
  message.set_points_per_s(view.points_per_s);
  message.set_submitted_by(view.submitted_by);
  if (view.taken.points() > 0 || view.taken.under_way() || view.taken.cut_short()) {
    *message.mutable_taken() = view.taken;
  }
  return message;
}

std::uint64_t open_points_of(StudyId id, const StudySources& sources) {
  if (!sources.states.is_durable(id)) {
    return sources.states.record(id).table.size();
  }
  return sources.scheduler.points(id).open();
}

WorkerView view_of(WorkerId id, const WorkerRecord& worker, const Scheduler& scheduler,
                   const SettledRates& rates, Instant now) {
  const WorkerCounts counts = scheduler.worker(id, now.steady_ms);
  return {id,
          worker.name,
          worker.threads,
          worker.instruction_set,
          worker.solver_version,
          counts,
          worker.host,
          rates.points_per_s(id, counts.solved_points, now.steady_ms),
          worker.is_busy,
          worker.key};
}

std::vector<WorkerView> first_workers(std::size_t most, const WorkersDesk& workers,
                                      const Scheduler& scheduler, const SettledRates& rates,
                                      Instant now) {
  std::vector<WorkerView> views;
  for (auto id = workers.next_after(0); id && views.size() < most; id = workers.next_after(*id)) {
    views.push_back(view_of(*id, *workers.find(*id), scheduler, rates, now));
  }
  return views;
}

std::string state_of(const WorkerView& view) {
  constexpr std::int64_t kSilentAfter_ms = 1500;  // heartbeats come every 900 ms
  return view.counts.silent_ms > kSilentAfter_ms ? "silent"
         : view.counts.is_set_aside              ? "set aside"
         : view.is_busy                          ? "busy"
         : view.counts.leased_points > 0         ? "working"
                                                 : "idle";
}

protocol::WorkerStatus to_message(const WorkerView& view) {
  protocol::WorkerStatus message;
  message.set_worker_id(view.id);
  message.set_name(view.name);
  message.set_threads(view.threads);
  message.set_instruction_set(view.instruction_set);
  message.set_solver_version(view.solver_version);
  message.set_leased_points(view.counts.leased_points);
  message.set_solved_points(view.counts.solved_points);
  message.set_silent_ms(static_cast<std::uint32_t>(view.counts.silent_ms));
  message.set_losses(view.counts.losses);
  message.set_set_aside(view.counts.is_set_aside);
  message.set_proven(view.counts.is_proven);
  message.set_key(view.key);
  message.set_host(view.host);
  message.set_points_per_s(view.points_per_s);
  message.set_state(state_of(view));
  return message;
}

}  // namespace oblique::server
