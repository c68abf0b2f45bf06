#include "worker/trace_solver.h"

#include <algorithm>
#include <chrono>
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

void TraceRows::add(const solver::TraceRow& row) {
  if (!rows_.empty() && !stays(rows_.back())) {
    rows_.pop_back();  // the row was kept only because it was the last one
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
  if (rows_.size() > most_rows()) {  // the row is counted, but not kept
    is_too_long_ = true;
    rows_.pop_back();
  }
}

void TraceRows::move_to(protocol::Trace& trace) {
  trace.set_instants(instants_);
  trace.set_every(every_);
  if (is_too_long_) {
    // The first and the last instant are kept for every value of `every`.
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
    : solve_(std::move(solve)), has_trace_(std::move(has_trace)), most_bytes_(most_bytes) {}

void TraceSolver::take(const protocol::TraceOrder& order) {
  gather();
  if (running_.valid() || !solve_) {
    traces_.push_back(declined(order.trace_id()));
    has_trace_();
    return;
  }
  trace_id_ = order.trace_id();
  is_cancelled_ = is_dropped_ = false;
  std::packaged_task<protocol::Trace()> task([this, order] { return solved(order); });
  running_ = task.get_future();
  thread_ = std::jthread([this, task = std::move(task)]() mutable {
    task();
    has_trace_();
  });
}

void TraceSolver::cancel(std::uint64_t trace_id) {
  is_cancelled_ = is_cancelled_ || trace_id == trace_id_;
}

void TraceSolver::drop_all() {
  traces_.clear();
  is_dropped_ = true;
}

bool TraceSolver::is_solving() const {
  return running_.valid() &&
         running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
}

std::vector<protocol::Trace> TraceSolver::collect() {
  gather();
  return std::exchange(traces_, {});
}

protocol::Trace TraceSolver::solved(const protocol::TraceOrder& order) const {
  protocol::Trace trace;
  trace.set_trace_id(order.trace_id());
  TraceRows rows(order.every(), most_bytes_);
  *trace.mutable_result() = solve_(order, [&](const solver::TraceRow& row) { rows.add(row); });
  if (trace.result().error().empty()) {
    rows.move_to(trace);
  }
  return trace;
}

/// Moves a solved trace from running_ to the answers.
void TraceSolver::gather() {
  if (running_.valid() && !is_solving()) {
    protocol::Trace trace = running_.get();
    if (!is_dropped_) {
      traces_.push_back(is_cancelled_ ? declined(trace_id_) : std::move(trace));
    }
  }
}

}  // namespace oblique::worker
