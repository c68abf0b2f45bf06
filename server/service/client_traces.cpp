// Handles requests for traces: finds the point's inputs and chooses a worker.

#include <algorithm>
#include <cstddef>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "server/service/client_handler.h"
#include "server/study/limits.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {

void ClientHandler::trace(const Client& client, const protocol::TraceRequest& request,
                          Instant now) {
  const auto known = find_study(client, request.study());
  if (!known) {
    return;
  }
  const StudyRecord& study = core_.states.record(*known);
  if (study.failures.contains(request.point()) && !request.only_point()) {
    core_.ports.reply_error(client, fmt::format("point {} of the study \"{}\" failed and has no "
                                                "trace: `oblique retry` solves it again",
                                                request.point(), study.name));
    return;
  }
  if (find(client.identity, client.request_id) != pending_.end()) {
    return;  // the client repeats the request because the answer takes long
  }
  const auto waiting = static_cast<std::size_t>(std::ranges::count_if(
      pending_, [](const auto& entry) { return entry.second.trace.has_value(); }));
  const StudyTable& table = study.table;
  const bool is_made = table.is_made();
  const bool is_quick = is_made || table.recipe_bytes().size() <= limits::kLongestInlineRequest;
  const bool is_full =
      waiting >= limits::kWaitingTraces || (!is_quick && point_checks_ >= limits::kWaitingTraces);
  if (stopping_ || is_full) {
    core_.ports.reply_error(client, stopping_ ? kStopping
                                              : "too many traces are waiting: try again "
                                                "later");
    return;
  }
  const std::uint64_t ticket = ++last_ticket_;
  const auto time_ms = request.time_limit_ms() == 0
                           ? limits::kTraceTime_ms
                           : static_cast<std::int64_t>(std::min<std::uint64_t>(
                                 request.time_limit_ms(), limits::kLongestTraceTime_ms));
  TraceJob& job =
      add(ticket, client, now)
          .trace.emplace(TraceJob{request.only_point(), request.point(), now.steady_ms + time_ms});
  job.reply.set_study_id(*known);
  job.order.set_trace_id(ticket);
  job.order.set_shape(request.shape());
  job.order.set_fall(request.fall());
  job.order.set_every(request.every());
  const std::uint64_t point = request.point();
  if (is_quick) {
    point_found(ticket, find_point(table, is_made, point));
    return;
  }
  ++point_checks_;
  core_.ports.run_check([this, ticket, table, point]() -> Ports::Completion {
    return [this, ticket, found = find_point(table, false, point)](Instant) {
      --point_checks_;
      point_found(ticket, found);
    };
  });
}

/// Returns the reply without the trace, or an error. If `is_table_made` is false, may be called on
/// the check thread.
protocol::ClientReply ClientHandler::find_point(const StudyTable& study, bool is_table_made,
                                                std::uint64_t point) {
  try {
    // If the study has no table, makes a separate one, because this may be the check thread.
    const auto table =
        is_table_made ? study.get() : StudyTable(study.recipe_bytes(), study.size()).get();
    protocol::ClientReply reply;
    *reply.mutable_trace() = protocol::point_reply(*table, point);
    return reply;
  } catch (const std::exception& error) {
    return error_reply(error.what());
  }
}

void ClientHandler::point_found(std::uint64_t ticket, protocol::ClientReply found) {
  const auto request = pending_.find(ticket);
  if (request == pending_.end()) {
    return;  // the client has disconnected
  }
  TraceJob& job = *request->second.trace;
  if (found.has_error()) {
    refuse(request, found.error().message());
    return;
  }
  const StudyId study = job.reply.study_id();
  job.reply.MergeFrom(found.trace());
  protocol::QueryRequest row;
  row.set_sql(
      fmt::format("SELECT * FROM runs WHERE study_id = {} AND point = {}", study, job.point));
  const bool has_rows = core_.states.contains(study) && core_.scheduler.study(study).completed > 0;
  if (!has_rows || !core_.ports.query({ticket, request->second.client.share(), row})) {
    inputs_found(request);
  }
}

void ClientHandler::inputs_found(PendingRequests::iterator request) {
  TraceJob& job = *request->second.trace;
  if (job.only_point) {
    protocol::ClientReply reply;
    *reply.mutable_trace() = std::move(job.reply);
    core_.ports.reply(request->second.client, std::move(reply));
    pending_.erase(request);
  } else if (core_.workers.all().empty()) {
    refuse(request,
           "no worker is connected: start an `oblique-worker`, or solve the trace here "
           "with `oblique trace --local`");
  } else {
    *job.order.mutable_model() = job.reply.model();
    job.order.set_h_m(job.reply.h_m());
    job.order.set_mu(job.reply.mu());
    job.order.set_e_star(job.reply.e_star());
    job.order.set_errors(job.reply.errors());
    job.is_ready = true;
    dispatch_traces();
  }
}

void ClientHandler::worker_left(WorkerId worker) {
  const auto order = orders_.extract(worker);
  const auto request = order.empty() ? pending_.end() : pending_.find(order.mapped());
  if (request == pending_.end()) {
    return;
  }
  TraceJob& job = *request->second.trace;
  job.worker.reset();
  if (std::exchange(job.has_lost_worker, true)) {
    refuse(request,
           "two workers were lost while they solved this point, so it is not sent to a third");
  }
  dispatch_traces();
}

void ClientHandler::trace_received(WorkerId worker, protocol::Trace trace) {
  const WorkerRecord* const record = core_.workers.find(worker);
  const auto order = orders_.find(worker);
  if (record == nullptr || order == orders_.end() || order->second != trace.trace_id()) {
    return;  // the trace belongs to an earlier session
  }
  orders_.erase(order);
  if (const auto request = pending_.find(trace.trace_id()); request != pending_.end()) {
    TraceJob& job = *request->second.trace;
    job.worker.reset();
    if (trace.declined()) {
      job.declined_by.insert(worker);
    } else {
      core_.ports.reply(request->second.client, trace_reply(job, *record, std::move(trace)));
      pending_.erase(request);
    }
  }
  dispatch_traces();
}

protocol::ClientReply ClientHandler::trace_reply(TraceJob& job, const WorkerRecord& worker,
                                                 protocol::Trace trace) const {
  if (!trace.result().error().empty()) {
    protocol::PointResult result = protocol::failed_point(0, trace.result().error());
    trace.Clear();
    *trace.mutable_result() = std::move(result);
  }
  const auto shape =
      solver::trace_shape(static_cast<std::size_t>(job.order.model().lengths_m_size()),
                          job.order.model().elements_per_link(), job.order.shape());
  const std::string fault = protocol::fault_of_trace(trace, shape, job.order.fall());
  if (!fault.empty()) {
    return error_reply(fmt::format("worker {} sent an invalid trace: {}", worker.row.name, fault));
  }
  protocol::ClientReply message;
  protocol::TraceReply& fields = *message.mutable_trace();
  fields = std::move(job.reply);
  *fields.mutable_trace() = std::move(trace);
  fields.set_outputs(protocol::sent_outputs());
  fields.set_worker(worker.row.name);
  fields.set_solver_version(core_.solver_version);
  fields.set_instruction_set(worker.row.instruction_set);
  return message;
}

void ClientHandler::dispatch_traces() {
  auto running = std::ranges::count_if(
      pending_, [](const auto& entry) { return entry.second.trace && entry.second.trace->worker; });
  for (auto entry = pending_.begin(); entry != pending_.end();) {
    const auto request = entry++;
    std::optional<TraceJob>& job = request->second.trace;
    if (!job || !job->is_ready || job->worker) {
      continue;
    }
    const std::optional<WorkerId> free = free_worker(*job);
    if (!free) {
      refuse(request, "no connected worker can solve it");
    } else if (*free != 0 && running < static_cast<std::ptrdiff_t>(limits::kRunningTraces)) {
      job->worker = free;
      orders_[*free] = request->first;
      ++running;
      protocol::ServerToWorker message;
      *message.mutable_trace_order() = job->order;
      core_.workers.send(*free, message);
    }
  }
}

/// Returns a free worker; 0 if all are busy; nothing if no connected worker accepts the job.
std::optional<WorkerId> ClientHandler::free_worker(const TraceJob& job) const {
  std::optional<WorkerId> free;
  for (const auto& [id, worker] : core_.workers.all()) {
    if (!job.declined_by.contains(id)) {
      free = 0;
      if (!orders_.contains(id) && !worker.is_busy) {
        return id;
      }
    }
  }
  return free;
}

}  // namespace oblique::server
