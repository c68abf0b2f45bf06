#include "worker/trace_solver.h"

#include <string>
#include <utility>

#include "proto/result_message.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::worker {
namespace {

protocol::TracePart not_taken(std::uint64_t trace_id) {
  protocol::TracePart part;
  part.set_trace_id(trace_id);
  part.set_last(true);
  part.set_not_taken(true);
  return part;
}

}  // namespace

TraceSolver::TraceSolver(Solve solve, std::function<void()> has_part)
    : solve_(std::move(solve)),
      has_part_(std::move(has_part)),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

TraceSolver::~TraceSolver() {
  drop_all();
  thread_.request_stop();
}

void TraceSolver::take(protocol::TraceOrder order) {
  const std::lock_guard lock(mutex_);
  if (job_ || !solve_) {
    parts_.push_back(not_taken(order.trace_id()));
    has_part_();
    return;
  }
  job_.emplace(Job{std::move(order), {}});
  job_->part.set_trace_id(job_->order.trace_id());
  if (job_->order.shape()) {
    job_->thinning.emplace(job_->order.most_bytes());
  }
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
  parts_.clear();
  if (job_) {
    job_->is_dropped = true;
  }
}

bool TraceSolver::is_solving() const {
  const std::lock_guard lock(mutex_);
  return job_.has_value();
}

std::vector<protocol::TracePart> TraceSolver::collect() {
  const std::lock_guard lock(mutex_);
  return std::exchange(parts_, {});
}

void TraceSolver::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return job_.has_value(); })) {
    lock.unlock();
    auto result = solve_(job_->order, [this](const solver::TraceRow& row) { add_row(row); });
    if (job_->thinning) {
      for (const TraceThinning::Shared& row : job_->thinning->rows()) {
        add_numbers(row->numbers, row->state);
      }
    }
    end(std::move(result));
    lock.lock();
  }
}

void TraceSolver::add_row(const solver::TraceRow& row) {
  if (job_->thinning) {
    job_->thinning->add(row);
    return;
  }
  if (job_->bytes > job_->order.most_bytes()) {
    return;  // it fails in the end
  }
  std::vector<double> numbers;
  solver::append_numbers(row, numbers);
  add_numbers(numbers, solver::code_of_state(row.state));
}

void TraceSolver::add_numbers(const std::vector<double>& numbers, std::uint8_t state) {
  auto& rows = *job_->part.mutable_rows();
  rows.mutable_values()->Add(numbers.begin(), numbers.end());
  rows.mutable_states()->push_back(static_cast<char>(state));
  const std::size_t row_bytes = numbers.size() * sizeof(double) + 1;
  job_->bytes += row_bytes;
  const std::size_t rows_here = rows.states().size();
  if ((rows_here + 1) * row_bytes > kPartBytes) {
    protocol::TracePart next;
    next.set_trace_id(job_->part.trace_id());
    hand_on(std::exchange(job_->part, std::move(next)));
  }
}

void TraceSolver::hand_on(protocol::TracePart part) {
  const std::lock_guard lock(mutex_);
  if (job_->is_cancelled || job_->is_dropped) {
    return;
  }
  parts_.push_back(std::move(part));
  has_part_();
}

void TraceSolver::end(protocol::PointResult result) {
  const std::lock_guard lock(mutex_);
  Job job = std::move(*job_);
  job_.reset();
  if (job.is_dropped) {
    return;
  }
  if (job.is_cancelled) {
    parts_.push_back(not_taken(job.order.trace_id()));
    has_part_();
    return;
  }
  if (result.error().empty() && job.bytes > job.order.most_bytes()) {
    result = protocol::failed_point(0, "its trace has more than the " +
                                           std::to_string(job.order.most_bytes()) +
                                           " bytes that pass through a server");
  }
  job.part.set_last(true);
  *job.part.mutable_result() = std::move(result);
  parts_.push_back(std::move(job.part));
  has_part_();
}

}  // namespace oblique::worker
