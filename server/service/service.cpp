#include "server/service/service.h"

#include <optional>
#include <utility>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/point_table.h"
#include "proto/result_message.h"

namespace oblique::server {
namespace {

template <typename... Kinds>
struct Overloaded : Kinds... {
  using Kinds::operator()...;
};
template <typename... Kinds>
Overloaded(Kinds...) -> Overloaded<Kinds...>;

}  // namespace

Service::Service(const ServiceSettings& settings, Ports& ports, std::vector<StoredStudy> studies,
                 Instant now)
    : ports_(ports),
      scheduler_(settings.scheduler, settings.solver_version),
      ledger_(settings.ledger, ports),
      peer_log_(ports),
      workers_(settings, settings.scheduler.lost_after_ms, ports, peer_log_, ledger_),
      core_{ports,
            scheduler_,
            states_,
            ledger_,
            workers_,
            rates_,
            worker_rates_,
            settings.solver_version,
            [this](const Event& event, Instant then) { feed(event, then); }},
      changes_(settings.last_study_id, settings.bounds, core_),
      clients_(settings.clients, core_, peer_log_, changes_) {
  for (StoredStudy& study : studies) {
    restore(std::move(study), settings.only_study, now);
  }
}

void Service::restore(StoredStudy study, const std::string& only_study, Instant now) {
  const StudyId id = study.study_id;
  states_.restore(study, now.steady_ms);
  const bool is_excluded = !only_study.empty() && study.name != only_study;
  const bool looks_up = study.reuses && !is_excluded;  // the lookup of results has not ended
  feed(StudyAdded{id, study.table, std::move(study.completed), study.failures.size(),
                  study.state == StudyState::kCancelled,
                  study.state == StudyState::kPaused || is_excluded, study.priority,
                  study.solver_version, looks_up, study.left_out},
       now);
  if (looks_up) {
    changes_.look_up(id, now);
  }
}

// ---- Messages, time ----------------------------------------------------------------------------

void Service::worker_frame(const std::string& identity, std::string_view frame, Instant now,
                           const std::shared_ptr<const KeyIdentity>& holder) {
  WorkerInput input =
      workers_.frame(identity, frame, now, holder == nullptr ? std::string() : holder->name);
  for (Event& event : input.events) {
    if (auto* received = std::get_if<ResultsReceived>(&event)) {
      check_inputs(*received, input.results);
    }
    handle(event, now, &input.results);
  }
  if (input.trace_of != 0) {
    clients_.trace_received(input.trace_of, std::move(input.trace));
  }
  handle_worker_events(now);
  hold_or_release_batches(now);
}

void Service::tick(Instant now) {
  workers_.tick([&](WorkerId id) { return scheduler_.silent_ms(id, now.steady_ms); }, now);
  feed(Tick{}, now);
  ledger_.tick(now.steady_ms);
  clients_.tick(now);
  peer_log_.tick(now.steady_ms);
  changes_.release_replies(now);
  rates_.forget_old(now.steady_ms);
  worker_rates_.forget_old(now.steady_ms);
}

void Service::drain(Instant now) {
  draining_ = true;
  changes_.stop_lookups();
  hold_or_release_batches(now);
  workers_.stop();
  clients_.drain();
}

void Service::stop(Instant now) {
  stopping_ = true;
  changes_.stop_lookups();
  hold_or_release_batches(now);
  workers_.stop();
  clients_.stop();
}

std::vector<protocol::WorkerStatus> Service::worker_statuses(std::size_t most, Instant now) const {
  std::vector<protocol::WorkerStatus> statuses;
  for (const auto& [id, worker] : workers_.all()) {
    if (statuses.size() == most) {
      break;
    }
    statuses.push_back(worker_status(id, core_, now));
  }
  return statuses;
}

// ---- The scheduler -----------------------------------------------------------------------------

void Service::feed(const Event& event, Instant now) {
  handle(event, now);
  handle_worker_events(now);
}

void Service::handle(const Event& event, Instant now, protocol::Results* results) {
  const Overloaded perform{
      [&](const DefineStudy& effect) { workers_.define(effect, states_.record(effect.study)); },
      [&](const StoreResults& effect) { store(effect, results, now); },
      [&](const StoreFailure& effect) { store(effect, now); },
      [&](const DropWorker& effect) {
        workers_.drop(effect);
        clients_.worker_left(effect.worker);
      },
      [&](const StudyFinished& effect) { changes_.finish(effect.study, now); },
      [&](const auto& message) { workers_.send(message); }};
  for (const Effect& effect : scheduler_.handle(event, now.steady_ms)) {
    std::visit(perform, effect);
  }
  if (const auto* left = std::get_if<WorkerLeft>(&event)) {
    clients_.worker_left(left->worker);
  }
}

void Service::handle_worker_events(Instant now) {
  for (auto events = workers_.take_events(); !events.empty(); events = workers_.take_events()) {
    for (const Event& event : events) {
      handle(event, now);
    }
  }
}

/// Fails results with wrong inputs. Removes results of another study: their uid differs, or their
/// inputs differ and no lease of this run shows that the worker has this study.
void Service::check_inputs(ResultsReceived& event, protocol::Results& message) {
  // Without open points nothing is stored, so the inputs need no check and the table is not made.
  if (!states_.contains(event.study) || !scheduler_.has_study(event.study) ||
      scheduler_.study(event.study).open() == 0) {
    return;
  }
  const StudyRecord& study = states_.record(event.study);
  const bool has_lease = scheduler_.has_lease(event.worker, event.lease, event.study);
  int kept = 0;
  for (int i = 0; i < message.results_size() && message.study_uid() == study.uid; ++i) {
    protocol::PointResult& result = *message.mutable_results(i);
    const std::string fault = result.point() < study.table.size()
                                  ? protocol::fault_of_inputs(result, *study.table.get())
                                  : std::string();
    if (!fault.empty() && !has_lease) {
      continue;
    }
    if (!fault.empty()) {
      result = protocol::failed_point(result.point(), fault);
    }
    event.outcomes[static_cast<std::size_t>(kept)] = {result.point(), !result.error().empty()};
    message.mutable_results()->SwapElements(kept++, i);
  }
  if (const int ignored = message.results_size() - kept; ignored > 0) {
    stored_points_.ignored += static_cast<std::uint64_t>(ignored);
    event.outcomes.resize(static_cast<std::size_t>(kept));
    message.mutable_results()->DeleteSubrange(kept, ignored);
    peer_log_.write(Severity::kWarning,
                    fmt::format("worker {} sent {} results for another study than {}, as after a "
                                "copy of the database was restored: they are ignored",
                                event.worker, ignored, study.name));
  }
}

void Service::hold_or_release_batches(Instant now) {
  const bool holds = stopping_ || draining_ || ledger_.holds_batches();
  if (std::exchange(holds_batches_, holds) != holds) {
    feed(DispatchHeld{holds}, now);
  }
}

// ---- The database ------------------------------------------------------------------------------

void Service::store(const StoreResults& effect, protocol::Results* message, Instant now) {
  WorkerRecord* const worker = workers_.find(effect.worker);
  if (worker == nullptr || message == nullptr) {
    return;  // without an acknowledgement a worker keeps its results
  }
  const bool has_rows = !effect.accepted.empty() && states_.contains(effect.study);
  if (has_rows && !std::exchange(worker->has_row, true)) {
    // The worker's row is stored with its first result.
    ledger_.write(worker->row);
  }
  AddResults change{effect.study,
                    has_rows ? states_.record(effect.study).table.get() : nullptr,
                    effect.worker,
                    worker->row.solver_version,
                    worker->row.instruction_set,
                    message->attempt(),
                    iso_8601(now),
                    {},
                    effect.left_out,
                    message->ByteSizeLong()};
  ResultsStored event{effect.worker, effect.study, effect.sequence, {}, effect.left_out};
  for (const std::size_t index : effect.accepted) {
    protocol::PointResult& result = *message->mutable_results(static_cast<int>(index));
    event.outcomes.push_back({result.point(), !result.error().empty()});
    change.results.push_back(std::move(result));
  }
  write_results(std::move(change), std::move(event));
}

void Service::store(const StoreFailure& effect, Instant now) {
  const StudyRecord& study = states_.record(effect.study);
  ports_.log(Severity::kWarning, fmt::format("point {} of study {} failed: {}", effect.point,
                                             study.name, effect.reason));
  write_results({effect.study,
                 study.table.get(),
                 0,
                 {},
                 {},
                 effect.attempt,
                 iso_8601(now),
                 {protocol::failed_point(effect.point, effect.reason)}},
                {0, effect.study, 0, {{effect.point, true}}, {}});
}

void Service::write_results(AddResults change, ResultsStored event) {
  ledger_.write(std::move(change),
                [this, event = std::move(event)](Instant now) { results_stored(event, now); });
}

void Service::results_stored(const ResultsStored& event, Instant now) {
  const StudyId id = event.study;
  if (!states_.contains(id)) {
    feed(event, now);  // the study was deleted, so the database has dropped these results
    return;
  }
  std::uint64_t solved = 0;
  for (const PointOutcome& outcome : event.outcomes) {
    if (outcome.failed) {
      states_.record(id).failures.insert(outcome.point);
    }
    solved += outcome.failed ? 0 : 1;
  }
  stored_points_.solved += solved;
  stored_points_.failed += event.outcomes.size() - solved;
  rates_.add(id, event.outcomes.size() + event.left_out.size(), states_.record(id).since_ms,
             now.steady_ms);
  worker_rates_.add(event.worker, solved, 0, now.steady_ms);
  if (!event.outcomes.empty()) {
    states_.note_results();
  }
  feed(event, now);
}

void Service::written(const WriteReport& report, Instant now) {
  switch (report.kind) {
    case WriteReport::Kind::kStored:
      ledger_.end(report.ticket, std::nullopt, now);
      break;
    case WriteReport::Kind::kRefused:
      ledger_.end(report.ticket, report.error, now);
      break;
    case WriteReport::Kind::kFault:
      ports_.log(Severity::kError, "results are waiting and no batches are sent: " + report.error);
      ledger_.set_fault(report.error);
      break;
    case WriteReport::Kind::kRecovered:
      ports_.log(Severity::kInfo, "the database accepts results again");
      ledger_.set_fault({});
      break;
    case WriteReport::Kind::kGone:
      ports_.log(Severity::kError, report.error);
      ledger_.abandon(report.error, now);
      workers_.notify_all(report.error);
      stop(now);
      break;
    case WriteReport::Kind::kUnmerged:
      ports_.log(Severity::kWarning,
                 fmt::format(
                     "the write-ahead log (the file beside the database that ends in -wal) "
                     "is not merged into the database yet: {}. Until then a copy needs both files; "
                     "`oblique backup` makes a complete one",
                     report.error));
      break;
  }
  hold_or_release_batches(now);
}

}  // namespace oblique::server
