#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "worker/task.h"

namespace oblique::worker {

/// Solves tasks in the order in which they were added, on threads of its own, so that solving never
/// holds up heartbeats. The threads share each task, point by point or in small runs, and meet in a
/// lock once a run.
class BatchSolver {
 public:
  /// Gives the next point to solve; nothing when there is none.
  using NextPoint = std::function<std::optional<std::uint64_t>()>;
  using TakeResult = std::function<void(protocol::PointResult&&)>;
  /// Solves the points of a task that the second gives, some of them at a time, and hands each
  /// result to the third in any order. Called from several threads at once.
  using SolvePoints = std::function<void(const Task&, const NextPoint&, const TakeResult&)>;

  /// `solve` must not throw. `task_ended` is called from a solving thread after the last point of
  /// a task; it must not call back. `threads` is at least 1.
  BatchSolver(SolvePoints solve, std::function<void()> task_ended, std::size_t threads = 1);

  /// Waits for the points that are being solved.
  ~BatchSolver();
  BatchSolver(const BatchSolver&) = delete;
  BatchSolver& operator=(const BatchSolver&) = delete;

  void add(Task task);

  /// Drops the tasks of a study and their results that were not collected.
  void drop_study(std::uint64_t study_id);

  /// Drops one task; what is solved of it can still be collected. An unknown number is passed over.
  void drop_task(std::uint64_t number);

  /// Drops all tasks; what is solved can still be collected.
  void drop_all();

  /// While paused, no further point is begun.
  void set_paused(bool paused);

  /// Whether points are being solved now.
  bool is_solving() const;

  /// What was solved since the last call, by task. A thread hands its results on when it takes
  /// further points, so those of a run of quick points may be a few milliseconds late.
  std::vector<Progress> collect();

 private:
  using Clock = std::chrono::steady_clock;
  /// Most points that a thread takes at a time; about ten milliseconds of quick ones.
  static constexpr std::uint64_t kLongestRun = 32;
  /// A result waits no longer in its thread.
  static constexpr std::chrono::milliseconds kLongestWait{20};

  struct OpenTask {
    Task task;
    std::uint64_t given = 0;  ///< points that a thread took
    std::size_t solvers = 0;  ///< threads at work on it
    bool dropped = false;     ///< no further point is begun
    bool unwanted = false;    ///< nor are results kept
  };
  using OpenTasks = std::list<OpenTask>;
  /// What one thread has of the task that it works on.
  struct Share {
    OpenTasks::iterator task;
    std::uint64_t next = 0;  ///< of the run at hand
    std::uint64_t end = 0;
    std::vector<protocol::PointResult> results;  ///< not handed on yet
    Clock::time_point busy_since;                ///< work before this is handed on
  };

  void run(const std::stop_token& stop);
  OpenTasks::iterator task_with_free_points();
  std::optional<std::uint64_t> next_point(Share& share, const std::stop_token& stop);
  void take(Share& share, protocol::PointResult&& result);
  void hand_on(Share& share);
  void drop(OpenTasks::iterator task);
  Progress& progress_of(const Task& task);

  const SolvePoints solve_;
  const std::function<void()> task_ended_;
  const std::size_t thread_count_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  OpenTasks open_;                              // in the order of their numbers
  std::map<std::uint64_t, Progress> progress_;  // by the task's number
  bool paused_ = false;
  std::vector<std::jthread> threads_;  // last: they use all the others
};

}  // namespace oblique::worker
