#include "server/service/traces/trace_orders.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <spdlog/fmt/fmt.h>

namespace oblique::server {
namespace {

/// After so many workers were lost with it a point is left alone.
constexpr int kMostLosses = 2;
constexpr std::size_t kDeadlyRemembered = 256;

constexpr const char* kDeadly =
    "two workers were lost while they solved this point, so no other one is given it";

}  // namespace

// ---- Who asks ---------------------------------------------------------------------------------

std::string TraceOrders::objection_to(const TraceQuestion& question) const {
  if (!stopping_.empty()) {
    return stopping_;
  }
  if (std::find(deadly_.begin(), deadly_.end(), question.key) != deadly_.end()) {
    return kDeadly;
  }
  if (solvers_.empty()) {
    return "no worker is connected to solve it: start an `oblique-worker`, or solve it without one "
           "by `oblique trace --here`";
  }
  return {};
}

TraceOrders::Waiter TraceOrders::waiter_of(const TraceQuestion& question,
                                           std::int64_t now_ms) const {
  const std::int64_t time_ms = question.time_limit_ms <= 0
                                   ? limits_.time_ms
                                   : std::min(question.time_limit_ms, limits_.longest_time_ms);
  return {question.ticket, question.first_row, now_ms + time_ms};
}

bool TraceOrders::answer(const TraceQuestion& question, std::int64_t now_ms) {
  if (const SolvedTrace* trace = kept_.find(question.key)) {
    effects_.emplace_back(AnswerTrace{question.ticket, trace->reply(question.first_row)});
    return true;
  }
  if (const std::string reason = objection_to(question); !reason.empty()) {
    effects_.emplace_back(RefuseTrace{question.ticket, reason});
    return true;
  }
  const auto job = jobs_.find(question.key);
  if (job == jobs_.end()) {
    return false;
  }
  job->second.waiters.push_back(waiter_of(question, now_ms));
  tickets_.emplace(question.ticket, question.key);
  return true;
}

void TraceOrders::order(const TraceQuestion& question, const TracedPoint& point,
                        const std::string& version, std::int64_t now_ms) {
  if (answer(question, now_ms)) {
    return;
  }
  protocol::TraceOrder order;
  *order.mutable_model() = point.model;
  order.set_h_m(point.H_m);
  order.set_mu(point.mu);
  order.set_e_star(point.e_star);
  order.set_errors(point.errors);
  order.set_shape(question.key.shape);
  order.set_fall(question.key.fall);
  order.set_most_bytes(limits_.most_bytes);
  jobs_.emplace(question.key, Job{std::move(order),
                                  version,
                                  SolvedTrace(question.key, point, limits_.most_bytes),
                                  {waiter_of(question, now_ms)},
                                  std::nullopt,
                                  {},
                                  0});
  tickets_.emplace(question.ticket, question.key);
  queue_.push_back(question.key);
  dispatch();
}

void TraceOrders::leave(std::uint64_t ticket) {
  const auto known = tickets_.find(ticket);
  if (known == tickets_.end()) {
    return;
  }
  const auto job = jobs_.find(known->second);
  auto& waiters = job->second.waiters;
  const auto waiter = std::find_if(waiters.begin(), waiters.end(),
                                   [&](const Waiter& each) { return each.ticket == ticket; });
  tickets_.erase(known);
  waiters.erase(waiter);
  if (waiters.empty()) {
    take_from(job->second);
    forget(job);
    dispatch();
  }
}

bool TraceOrders::is_at_work(std::uint64_t ticket) const {
  const auto known = tickets_.find(ticket);
  return known != tickets_.end() && jobs_.at(known->second).worker.has_value();
}

// ---- Who solves -------------------------------------------------------------------------------

void TraceOrders::joined(WorkerId worker, const std::string& name, const std::string& version,
                         const std::string& instruction_set) {
  solvers_[worker] = {name, version, instruction_set};
  dispatch();
}

void TraceOrders::left(WorkerId worker) {
  if (solvers_.erase(worker) == 0) {
    return;
  }
  const auto held = std::find_if(jobs_.begin(), jobs_.end(),
                                 [&](const auto& entry) { return entry.second.worker == worker; });
  if (held != jobs_.end()) {
    Job& job = held->second;
    job.worker.reset();
    --at_work_;
    job.trace.start_over();
    if (++job.losses < kMostLosses) {
      queue_.push_front(held->first);
    } else {
      deadly_.push_back(held->first);
      if (deadly_.size() > kDeadlyRemembered) {
        deadly_.pop_front();
      }
      fail(held, kDeadly);
    }
  }
  dispatch();
}

void TraceOrders::set_busy(WorkerId worker, bool is_busy) {
  if (const auto known = solvers_.find(worker); known != solvers_.end()) {
    known->second.is_busy = is_busy;
    dispatch();
  }
}

/// The lower, the better.
int TraceOrders::rank(const Solver& solver, const Job& job) const {
  constexpr int kOfStudy = 0;
  constexpr int kOfServer = 1;
  constexpr int kOther = 2;
  return solver.version == job.version       ? kOfStudy
         : solver.version == server_version_ ? kOfServer
                                             : kOther;
}

std::optional<WorkerId> TraceOrders::solver_for(const Job& job, bool& has_any) {
  int best_rank = std::numeric_limits<int>::max();
  for (const auto& [id, solver] : solvers_) {
    if (!job.not_taken_by.contains(id)) {
      best_rank = std::min(best_rank, rank(solver, job));
    }
  }
  has_any = best_rank != std::numeric_limits<int>::max();
  const Solver* best = nullptr;
  std::optional<WorkerId> found;
  for (const auto& [id, solver] : solvers_) {
    const bool is_free = solver.order == 0 && !solver.is_busy && !job.not_taken_by.contains(id);
    if (is_free && rank(solver, job) == best_rank &&
        (best == nullptr || solver.last_order < best->last_order)) {
      best = &solver;
      found = id;
    }
  }
  return found;
}

void TraceOrders::hand_to(WorkerId worker, Job& job) {
  job.order.set_trace_id(++last_trace_id_);
  job.worker = worker;
  ++at_work_;
  Solver& solver = solvers_.at(worker);
  solver.order = solver.last_order = last_trace_id_;
  effects_.emplace_back(SendOrder{worker, job.order});
}

void TraceOrders::dispatch() {
  for (std::size_t i = 0; i < queue_.size() && at_work_ < limits_.most_at_work;) {
    const auto job = jobs_.find(queue_[i]);
    bool has_any = false;
    const auto worker = solver_for(job->second, has_any);
    if (!worker && has_any) {
      ++i;
      continue;
    }
    queue_.erase(queue_.begin() + static_cast<std::ptrdiff_t>(i));
    if (worker) {
      hand_to(*worker, job->second);
    } else {
      fail(job, "no worker is connected any more that could solve it");
    }
  }
}

void TraceOrders::part(WorkerId worker, const protocol::TracePart& part) {
  const auto known = solvers_.find(worker);
  if (known == solvers_.end() || part.trace_id() == 0 || known->second.order != part.trace_id()) {
    return;  // of a session or an order that is over
  }
  Solver& solver = known->second;
  if (part.last()) {
    solver.order = 0;
  }
  const auto held = std::find_if(jobs_.begin(), jobs_.end(),
                                 [&](const auto& entry) { return entry.second.worker == worker; });
  if (held != jobs_.end()) {
    Job& job = held->second;
    std::string fault = job.trace.add(part.rows());
    if (part.last()) {
      job.worker.reset();
      --at_work_;
    }
    if (part.last() && part.not_taken()) {
      job.not_taken_by.insert(worker);
      job.trace.start_over();
      queue_.push_front(held->first);
    } else if (part.last()) {
      fault = fault.empty()
                  ? job.trace.finish(part, solver.name, solver.version, solver.instruction_set)
                  : fault;
    }
    if (!fault.empty()) {
      take_from(job);
      fail(held, fmt::format("worker {} sent no trace: {}", solver.name, fault));
    } else if (part.last() && !part.not_taken()) {
      finish(held);
    }
  }
  dispatch();
}

// ---- How it ends ------------------------------------------------------------------------------

void TraceOrders::finish(Jobs::iterator job) {
  for (const Waiter& waiter : job->second.waiters) {
    effects_.emplace_back(AnswerTrace{waiter.ticket, job->second.trace.reply(waiter.first_row)});
  }
  if (!job->second.trace.has_failed()) {
    kept_.keep(job->first, std::move(job->second.trace));
  }
  forget(job);
}

void TraceOrders::fail(Jobs::iterator job, const std::string& reason) {
  for (const Waiter& waiter : job->second.waiters) {
    effects_.emplace_back(RefuseTrace{waiter.ticket, reason});
  }
  forget(job);
}

/// Its worker need not go on. It is free for another one once it has said so.
void TraceOrders::take_from(Job& job) {
  if (job.worker) {
    effects_.emplace_back(CancelOrder{*job.worker, job.order.trace_id()});
    job.worker.reset();
    --at_work_;
  }
}

void TraceOrders::forget(Jobs::iterator job) {
  for (const Waiter& waiter : job->second.waiters) {
    tickets_.erase(waiter.ticket);
  }
  std::erase(queue_, job->first);
  jobs_.erase(job);
}

void TraceOrders::tick(std::int64_t now_ms) {
  std::vector<std::uint64_t> late;
  for (const auto& [key, job] : jobs_) {
    for (const Waiter& waiter : job.waiters) {
      if (now_ms >= waiter.deadline_ms) {
        late.push_back(waiter.ticket);
        effects_.emplace_back(RefuseTrace{
            waiter.ticket, job.worker ? "the trace took too long: the worker that solves it is not "
                                        "done. `oblique trace --timeout SECONDS` gives it more time"
                                      : "no worker was free to solve the trace in the time it had: "
                                        "`oblique trace --timeout SECONDS` gives it more"});
      }
    }
  }
  for (const std::uint64_t ticket : late) {
    leave(ticket);
  }
}

void TraceOrders::stop(const std::string& reason) {
  stopping_ = reason;
  while (!jobs_.empty()) {
    take_from(jobs_.begin()->second);
    fail(jobs_.begin(), reason);
  }
}

}  // namespace oblique::server
