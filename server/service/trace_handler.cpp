#include "server/service/trace_handler.h"

#include <algorithm>
#include <exception>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "server/study/limits.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {

// ---- Clients ----------------------------------------------------------------------------------

void TraceHandler::request(const Client& client, const protocol::TraceRequest& request,
                           StudyId study, const StudyTable& table, Instant now) {
  if (std::ranges::any_of(jobs_,
                          [&](const auto& entry) { return entry.second.client == client; })) {
    return;  // the client sent it again
  }
  const auto of_connection = std::ranges::count_if(
      jobs_, [&](const auto& entry) { return entry.second.client.identity == client.identity; });
  const bool is_full =
      jobs_.size() >= limits::kWaitingTraces ||
      static_cast<std::size_t>(of_connection) >= limits::kWaitingTracesOfConnection;
  if (is_stopping_ || is_full) {
    ports_.reply_error(client, is_stopping_ ? kStopping
                                            : "too many traces are waited for already: ask again "
                                              "later");
    return;
  }
  const auto time_ms = request.time_limit_ms() == 0
                           ? limits::kTraceTime_ms
                           : static_cast<std::int64_t>(std::min<std::uint64_t>(
                                 request.time_limit_ms(), limits::kLongestTraceTime_ms));
  const std::uint64_t number = ++last_number_;
  Job job{client,
          request.only_point(),
          now.steady_ms + time_ms,
          now.steady_ms + still_working_every_ms_,
          {}};
  job.reply.set_study_id(study);
  job.order.set_trace_id(number);
  job.order.set_shape(request.shape());
  job.order.set_fall(request.fall());
  job.order.set_every(request.every());
  jobs_.emplace(number, std::move(job));
  const std::uint64_t point = request.point();
  if (table.is_made()) {
    point_found(number, find_point(*table.get(), point));
  } else if (table.recipe_bytes().size() <= limits::kLongestInlineRequest) {
    point_found(number, find_point(table.recipe_bytes(), point));
  } else {
    ports_.run_check([this, number, table, point] {
      FoundPoint found = find_point(table.recipe_bytes(), point);
      return [this, number, found = std::move(found)](Instant) { point_found(number, found); };
    });
  }
}

TraceHandler::FoundPoint TraceHandler::find_point(const protocol::PointTable& table,
                                                  std::uint64_t point) {
  if (point >= table.size()) {
    return {
        {},
        fmt::format("the study has no point {}: its points are 0 to {}", point, table.size() - 1)};
  }
  if (!table.is_left_in(point)) {
    return {{}, fmt::format("point {} is left out by the study's filter", point)};
  }
  FoundPoint found{{}, table.fault(point)};
  if (found.objection.empty()) {
    const protocol::Point values = table.point(point);
    *found.reply.mutable_model() = protocol::to_message(table.model(values.model));
    found.reply.set_h_m(values.H_m);
    found.reply.set_mu(values.mu);
    found.reply.set_e_star(values.e_star);
    found.reply.set_errors(table.wants_errors());
  }
  return found;
}

TraceHandler::FoundPoint TraceHandler::find_point(const std::string& recipe_bytes,
                                                  std::uint64_t point) {
  protocol::Recipe recipe;
  if (!recipe.ParseFromString(recipe_bytes)) {
    return {{}, "the bytes of its study are damaged"};
  }
  try {
    return find_point(protocol::PointTable(std::move(recipe)), point);
  } catch (const std::exception& error) {
    return {{}, error.what()};
  }
}

void TraceHandler::point_found(std::uint64_t number, const FoundPoint& point) {
  const auto found = jobs_.find(number);
  if (found == jobs_.end()) {
    return;  // the client is gone
  }
  Job& job = found->second;
  job.reply.MergeFrom(point.reply);
  if (!point.objection.empty()) {
    refuse(found, "the point cannot be had: " + point.objection);
  } else if (job.only_point) {
    protocol::ClientReply message;
    *message.mutable_trace() = job.reply;
    ports_.reply(job.client, std::move(message));
    remove(found);
  } else if (!workers_.next_after(0)) {
    refuse(found,
           "no worker is connected to solve it: start an `oblique-worker`, or solve it without one "
           "by `oblique trace --local`");
  } else {
    *job.order.mutable_model() = job.reply.model();
    job.order.set_h_m(job.reply.h_m());
    job.order.set_mu(job.reply.mu());
    job.order.set_e_star(job.reply.e_star());
    job.order.set_errors(job.reply.errors());
    job.is_ready = true;
    dispatch();
  }
}

void TraceHandler::refuse(Jobs::iterator job, const std::string& reason) {
  ports_.reply_error(job->second.client, reason);
  remove(job);
}

/// Its worker need not continue. The worker is free for another order once it has answered.
void TraceHandler::remove(Jobs::iterator job) {
  if (job->second.worker) {
    protocol::ServerToWorker message;
    message.mutable_trace_cancel()->set_trace_id(job->first);
    workers_.send(*job->second.worker, message);
  }
  jobs_.erase(job);
}

void TraceHandler::remove_jobs(const std::function<bool(const Client&)>& is_meant) {
  for (auto next = jobs_.begin(); next != jobs_.end();) {
    const auto job = next++;
    if (is_meant(job->second.client)) {
      remove(job);
    }
  }
  dispatch();
}

void TraceHandler::end(std::string_view identity, std::uint64_t request_id) {
  remove_jobs([&](const Client& client) {
    return client.request_id == request_id && client.identity == identity;
  });
}

void TraceHandler::client_left(std::string_view identity) {
  remove_jobs([&](const Client& client) { return client.identity == identity; });
}

void TraceHandler::tick(Instant now) {
  for (auto next = jobs_.begin(); next != jobs_.end();) {
    const auto job = next++;
    const bool has_worker = job->second.worker.has_value();
    if (now.steady_ms >= job->second.deadline_ms) {
      refuse(job, has_worker ? "the trace took too long: the worker that solves it is not done. "
                               "`oblique trace --timeout SECONDS` gives it more time"
                             : "no worker was free to solve the trace in the time it had: `oblique "
                               "trace --timeout SECONDS` gives it more");
    } else if (now.steady_ms >= job->second.next_notice_ms) {
      job->second.next_notice_ms = now.steady_ms + still_working_every_ms_;
      if (!ports_.reply_still_working(job->second.client, has_worker)) {
        remove(job);
      }
    }
  }
  dispatch();
}

void TraceHandler::stop() {
  is_stopping_ = true;
  while (!jobs_.empty()) {
    refuse(jobs_.begin(), kStopping);
  }
}

// ---- Workers ----------------------------------------------------------------------------------

void TraceHandler::worker_left(WorkerId worker) {
  const auto order = orders_.extract(worker);
  const auto job = order.empty() ? jobs_.end() : jobs_.find(order.mapped());
  if (job == jobs_.end()) {
    return;
  }
  job->second.worker.reset();
  if (std::exchange(job->second.has_lost_worker, true)) {
    refuse(job, "two workers were lost while they solved this point, so no other worker gets it");
  }
  dispatch();
}

void TraceHandler::trace_received(WorkerId worker, protocol::Trace trace) {
  const WorkerRecord* const record = workers_.find(worker);
  const auto order = orders_.find(worker);
  if (record == nullptr || order == orders_.end() || order->second != trace.trace_id()) {
    return;  // of an earlier session
  }
  orders_.erase(order);
  // A cancelled one has no job.
  if (const auto job = jobs_.find(trace.trace_id()); job != jobs_.end()) {
    job->second.worker.reset();
    if (trace.not_taken()) {
      job->second.not_taken_by.insert(worker);
    } else {
      answer(job->second, *record, std::move(trace));
      jobs_.erase(job);
    }
  }
  dispatch();
}

void TraceHandler::answer(const Job& job, const WorkerRecord& worker, protocol::Trace trace) {
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
    ports_.reply_error(job.client, fmt::format("worker {} sent no trace: {}", worker.name, fault));
    return;
  }
  protocol::ClientReply message;
  protocol::TraceReply& fields = *message.mutable_trace();
  fields = job.reply;
  *fields.mutable_trace() = std::move(trace);
  fields.set_outputs(protocol::sent_outputs());
  fields.set_worker(worker.name);
  fields.set_solver_version(solver_version_);
  fields.set_instruction_set(worker.instruction_set);
  ports_.reply(job.client, std::move(message));
}

/// Sends waiting jobs to free workers, in turn.
void TraceHandler::dispatch() {
  auto running = static_cast<std::size_t>(std::ranges::count_if(
      jobs_, [](const auto& entry) { return entry.second.worker.has_value(); }));
  for (auto next = jobs_.begin(); next != jobs_.end();) {
    const auto current = next++;
    Job& job = current->second;
    if (!job.is_ready || job.worker) {
      continue;
    }
    bool has_any = false;
    std::optional<WorkerId> free;
    for (auto id = workers_.next_after(0); id; id = workers_.next_after(*id)) {
      if (!job.not_taken_by.contains(*id)) {
        has_any = true;
        const bool is_free = !orders_.contains(*id) && !workers_.find(*id)->is_busy;
        free = is_free && (!free || (*free <= last_worker_ && *id > last_worker_)) ? id : free;
      }
    }
    if (!has_any) {
      refuse(current, "no worker is connected any more that could solve it");
    } else if (free && running < limits::kRunningTraces) {
      job.worker = free;
      last_worker_ = *free;
      orders_[*free] = current->first;
      ++running;
      protocol::ServerToWorker message;
      *message.mutable_trace_order() = job.order;
      workers_.send(*free, message);
    }
  }
}

}  // namespace oblique::server
