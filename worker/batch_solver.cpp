#include "worker/batch_solver.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "worker/solver/point_runs.h"

namespace oblique::worker {

BatchSolver::BatchSolver(SolvePoints solve, std::function<void()> batch_ended, std::size_t threads)
    : solve_(std::move(solve)),
      batch_ended_(std::move(batch_ended)),
      thread_count_(std::max<std::size_t>(threads, 1)) {
  for (std::size_t i = 0; i < thread_count_; ++i) {
    threads_.emplace_back([this](const std::stop_token& stop) { work(stop); });
  }
}

BatchSolver::~BatchSolver() {
  drop_all();
  for (std::jthread& thread : threads_) {
    thread.request_stop();
  }
  threads_.clear();  // joins
}

void BatchSolver::add(Batch batch) {
  const std::lock_guard lock(mutex_);
  open_.emplace_back(std::move(batch));
  changed_.notify_all();
}

void BatchSolver::drop_study(std::uint64_t study_id) {
  const std::lock_guard lock(mutex_);
  std::erase_if(progress_, [&](const auto& entry) { return entry.second.study_id == study_id; });
  for (auto batch = open_.begin(); batch != open_.end();) {
    const auto dropped = batch++;
    if (dropped->batch.study_id() == study_id) {
      dropped->unwanted = true;
      drop(dropped);
    }
  }
  changed_.notify_all();
}

void BatchSolver::drop_batch(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(open_.begin(), open_.end(), [&](const OpenBatch& batch) {
    return batch.batch.number() == number;
  });
  if (found != open_.end()) {
    drop(found);
  }
  changed_.notify_all();
}

void BatchSolver::drop_all() {
  const std::lock_guard lock(mutex_);
  for (auto batch = open_.begin(); batch != open_.end();) {
    drop(batch++);
  }
  changed_.notify_all();
}

/// A batch that is worked on stays, marked, until the last thread leaves it.
void BatchSolver::drop(OpenBatches::iterator batch) {
  batch->dropped = true;
  if (batch->solvers == 0) {
    open_.erase(batch);
  }
}

void BatchSolver::set_paused(bool paused) {
  const std::lock_guard lock(mutex_);
  paused_ = paused;
  changed_.notify_all();
}

bool BatchSolver::is_solving() const {
  const std::lock_guard lock(mutex_);
  return std::any_of(open_.begin(), open_.end(),
                     [](const OpenBatch& batch) { return batch.solvers > 0; });
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

Progress& BatchSolver::progress_of(const Batch& batch) {
  return progress_
      .try_emplace(batch.number(), Progress{batch.number(), batch.study_id(), {}, 0.0, false, {}})
      .first->second;
}

/// The first batch with points that no thread took.
BatchSolver::OpenBatches::iterator BatchSolver::next_batch() {
  return std::find_if(open_.begin(), open_.end(), [](const OpenBatch& open) {
    return !open.dropped && open.given < open.batch.size();
  });
}

void BatchSolver::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !paused_ && next_batch() != open_.end(); })) {
    Task task{next_batch(), 0, 0, {}, {}, Clock::now()};
    ++task.batch->solvers;
    const Batch& batch = task.batch->batch;  // stays while a thread is at work on it
    lock.unlock();
    solve_(
        batch, [&] { return next_point(task, stop); },
        [&](protocol::PointResult&& result) { take(task, std::move(result)); });
    lock.lock();
    hand_on(task);
    OpenBatch& done = *task.batch;
    if (--done.solvers > 0) {
      continue;
    }
    const bool ended = !done.dropped && done.given == batch.size();
    if (ended) {
      progress_of(batch).batch_done = true;
    }
    if (done.dropped || ended) {
      open_.erase(task.batch);
    }
    if (ended) {
      lock.unlock();
      batch_ended_();
      lock.lock();
    }
  }
}

std::optional<std::uint64_t> BatchSolver::next_point(Task& task, const std::stop_token& stop) {
  do {
    const Batch& batch = task.batch->batch;
    const std::uint64_t found = batch.first_to_solve(task.next, task.end);
    batch.append_points(task.next, found, task.left_out);
    task.next = found;
    if (task.next < task.end) {
      if (task.batch->dropped) {  // points may be slow: the rest of the task is not waited for
        return std::nullopt;
      }
      return task.next++;
    }
  } while (take_more(task, stop));
  return std::nullopt;
}

/// Takes the next part of the batch, of which a filter may keep nothing. False when none is left.
bool BatchSolver::take_more(Task& task, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  hand_on(task);
  OpenBatch& open = *task.batch;
  if (paused_) {
    changed_.wait(lock, stop, [&] { return !paused_ || open.dropped; });
    task.busy_since = Clock::now();
  }
  const std::uint64_t left = open.batch.size() - open.given;
  if (open.dropped || stop.stop_requested() || left == 0) {
    return false;
  }
  const std::uint64_t count = solver::points_of_task(left, thread_count_);
  task.next = open.given;
  task.end = task.next + count;
  open.given += count;
  return true;
}

void BatchSolver::take(Task& task, protocol::PointResult&& result) {
  task.results.push_back(std::move(result));
  if (Clock::now() - task.busy_since > kLongestWait) {
    const std::lock_guard lock(mutex_);
    hand_on(task);
  }
}

/// Needs the lock.
void BatchSolver::hand_on(Task& task) {
  if (task.results.empty() && task.left_out.empty()) {
    return;  // the time since is that of results to come
  }
  const Clock::time_point now = Clock::now();
  if (!task.batch->unwanted) {
    Progress& progress = progress_of(task.batch->batch);
    progress.results.insert(progress.results.end(), std::move_iterator(task.results.begin()),
                            std::move_iterator(task.results.end()));
    progress.left_out.insert(progress.left_out.end(), task.left_out.begin(), task.left_out.end());
    progress.busy_s += std::chrono::duration<double>(now - task.busy_since).count();
  }
  task.results.clear();
  task.left_out.clear();
  task.busy_since = now;
}

}  // namespace oblique::worker
