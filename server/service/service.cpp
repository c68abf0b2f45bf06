#include "server/service/service.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/point_inputs.h"
#include "proto/result_message.h"

namespace oblique::server {

Service::Service(const ServiceSettings& settings, Outbox& outbox, std::vector<StoredStudy> studies,
                 Instant now)
    : outbox_(outbox),
      scheduler_(settings.scheduler),
      ledger_(settings.ledger, outbox),
      known_(settings.solver_version),
      bad_frames_(outbox),
      workers_({settings.heartbeat_interval_ms, settings.scheduler.lost_after_ms,
                settings.solver_version, settings.database_id, settings.last_worker_id,
                settings.clients.access == "insecure"},
               outbox, outbox, bad_frames_, ledger_),
      open_(settings.bounds),
      changes_(settings.last_study_id, states_, ledger_,
               {scheduler_, states_, ledger_, rates_, known_}, known_, open_, outbox, outbox),
      traces_(settings.solver_version, outbox, outbox, settings.clients.still_working_every_ms),
      clients_(settings.clients, {outbox,
                                  outbox,
                                  bad_frames_,
                                  changes_,
                                  workers_,
                                  {scheduler_, states_, ledger_, rates_, known_},
                                  outbox,
                                  worker_rates_,
                                  traces_}) {
  for (StoredStudy& study : studies) {
    states_.restore(study, now.steady_ms);
    if (!study.settled.empty()) {
      known_.note_source(study.study_id);
    }
    known_.restore(study.study_id, study.taken);
    const std::string& name = states_.record(study.study_id).name;
    const bool waits = !settings.only_study.empty() && name != settings.only_study;
    const bool seeks = study.reuses && !waits;
    feed(StudyAdded{study.study_id, study.table, std::move(study.settled), study.failures.size(),
                    study.state == StudyState::kCancelled,
                    study.state == StudyState::kPaused || waits, study.priority,
                    study.solver_version, std::move(study.attempts), seeks, study.left_out},
         now);
    if (seeks) {  // it was not at its end when the server ended
      begin_reuse(study.study_id, now);
    }
    changes_.recount(study.study_id);
  }
}

// ---- Messages, time ---------------------------------------------------------------------------

void Service::worker_frame(const std::string& identity, std::string_view frame, Instant now,
                           const std::shared_ptr<const KeyHolder>& holder) {
  Heard heard =
      workers_.take(identity, frame, now, holder == nullptr ? std::string() : holder->name);
  for (Event& event : heard.events) {
    if (auto* received = std::get_if<ResultsReceived>(&event)) {
      judge_inputs(*received, heard.results);
    }
    handle(event, {now, &heard.results});
  }
  if (heard.trace_of != 0) {
    traces_.trace_received(heard.trace_of, std::move(heard.trace));
  }
  handle_found(now);
  hand_out_or_hold(now);
  send_traces();
}

void Service::client_frame(const std::string& identity, std::string_view frame, Instant now,
                           const std::shared_ptr<const KeyHolder>& holder) {
  clients_.take(identity, frame, now, holder);
  send_traces();
}

void Service::tick(Instant now) {
  workers_.tick([&](WorkerId id) { return scheduler_.silent_ms(id, now.steady_ms); }, now);
  feed(Tick{}, now);
  ledger_.tick(now.steady_ms);
  clients_.tick(now);
  send_traces();
  changes_.release_replies(now);
  rates_.sample([this](StudyId id) { return settled_of(id); }, now.steady_ms);
  // One that is gone comes to rest at 0.
  worker_rates_.sample(
      [this](WorkerId id) {
        return scheduler_.knows_worker(id) ? scheduler_.solved_points(id) : 0;
      },
      now.steady_ms);
}

void Service::drain(Instant now) {
  draining_ = true;
  hand_out_or_hold(now);
  workers_.stop();
  clients_.drain();
}

void Service::stop(Instant now) {
  stopping_ = true;
  hand_out_or_hold(now);
  workers_.stop();
  clients_.stop();
  send_traces();
}

double Service::points_per_s(std::int64_t now_ms) const {
  return rates_.points_per_s([this](StudyId id) { return settled_of(id); }, now_ms);
}

bool Service::has_room_for(std::string_view worker) const {
  const auto known = workers_.find(worker);
  return !known || ledger_.has_room_for(*known);
}

// ---- The scheduler ----------------------------------------------------------------------------

void Service::feed(const Event& event, Instant now) {
  handle(event, {now});
  handle_found(now);
}

void Service::handle(const Event& event, Turn turn) {
  for (const Effect& effect : scheduler_.handle(event, turn.now.steady_ms)) {
    std::visit([&](const auto& kind) { perform(kind, turn); }, effect);
  }
  tell_traces(event);
}

/// Results with other inputs than their points have are failures, before a worker counts as one
/// that solves points.
void Service::judge_inputs(ResultsReceived& event, protocol::Results& message) const {
  // Of a study without open points nothing is stored, and no table is made for that.
  if (!states_.contains(event.study) || !scheduler_.knows_study(event.study) ||
      scheduler_.points(event.study).open() == 0) {
    return;
  }
  const StudyTable& table = states_.record(event.study).table;
  for (std::size_t i = 0; i < event.outcomes.size(); ++i) {
    protocol::PointResult& result = *message.mutable_results(static_cast<int>(i));
    const std::string fault = result.point() < table.size()
                                  ? protocol::fault_of_inputs(result, *table.get())
                                  : std::string();
    if (!fault.empty()) {
      result = protocol::failed_point(result.point(), fault);
      event.outcomes[i].failed = true;
    }
  }
}

/// Those who solve traces are the workers.
void Service::tell_traces(const Event& event) {
  if (const auto* joined = std::get_if<WorkerJoined>(&event)) {
    if (const WorkerRecord* worker = workers_.find(joined->worker)) {
      traces_.joined(joined->worker, worker->name, worker->solver_version, worker->instruction_set);
    }
  } else if (const auto* left = std::get_if<WorkerLeft>(&event)) {
    traces_.left(left->worker);
  } else if (const auto* busy = std::get_if<WorkerBusy>(&event)) {
    traces_.set_busy(busy->worker, busy->is_busy);
  }
}

/// What came to light while messages went out to workers.
void Service::handle_found(Instant now) {
  for (auto found = workers_.take_found(); !found.empty(); found = workers_.take_found()) {
    for (const Event& event : found) {
      handle(event, {now});
    }
  }
}

void Service::hand_out_or_hold(Instant now) {
  const bool holds = stopping_ || draining_ || ledger_.holds_batches();
  if (std::exchange(holds_batches_, holds) != holds) {
    feed(DispatchHeld{holds}, now);
  }
}

std::uint64_t Service::settled_of(StudyId id) const {
  return scheduler_.points(id).settled;
}

void Service::perform(const DefineStudy& effect, Turn /*turn*/) {
  workers_.define(effect, states_.record(effect.study).table.recipe_bytes());
}

void Service::perform(const SendBatch& effect, Turn /*turn*/) {
  workers_.send(effect);
}

void Service::perform(const SendProbe& effect, Turn /*turn*/) {
  workers_.send(effect);
}

void Service::perform(const AcknowledgeResults& effect, Turn /*turn*/) {
  workers_.send(effect);
}

void Service::perform(const WithdrawStudy& effect, Turn /*turn*/) {
  workers_.send(effect);
}

void Service::perform(const ReleaseBatch& effect, Turn /*turn*/) {
  workers_.send(effect);
}

void Service::perform(const DropWorker& effect, Turn turn) {
  traces_.left(effect.worker);
  workers_.drop(effect, turn.now);
}

void Service::perform(const StoreResults& effect, Turn turn) {
  const WorkerRecord& worker = *workers_.find(effect.worker);
  protocol::Results& message = *turn.results;
  const std::size_t bytes = message.ByteSizeLong();
  const bool has_rows = !effect.accepted.empty() && states_.contains(effect.study);
  if (has_rows && workers_.needs_row(effect.worker)) {
    // Whoever only comes and goes leaves no row.
    ledger_.write(AddWorker{effect.worker, worker.name, worker.threads, worker.solver_version,
                            worker.instruction_set, worker.joined_at},
                  QuietWrite{});
  }
  AddResults change{
      effect.study,           has_rows ? states_.record(effect.study).table.get() : nullptr,
      effect.worker,          worker.solver_version,
      worker.instruction_set, message.attempt(),
      iso_8601(turn.now),     {},
      effect.left_out};
  ResultsWrite write{{effect.worker, effect.study, effect.sequence, {}, effect.left_out},
                     message.attempt(),
                     bytes};
  for (const std::size_t index : effect.accepted) {
    protocol::PointResult& result = *message.mutable_results(static_cast<int>(index));
    write.event.outcomes.push_back({result.point(), !result.error().empty()});
    change.results.push_back(std::move(result));
  }
  ledger_.write(std::move(change), std::move(write));
}

void Service::perform(const StoreFailure& effect, Turn turn) {
  const StudyRecord& study = states_.record(effect.study);
  outbox_.note(Severity::kWarning, fmt::format("point {} of study {} failed: {}", effect.point,
                                               study.name, effect.reason));
  AddResults change{effect.study,
                    study.table.get(),
                    0,
                    {},
                    {},
                    effect.attempt,
                    iso_8601(turn.now),
                    {protocol::failed_point(effect.point, effect.reason)}};
  ledger_.write(std::move(change),
                ResultsWrite{{0, effect.study, 0, {{effect.point, true}}, {}}, effect.attempt, 0});
}

void Service::perform(const StudyFinished& effect, Turn turn) {
  if (changes_.puts_off_end(effect.study)) {
    return;  // further points of it are on their way to the disk
  }
  if (states_.finish(effect.study)) {
    open_.close(effect.study);
    outbox_.note(Severity::kInfo,
                 fmt::format("study {} is done", states_.record(effect.study).name));
    ledger_.write(SetStudyState{effect.study, StudyState::kDone, iso_8601(turn.now)}, QuietWrite{});
  }
}

// ---- The database -----------------------------------------------------------------------------

void Service::written(const WriteReport& report, Instant now) {
  switch (report.kind) {
    case WriteReport::Kind::kFault:
      outbox_.note(Severity::kError, "results wait, nothing is handed out: " + report.error);
      ledger_.note_fault(report.error);
      break;
    case WriteReport::Kind::kRecovered:
      outbox_.note(Severity::kInfo, "the database takes results again");
      ledger_.note_recovery();
      break;
    case WriteReport::Kind::kGone:
      lose_storage(report.error, now);
      break;
    case WriteReport::Kind::kUnmerged:
      outbox_.note(Severity::kWarning,
                   fmt::format("the write-ahead log, the file beside the database that ends in "
                               "-wal, is not yet merged into it: {}. Until then a copy needs both "
                               "files; `oblique backup` makes one that is whole",
                               report.error));
      break;
    case WriteReport::Kind::kStored:
      if (const auto meaning = ledger_.settle(report.ticket)) {
        std::visit([&](const auto& write) { stored(write, now); }, *meaning);
      }
      break;
    case WriteReport::Kind::kRefused:
      if (const auto meaning = ledger_.settle(report.ticket)) {
        std::visit([&](const auto& write) { refused(write, report.error, now); }, *meaning);
      }
      break;
  }
  hand_out_or_hold(now);
}

/// Nobody is told that something is stored from here on.
void Service::lose_storage(const std::string& error, Instant now) {
  outbox_.note(Severity::kError, error);
  for (const Meaning& meaning : ledger_.abandon(error)) {
    std::visit([&](const auto& write) { refused(write, error, now); }, meaning);
  }
  workers_.notice(error);
  stop(now);
}

void Service::stored(const ResultsWrite& write, Instant now) {
  const StudyId id = write.event.study;
  if (!states_.contains(id)) {
    feed(write.event, now);  // it was deleted meanwhile, and the database dropped these
    return;
  }
  for (const PointOutcome& outcome : write.event.outcomes) {
    if (outcome.failed) {
      states_.point_failed(id, outcome.point, write.attempt);
    }
    ++(outcome.failed ? stored_points_.failed : stored_points_.solved);
  }
  const bool settles = !write.event.outcomes.empty() || !write.event.left_out.empty();
  if (settles) {
    rates_.note(id, settled_of(id), states_.record(id).since_ms, now.steady_ms);
  }
  const WorkerId worker = write.event.worker;
  if (scheduler_.knows_worker(worker) && !worker_rates_.knows(worker)) {
    worker_rates_.note(worker, scheduler_.solved_points(worker), 0, now.steady_ms);
  }
  feed(write.event, now);
  if (!write.event.outcomes.empty()) {
    known_.note_source(id);
  }
  if (settles) {
    open_.set_points(id, scheduler_.study(id).points - settled_of(id));
  }
}

void Service::stored(const StateWrite& write, Instant now) {
  feed(changes_.stored(write, now), now);
  if (write.state == StudyState::kCancelled) {
    known_.stop(write.study);
  }
  changes_.answer(write, now);
}

void Service::stored(const PriorityWrite& write, Instant now) {
  feed(changes_.stored(write, now), now);
  changes_.answer(write, now);
}

void Service::stored(const FailuresWrite& write, Instant now) {
  rates_.forget(write.study);  // fewer points are settled now: no rate can be had of that
  feed(changes_.stored(write, now), now);
  changes_.answer(write, now);
}

void Service::stored(const NameWrite& write, Instant now) {
  changes_.stored(write);
  changes_.answer(write, now);
}

void Service::stored(const RemovalWrite& write, Instant now) {
  rates_.forget(write.study);
  feed(changes_.stored(write, now), now);
  changes_.answer(write, now);
}

void Service::stored(const QuietWrite& /*write*/, Instant /*now*/) {}

/// The writer keeps these until it can write them; when the database is gone, workers keep results.
void Service::refused(const ResultsWrite& /*write*/, const std::string& /*error*/,
                      Instant /*now*/) {}
void Service::refused(const QuietWrite& /*write*/, const std::string& /*error*/, Instant /*now*/) {}

void Service::refused(const StudyWrite& write, const std::string& error, Instant now) {
  changes_.refused(write, error, now);
}

void Service::refused(const StateWrite& write, const std::string& error, Instant /*now*/) {
  changes_.refused(write, error);
}

void Service::refused(const PriorityWrite& write, const std::string& error, Instant now) {
  changes_.refused(write, error, now);
}

void Service::refused(const FailuresWrite& write, const std::string& error, Instant /*now*/) {
  changes_.refused(write, error);
}

void Service::refused(const GrowthWrite& write, const std::string& error, Instant now) {
  changes_.refused(write, error, now);
  if (changes_.takes_end(write.study)) {
    perform(StudyFinished{write.study}, {now});
  }
}

void Service::refused(const NameWrite& write, const std::string& error, Instant now) {
  changes_.refused(write, error, now);
}

void Service::refused(const RemovalWrite& write, const std::string& error, Instant now) {
  changes_.refused(write, error, now);
}

}  // namespace oblique::server
