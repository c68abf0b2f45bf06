#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "worker/task.h"

namespace oblique::worker {

/// Solves tasks in the order in which they were added, on a thread of its own, so that solving
/// never holds up heartbeats. More threads would share the queue: nothing outside would change.
class BatchSolver {
 public:
  using SolvePoint = std::function<protocol::PointResult(const Task&, std::uint64_t point)>;

  /// `solve` must not throw. `task_ended` is called from the solving thread after the last point of
  /// a task; it must not call back.
  BatchSolver(SolvePoint solve, std::function<void()> task_ended);

  /// Waits for the point that is being solved.
  ~BatchSolver();
  BatchSolver(const BatchSolver&) = delete;
  BatchSolver& operator=(const BatchSolver&) = delete;

  void add(Task task);

  /// Drops the tasks of a study and their results that were not collected.
  void drop_study(std::uint64_t study_id);

  /// Drops all tasks; what is solved can still be collected.
  void drop_all();

  /// While paused, no further point is begun.
  void set_paused(bool paused);

  /// Whether a point is being solved now.
  bool is_solving() const;

  /// What was solved since the last call, by task.
  std::vector<Progress> collect();

 private:
  struct Current {
    Task task;
    bool dropped;
  };

  void run(const std::stop_token& stop);
  void run_current(std::unique_lock<std::mutex>& lock, const std::stop_token& stop);
  Progress& progress_of(const Task& task);

  const SolvePoint solve_;
  const std::function<void()> task_ended_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Task> waiting_;
  std::optional<Current> current_;
  std::map<std::uint64_t, Progress> progress_;  // by the task's number
  bool paused_ = false;
  bool solving_ = false;
  std::jthread thread_;  // last: it uses all the others
};

}  // namespace oblique::worker
