#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "worker/batch.h"
#include "worker/solver/point_runs.h"
#include "worker/solver/solve.h"

namespace oblique::worker {

/// Solves batches in the order in which they were added, on threads of its own, so that solving
/// never delays heartbeats. Points that a filter leaves out are named and not solved. The threads
/// split each batch into tasks of one point or a few and take a lock once a task.
class BatchSolver {
 public:
  /// Solves the points of a batch that the source gives, some of them at a time, and hands each
  /// outcome to the last in any order. Numbers of points are positions in the batch. Called from
  /// several threads at once.
  using SolvePoints =
      std::function<void(const Batch&, solver::PointSource&, const solver::TakeOutcome&)>;

  /// `solve` must not throw. `batch_ended` is called from a solving thread after the last point of
  /// a batch; it must not call back. `threads` is at least 1.
  BatchSolver(SolvePoints solve, std::function<void()> batch_ended, std::size_t threads = 1);

  /// Waits for the points that are being solved.
  ~BatchSolver();
  BatchSolver(const BatchSolver&) = delete;
  BatchSolver& operator=(const BatchSolver&) = delete;

  void add(Batch batch);

  /// Drops the batches of a study and their results that were not collected.
  void drop_study(std::uint64_t study_id);

  /// Drops one batch; what is solved of it can still be collected. An unknown number is passed
  /// over.
  void drop_batch(std::uint64_t number);

  /// Drops all batches; what is solved can still be collected.
  void drop_all();

  /// While paused, no further point is begun.
  void set_paused(bool paused);

  /// Whether points are being solved now.
  bool is_solving() const;

  /// What was solved since the last call, by batch. A thread hands its results on when it takes
  /// further points, so those of quick points may be a few milliseconds late.
  std::vector<Progress> collect();

 private:
  struct OpenBatch {
    explicit OpenBatch(Batch&& opened) : batch(std::move(opened)) {}

    const Batch batch;
    std::uint64_t given = 0;  ///< positions that a thread took
    std::size_t solvers = 0;  ///< threads at work on it
    /// No further point is begun; set under the lock, read before each point without it.
    std::atomic<bool> dropped = false;
    bool unwanted = false;  ///< nor are results kept
  };
  using OpenBatches = std::list<OpenBatch>;
  class Task;  ///< the part of a batch that one thread solves at a time, and then the next

  void work(const std::stop_token& stop);
  OpenBatches::iterator next_batch();
  void drop(const std::function<bool(OpenBatch&)>& is_to_drop);
  Progress& progress_of(const Batch& batch);

  const SolvePoints solve_;
  const std::function<void()> batch_ended_;
  const std::size_t thread_count_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  OpenBatches open_;                            // in the order of their numbers
  std::map<std::uint64_t, Progress> progress_;  // by the batch's number
  bool paused_ = false;
  std::vector<std::jthread> threads_;  // last: they use all the others
};

}  // namespace oblique::worker
