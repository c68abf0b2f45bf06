#include "worker/batch_solver.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace oblique::worker {

BatchSolver::BatchSolver(SolvePoints solve, std::function<void()> task_ended, std::size_t threads)
    : solve_(std::move(solve)),
      task_ended_(std::move(task_ended)),
      thread_count_(std::max<std::size_t>(threads, 1)) {
  for (std::size_t i = 0; i < thread_count_; ++i) {
    threads_.emplace_back([this](const std::stop_token& stop) { run(stop); });
  }
}

BatchSolver::~BatchSolver() {
  drop_all();
  for (std::jthread& thread : threads_) {
    thread.request_stop();
  }
  threads_.clear();  // joins
}

void BatchSolver::add(Task task) {
  const std::lock_guard lock(mutex_);
  open_.push_back({std::move(task)});
  changed_.notify_all();
}

void BatchSolver::drop_study(std::uint64_t study_id) {
  const std::lock_guard lock(mutex_);
  std::erase_if(progress_, [&](const auto& entry) { return entry.second.study_id == study_id; });
  for (auto task = open_.begin(); task != open_.end();) {
    const auto dropped = task++;
    if (dropped->task.study_id == study_id) {
      dropped->unwanted = true;
      drop(dropped);
    }
  }
  changed_.notify_all();
}

void BatchSolver::drop_task(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(open_.begin(), open_.end(),
                                  [&](const OpenTask& task) { return task.task.number == number; });
  if (found != open_.end()) {
    drop(found);
  }
  changed_.notify_all();
}

void BatchSolver::drop_all() {
  const std::lock_guard lock(mutex_);
  for (auto task = open_.begin(); task != open_.end();) {
    drop(task++);
  }
  changed_.notify_all();
}

/// A task that is worked on stays, marked, until the last thread leaves it.
void BatchSolver::drop(OpenTasks::iterator task) {
  task->dropped = true;
  if (task->solvers == 0) {
    open_.erase(task);
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
                     [](const OpenTask& task) { return task.solvers > 0; });
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

BatchSolver::OpenTasks::iterator BatchSolver::task_with_free_points() {
  return std::find_if(open_.begin(), open_.end(), [](const OpenTask& task) {
    return !task.dropped && task.given < task.task.count;
  });
}

void BatchSolver::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop,
                       [this] { return !paused_ && task_with_free_points() != open_.end(); })) {
    Share share{task_with_free_points(), 0, 0, {}, Clock::now()};
    ++share.task->solvers;
    const Task task = share.task->task;
    lock.unlock();
    solve_(
        task, [&] { return next_point(share, stop); },
        [&](protocol::PointResult&& result) { take(share, std::move(result)); });
    lock.lock();
    hand_on(share);
    OpenTask& done = *share.task;
    if (--done.solvers > 0) {
      continue;
    }
    const bool ended = !done.dropped && done.given == task.count;
    if (done.dropped || ended) {
      open_.erase(share.task);
    }
    if (ended) {
      progress_of(task).task_done = true;
      lock.unlock();
      task_ended_();
      lock.lock();
    }
  }
}

std::optional<std::uint64_t> BatchSolver::next_point(Share& share, const std::stop_token& stop) {
  if (share.next < share.end) {
    return share.next++;
  }
  std::unique_lock lock(mutex_);
  hand_on(share);
  OpenTask& open = *share.task;
  if (paused_) {
    changed_.wait(lock, stop, [&] { return !paused_ || open.dropped; });
    share.busy_since = Clock::now();
  }
  const std::uint64_t left = open.task.count - open.given;
  if (open.dropped || stop.stop_requested() || left == 0) {
    return std::nullopt;
  }
  // Ever shorter runs towards the end, so that the threads finish together.
  const std::uint64_t run = std::clamp<std::uint64_t>(left / (4 * thread_count_), 1, kLongestRun);
  share.next = open.task.first_point + open.given;
  share.end = share.next + run;
  open.given += run;
  return share.next++;
}

void BatchSolver::take(Share& share, protocol::PointResult&& result) {
  share.results.push_back(std::move(result));
  if (Clock::now() - share.busy_since > kLongestWait) {
    const std::lock_guard lock(mutex_);
    hand_on(share);
  }
}

/// Needs the lock.
void BatchSolver::hand_on(Share& share) {
  if (share.results.empty()) {
    return;  // the time since is that of results to come
  }
  const Clock::time_point now = Clock::now();
  if (!share.task->unwanted) {
    Progress& progress = progress_of(share.task->task);
    progress.results.insert(progress.results.end(), std::move_iterator(share.results.begin()),
                            std::move_iterator(share.results.end()));
    progress.busy_s += std::chrono::duration<double>(now - share.busy_since).count();
  }
  share.results.clear();
  share.busy_since = now;
}

}  // namespace oblique::worker
