#include "worker/batch_solver.h"

#include <utility>

namespace oblique::worker {

BatchSolver::BatchSolver(SolvePoints solve, std::function<void()> task_ended)
    : solve_(std::move(solve)),
      task_ended_(std::move(task_ended)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

BatchSolver::~BatchSolver() {
  drop_all();
  thread_.request_stop();
}

void BatchSolver::add(Task task) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(task));
  changed_.notify_all();
}

void BatchSolver::drop_study(std::uint64_t study_id) {
  const std::lock_guard lock(mutex_);
  std::erase_if(waiting_, [&](const Task& task) { return task.study_id == study_id; });
  std::erase_if(progress_, [&](const auto& entry) { return entry.second.study_id == study_id; });
  if (current_ && current_->task.study_id == study_id) {
    current_->dropped = true;
  }
  changed_.notify_all();
}

void BatchSolver::drop_all() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  if (current_) {
    current_->dropped = true;
  }
  changed_.notify_all();
}

void BatchSolver::set_paused(bool paused) {
  const std::lock_guard lock(mutex_);
  paused_ = paused;
  changed_.notify_all();
}

bool BatchSolver::is_solving() const {
  const std::lock_guard lock(mutex_);
  return current_.has_value();
}

std::vector<Progress> BatchSolver::collect() {
  const std::lock_guard lock(mutex_);
  std::vector<Progress> collected;
  collected.reserve(progress_.size());
  for (auto& [number, progress] : progress_) {
    collected.push_back(std::move(progress));
  }
  progress_.clear();
  return collected;
}

Progress& BatchSolver::progress_of(const Task& task) {
  return progress_.try_emplace(task.number, Progress{task.number, task.study_id, {}, 0.0, false})
      .first->second;
}

void BatchSolver::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !waiting_.empty(); })) {
    current_ = Current{std::move(waiting_.front()), 0, false, Clock::now()};
    waiting_.pop_front();
    const Task task = current_->task;
    lock.unlock();
    solve_(
        task, [&] { return next_point(stop); },
        [&](protocol::PointResult&& result) { take(std::move(result)); });
    lock.lock();
    const bool ended = !current_->dropped && current_->given == task.count;
    current_.reset();
    if (ended) {
      progress_of(task).task_done = true;
      lock.unlock();
      task_ended_();
      lock.lock();
    }
  }
}

std::optional<std::uint64_t> BatchSolver::next_point(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  if (paused_) {
    const Clock::time_point paused_at = Clock::now();
    changed_.wait(lock, stop, [this] { return !paused_ || current_->dropped; });
    current_->busy_since += Clock::now() - paused_at;
  }
  if (current_->dropped || stop.stop_requested() || current_->given == current_->task.count) {
    return std::nullopt;
  }
  return current_->task.first_point + current_->given++;
}

void BatchSolver::take(protocol::PointResult&& result) {
  const std::lock_guard lock(mutex_);
  if (current_->dropped) {
    return;
  }
  const Clock::time_point now = Clock::now();
  Progress& progress = progress_of(current_->task);
  progress.results.push_back(std::move(result));
  progress.busy_s += std::chrono::duration<double>(now - current_->busy_since).count();
  current_->busy_since = now;
}

}  // namespace oblique::worker
