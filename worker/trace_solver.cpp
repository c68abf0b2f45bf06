#include "worker/trace_solver.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "proto/recipe/model_message.h"
#include "worker/solver/estimate.h"
#include "worker/solver/model/trace_columns.h"
#include "worker/solver/solve.h"

namespace oblique::worker {
namespace {

protocol::Trace declined(std::uint64_t trace_id) {
  protocol::Trace trace;
  trace.set_trace_id(trace_id);
  trace.set_declined(true);
  return trace;
}

}  // namespace

TraceRows::TraceRows(std::uint64_t every, std::size_t most_bytes)
    : every_(std::max<std::uint64_t>(every, 1)),
      chooses_every_(every == 0),
      most_bytes_(most_bytes) {}

std::size_t TraceRows::most_rows() const {
  return most_bytes_ / row_bytes_;
}

void TraceRows::add(const solver::TraceRow& row) {
  if (!rows_.empty() && !stays(rows_.back())) {
    rows_.pop_back();  // it was kept as the last one
  }
  const bool falls = row.state == solver::kFalling;
  const bool is_always_kept = falls || solver::ends_phase(last_state_, row.state);
  rows_.push_back(
      {instants_, is_always_kept, static_cast<char>(solver::code_of_state(row.state)), {}});
  solver::append_numbers(row, rows_.back().numbers);
  row_bytes_ = rows_.back().numbers.size() * sizeof(double) + 1;
  instants_ += falls ? 0U : 1U;
  always_kept_ += is_always_kept ? 1U : 0U;
  last_state_ = row.state;
  while (chooses_every_ && rows_.size() > most_rows() && every_ < instants_) {
    every_ *= 2;
    std::erase_if(rows_,
                  [this](const Row& kept) { return !stays(kept) && &kept != &rows_.back(); });
  }
  if (rows_.size() > most_rows()) {  // the rest is only counted
    is_too_long_ = true;
    rows_.pop_back();
  }
}

void TraceRows::move_to(protocol::Trace& trace) {
  trace.set_instants(instants_);
  trace.set_every(every_);
  if (is_too_long_) {
    // The first instant and the last one are kept with any `every`.
    const std::uint64_t always = always_kept_ + 2;
    const std::uint64_t room = most_rows() > always ? most_rows() - always : 0;
    trace.set_every(room == 0 ? instants_ + 1 : (instants_ + room - 1) / room);
    return;
  }
  for (const Row& row : rows_) {
    trace.mutable_values()->Add(row.numbers.begin(), row.numbers.end());
    trace.mutable_states()->push_back(row.state);
  }
}

protocol::PointResult solve_trace(const protocol::TraceOrder& order,
                                  const solver::Tracing::Sink& sink, solver::FallCache& falls) {
  constexpr std::uint64_t kNumber = 0;
  try {
    const solver::ModelParameters model = protocol::from_message(order.model());
    const solver::FallOutcome fall = falls.fall(model);
    if (!fall.fallen) {
      return protocol::failed_point(kNumber, fall.error);
    }
    solver::CaseResult result =
        solver::Finger(model, fall.fallen)
            .solve(order.h_m(), order.mu(), order.e_star(), {sink, order.shape(), order.fall()});
    if (order.errors()) {
      result.errors = solver::errors_by_companion(model, result, falls);
    }
    return protocol::to_message(kNumber, result);
  } catch (const std::exception& error) {
    return protocol::failed_point(kNumber, error.what());
  }
}

TraceSolver::TraceSolver(Solve solve, std::function<void()> has_trace, std::size_t most_bytes)
    : solve_(std::move(solve)),
      has_trace_(std::move(has_trace)),
      most_bytes_(most_bytes),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

TraceSolver::~TraceSolver() {
  drop_all();
  thread_.request_stop();
}

void TraceSolver::take(protocol::TraceOrder order) {
  const std::lock_guard lock(mutex_);
  if (job_ || !solve_) {
    traces_.push_back(declined(order.trace_id()));
    has_trace_();
    return;
  }
  job_.emplace(Job{std::move(order)});
  changed_.notify_all();
}

void TraceSolver::cancel(std::uint64_t trace_id) {
  const std::lock_guard lock(mutex_);
  if (job_ && job_->order.trace_id() == trace_id) {
    job_->is_cancelled = true;
  }
}

void TraceSolver::drop_all() {
  const std::lock_guard lock(mutex_);
  traces_.clear();
  if (job_) {
    job_->is_dropped = true;
  }
}

bool TraceSolver::is_solving() const {
  const std::lock_guard lock(mutex_);
  return job_.has_value();
}

std::vector<protocol::Trace> TraceSolver::collect() {
  const std::lock_guard lock(mutex_);
  return std::exchange(traces_, {});
}

void TraceSolver::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return job_.has_value(); })) {
    lock.unlock();
    protocol::Trace trace;
    trace.set_trace_id(job_->order.trace_id());
    TraceRows rows(job_->order.every(), most_bytes_);
    *trace.mutable_result() =
        solve_(job_->order, [&rows](const solver::TraceRow& row) { rows.add(row); });
    if (trace.result().error().empty()) {
      rows.move_to(trace);
    }
    lock.lock();
    const Job job = *std::exchange(job_, std::nullopt);
    if (!job.is_dropped) {
      traces_.push_back(job.is_cancelled ? declined(trace.trace_id()) : std::move(trace));
      has_trace_();
    }
  }
}

}  // namespace oblique::worker
