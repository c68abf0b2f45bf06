#include "worker/batch_solver.h"

#include <chrono>
#include <utility>

namespace oblique::worker {

BatchSolver::BatchSolver(SolvePoint solve, std::function<void()> task_ended)
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
  return solving_;
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
    current_ = Current{std::move(waiting_.front()), false};
    waiting_.pop_front();
    run_current(lock, stop);
    current_.reset();
  }
}

void BatchSolver::run_current(std::unique_lock<std::mutex>& lock, const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  const Task task = current_->task;
  for (std::uint64_t i = 0; i < task.count; ++i) {
    changed_.wait(lock, stop, [this] { return !paused_ || current_->dropped; });
    if (current_->dropped || stop.stop_requested()) {
      return;
    }
    solving_ = true;
    lock.unlock();
    const Clock::time_point begin = Clock::now();
    protocol::PointResult result = solve_(task, task.first_point + i);
    const std::chrono::duration<double> busy = Clock::now() - begin;
    lock.lock();
    solving_ = false;
    if (current_->dropped) {
      return;
    }
    Progress& progress = progress_of(task);
    progress.results.push_back(std::move(result));
    progress.busy_s += busy.count();
  }
  progress_of(task).task_done = true;
  lock.unlock();
  task_ended_();
  lock.lock();
}

}  // namespace oblique::worker
