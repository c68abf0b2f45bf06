#include "server/service/traces/trace_handler.h"

#include <algorithm>
#include <exception>

#include <spdlog/fmt/fmt.h>

#include "proto/result_message.h"
#include "server/study/limits.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::server {
namespace {

constexpr int kMostLosses = 2;
constexpr std::size_t kMostDeadly = 256;

constexpr const char* kStopping = "the server is stopping: ask again when it runs";
constexpr const char* kDeadly =
    "two workers were lost while they solved this point, so no other worker gets it until the "
    "server starts again";

solver::TraceShape shape_of(const protocol::TraceOrder& order) {
  return solver::trace_shape(static_cast<std::size_t>(order.model().lengths_m_size()),
                             order.model().elements_per_link(), order.shape());
}

TracedPoint point_of(const StudyTable& table, std::uint64_t point) {
  const bool was_made = table.is_made();
  TracedPoint found;
  try {
    found = traced_point(*table.get(), point);
  } catch (const std::exception& error) {
    found.objection = error.what();
  }
  if (!was_made) {
    table.release();
  }
  return found;
}

}  // namespace

// ---- Clients ----------------------------------------------------------------------------------

/// Why a request of the client cannot wait, or an empty text.
std::string TraceHandler::objection_to(const Client& client) const {
  std::size_t waiting = 0;
  std::size_t of_connection = 0;
  for (const auto& [number, job] : jobs_) {
    waiting += job.clients.size();
    of_connection += static_cast<std::size_t>(
        std::count_if(job.clients.begin(), job.clients.end(),
                      [&](const Client& each) { return each.identity == client.identity; }));
  }
  const bool is_full =
      waiting >= limits::kWaitingTraces || of_connection >= limits::kWaitingTracesOfConnection;
  return is_stopping_ ? kStopping
         : is_full    ? "too many traces are waited for already: ask again later"
                      : "";
}

/// A job that gives the same trace.
TraceHandler::Jobs::iterator TraceHandler::find_same(const Job& job) {
  return std::find_if(jobs_.begin(), jobs_.end(), [&](const auto& entry) {
    const Job& other = entry.second;
    return other.point == job.point && other.order.shape() == job.order.shape() &&
           other.order.fall() == job.order.fall() && other.order.every() == job.order.every() &&
           other.only_point == job.only_point;
  });
}

void TraceHandler::request(const Client& client, const protocol::TraceRequest& request,
                           StudyId study, const StudyTable& table, Instant now) {
  if (std::any_of(jobs_.begin(), jobs_.end(), [&](const auto& entry) {
        const auto& clients = entry.second.clients;
        return std::find(clients.begin(), clients.end(), client) != clients.end();
      })) {
    return;  // the client sent it again
  }
  if (const std::string objection = objection_to(client); !objection.empty()) {
    ports_.reply_error(client, objection);
    return;
  }
  const auto time_ms = request.time_limit_ms() == 0
                           ? limits::kTraceTime_ms
                           : static_cast<std::int64_t>(std::min<std::uint64_t>(
                                 request.time_limit_ms(), limits::kLongestTraceTime_ms));
  Job job{.clients = {client},
          .point = {study, request.point()},
          .only_point = request.only_point(),
          .deadline_ms = now.steady_ms + time_ms,
          .next_notice_ms = now.steady_ms + still_working_every_ms_,
          .order = {},
          .worker = std::nullopt};
  job.order.set_shape(request.shape());
  job.order.set_fall(request.fall());
  job.order.set_every(request.every());
  if (const auto same = find_same(job); same != jobs_.end()) {
    same->second.clients.push_back(client);
    same->second.deadline_ms = std::max(same->second.deadline_ms, job.deadline_ms);
    return;
  }
  const std::uint64_t number = ++last_number_;
  job.order.set_trace_id(number);
  jobs_.emplace(number, std::move(job));
  if (!table.is_made() && table.recipe_bytes().size() > limits::kLongestInlineRequest) {
    ports_.run_check([this, number, table, point = request.point()] {
      TracedPoint found = traced_point(table.recipe_bytes(), point);
      return [this, number, found = std::move(found)](Instant) { point_found(number, found); };
    });
  } else {
    point_found(number, point_of(table, request.point()));
  }
}

void TraceHandler::point_found(std::uint64_t number, const TracedPoint& point) {
  const auto found = jobs_.find(number);
  if (found == jobs_.end()) {
    return;  // the clients have gone
  }
  Job& job = found->second;
  if (!point.objection.empty()) {
    refuse(found, "the point cannot be had: " + point.objection);
    return;
  }
  job.reply = said_of(point);
  job.reply.set_study_id(job.point.first);
  if (job.only_point) {
    protocol::ClientReply message;
    *message.mutable_trace() = std::move(job.reply);
    reply(job, std::move(message));
    remove(found);
  } else if (deadly_.contains(job.point)) {
    refuse(found, kDeadly);
  } else if (solvers_.empty()) {
    refuse(found,
           "no worker is connected to solve it: start an `oblique-worker`, or solve it without one "
           "by `oblique trace --local`");
  } else {
    *job.order.mutable_model() = point.model;
    job.order.set_h_m(point.H_m);
    job.order.set_mu(point.mu);
    job.order.set_e_star(point.e_star);
    job.order.set_errors(point.errors);
    job.is_ready = true;
    dispatch();
  }
}

void TraceHandler::answer(Job& job, const Solver& solver, protocol::Trace trace) {
  const bool failed = !trace.result().error().empty();
  if (failed) {
    protocol::PointResult result = protocol::failed_point(0, trace.result().error());
    trace.Clear();
    *trace.mutable_result() = std::move(result);
  }
  protocol::ClientReply message;
  const std::string fault = protocol::fault_of_trace(trace, shape_of(job.order), job.order.fall());
  if (!fault.empty()) {
    message.mutable_error()->set_message(
        fmt::format("worker {} sent no trace: {}", solver.name, fault));
  } else {
    protocol::TraceReply& fields = *message.mutable_trace();
    fields = std::move(job.reply);
    *fields.mutable_trace() = std::move(trace);
    fields.set_outputs(protocol::sent_outputs());
    fields.set_worker(solver.name);
    fields.set_solver_version(solver_version_);
    fields.set_instruction_set(solver.instruction_set);
  }
  reply(job, std::move(message));
}

void TraceHandler::reply(const Job& job, protocol::ClientReply reply) {
  for (const Client& client : job.clients) {
    ports_.reply(client, reply);
  }
}

void TraceHandler::refuse(Jobs::iterator job, const std::string& reason) {
  protocol::ClientReply message;
  message.mutable_error()->set_message(reason);
  reply(job->second, std::move(message));
  remove(job);
}

/// Its worker need not continue. The worker is free for another order once it has answered.
TraceHandler::Jobs::iterator TraceHandler::remove(Jobs::iterator job) {
  if (job->second.worker) {
    protocol::ServerToWorker message;
    message.mutable_trace_cancel()->set_trace_id(job->first);
    messages_.emplace_back(*job->second.worker, std::move(message));
  }
  return jobs_.erase(job);
}

void TraceHandler::remove_clients(const std::function<bool(const Client&)>& is_meant) {
  for (auto job = jobs_.begin(); job != jobs_.end();) {
    std::erase_if(job->second.clients, is_meant);
    if (job->second.clients.empty()) {
      job = remove(job);
    } else {
      ++job;
    }
  }
  dispatch();
}

void TraceHandler::end(std::string_view identity, std::uint64_t request_id) {
  remove_clients([&](const Client& client) {
    return client.request_id == request_id && client.identity == identity;
  });
}

void TraceHandler::client_left(std::string_view identity) {
  remove_clients([&](const Client& client) { return client.identity == identity; });
}

void TraceHandler::tick(Instant now) {
  for (auto job = jobs_.begin(); job != jobs_.end();) {
    const auto current = job++;
    Job& waiting = current->second;
    if (now.steady_ms >= waiting.deadline_ms) {
      refuse(current, waiting.worker
                          ? "the trace took too long: the worker that solves it is not done. "
                            "`oblique trace --timeout SECONDS` gives it more time"
                          : "no worker was free to solve the trace in the time it had: `oblique "
                            "trace --timeout SECONDS` gives it more");
    } else if (now.steady_ms >= waiting.next_notice_ms) {
      waiting.next_notice_ms = now.steady_ms + still_working_every_ms_;
      std::erase_if(waiting.clients, [&](const Client& client) {
        return !ports_.reply_still_working(client, waiting.worker.has_value());
      });
    }
  }
  remove_clients([](const Client&) { return false; });
}

void TraceHandler::stop() {
  is_stopping_ = true;
  while (!jobs_.empty()) {
    refuse(jobs_.begin(), kStopping);
  }
}

// ---- Workers ----------------------------------------------------------------------------------

void TraceHandler::joined(WorkerId worker, const std::string& name,
                          const std::string& instruction_set) {
  solvers_[worker] = {name, instruction_set};
  dispatch();
}

void TraceHandler::left(WorkerId worker) {
  if (solvers_.erase(worker) == 0) {
    return;
  }
  const auto held = std::find_if(jobs_.begin(), jobs_.end(),
                                 [&](const auto& entry) { return entry.second.worker == worker; });
  if (held != jobs_.end()) {
    Job& job = held->second;
    job.worker.reset();
    if (++job.losses == kMostLosses) {
      if (deadly_.size() < kMostDeadly) {
        deadly_.insert(job.point);
      }
      refuse(held, kDeadly);
    }
  }
  dispatch();
}

void TraceHandler::set_busy(WorkerId worker, bool is_busy) {
  if (const auto known = solvers_.find(worker); known != solvers_.end()) {
    known->second.is_busy = is_busy;
    dispatch();
  }
}

void TraceHandler::trace_received(WorkerId worker, protocol::Trace trace) {
  const auto known = solvers_.find(worker);
  if (known == solvers_.end() || trace.trace_id() == 0 || known->second.order != trace.trace_id()) {
    return;  // of an earlier session
  }
  known->second.order = 0;
  // A cancelled one has no job.
  if (const auto job = jobs_.find(trace.trace_id()); job != jobs_.end()) {
    job->second.worker.reset();
    if (trace.not_taken()) {
      job->second.not_taken_by.insert(worker);
    } else {
      answer(job->second, known->second, std::move(trace));
      jobs_.erase(job);
    }
  }
  dispatch();
}

TraceHandler::Choice TraceHandler::choose_solver(const Job& job) const {
  Choice choice;
  std::uint64_t oldest_order = UINT64_MAX;
  for (const auto& [id, solver] : solvers_) {
    if (job.not_taken_by.contains(id)) {
      continue;
    }
    choice.has_any = true;
    if (solver.order == 0 && !solver.is_busy && solver.last_order < oldest_order) {
      oldest_order = solver.last_order;
      choice.free = id;
    }
  }
  return choice;
}

void TraceHandler::dispatch() {
  auto running = static_cast<std::size_t>(std::count_if(
      jobs_.begin(), jobs_.end(), [](const auto& entry) { return entry.second.worker; }));
  for (auto next = jobs_.begin(); next != jobs_.end();) {
    const auto current = next++;
    Job& job = current->second;
    if (!job.is_ready || job.worker) {
      continue;
    }
    const Choice choice = choose_solver(job);
    if (!choice.has_any) {
      refuse(current, "no worker is connected any more that could solve it");
    } else if (choice.free && running < limits::kRunningTraces) {
      Solver& solver = solvers_.at(*choice.free);
      solver.order = solver.last_order = current->first;
      job.worker = choice.free;
      ++running;
      protocol::ServerToWorker message;
      *message.mutable_trace_order() = job.order;
      messages_.emplace_back(*choice.free, std::move(message));
    }
  }
}

}  // namespace oblique::server
