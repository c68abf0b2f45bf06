#pragma once

#include <chrono>
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
  /// Gives the next point to solve; nothing when there is none.
  using NextPoint = std::function<std::optional<std::uint64_t>()>;
  using TakeResult = std::function<void(protocol::PointResult&&)>;
  /// Solves the points of a task that the second gives, some of them at a time, and hands each
  /// result to the third in any order.
  using SolvePoints = std::function<void(const Task&, const NextPoint&, const TakeResult&)>;

  /// `solve` must not throw. `task_ended` is called from the solving thread after the last point of
  /// a task; it must not call back.
  BatchSolver(SolvePoints solve, std::function<void()> task_ended);

  /// Waits for the points that are being solved.
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

  /// Whether points are being solved now.
  bool is_solving() const;

  /// What was solved since the last call, by task.
  std::vector<Progress> collect();

 private:
  using Clock = std::chrono::steady_clock;
  struct Current {
    Task task;
    std::uint64_t given;  ///< points that were begun
    bool dropped;
    Clock::time_point busy_since;  ///< work before this is in a Progress
  };

  void run(const std::stop_token& stop);
  std::optional<std::uint64_t> next_point(const std::stop_token& stop);
  void take(protocol::PointResult&& result);
  Progress& progress_of(const Task& task);

  const SolvePoints solve_;
  const std::function<void()> task_ended_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Task> waiting_;
  std::optional<Current> current_;
  std::map<std::uint64_t, Progress> progress_;  // by the task's number
  bool paused_ = false;
  std::jthread thread_;  // last: it uses all the others
};

}  // namespace oblique::worker
