#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <span>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "worker/batch.h"
#include "worker/solver/point_runs.h"
#include "worker/solver/solve.h"
#include "worker/solving_slot.h"

namespace oblique::worker {

/// Solves batches on several threads, in the order in which they were added (README.md). Points
/// that do not pass the study's filter are reported, not solved.
class BatchSolver {
 public:
  /// Solves the points of the source and passes on the outcomes in any order. Points are numbered
  /// by their position in the batch. Called by several threads at once; must not throw.
  using SolvePoints =
      std::function<void(const Batch&, solver::PointSource&, const solver::TakeOutcome&)>;

  /// A solving thread calls `batch_ended` after the last point of a batch. `batch_ended` must not
  /// call this object. Records the points being solved in
  /// `slots`: thread i in slot i + 1. `slots` may be empty.
  BatchSolver(SolvePoints solve, std::function<void()> batch_ended, std::size_t threads = 1,
              std::span<SolvingSlot> slots = {});

  /// Waits for the points that are being solved.
  ~BatchSolver();

  void add(Batch batch);

  /// Drops the batches of a study and their results that were not collected.
  void drop_study(std::uint64_t study_id);
  /// Drops one batch or all; their results can still be collected. Ignores unknown numbers.
  void drop_batch(std::uint64_t number);
  void drop_all();

  /// While paused, no thread begins another point.
  void set_paused(bool paused);

  bool is_solving() const;

  /// Results since the last call, by batch. Threads hold results back for about 20 ms at most.
  std::vector<Progress> collect();

 private:
  struct OpenBatch {
    explicit OpenBatch(Batch&& opened) : batch(std::move(opened)) {}

    const Batch batch;
    std::uint64_t given = 0;            ///< number of positions that threads have taken
    std::size_t solvers = 0;            ///< number of threads that work on the batch
    std::atomic<bool> dropped = false;  ///< written under the lock, read without it
    bool unwanted = false;              ///< true if the results are dropped with the batch
  };
  using OpenBatches = std::list<OpenBatch>;
  class Task;  ///< the points that one thread solves, part by part

  void work(const std::stop_token& stop, SolvingSlot& solving);
  OpenBatches::iterator next_batch();
  void drop(const std::function<bool(const OpenBatch&)>& is_to_drop);
  Progress& progress_of(const Batch& batch);

  const SolvePoints solve_;
  const std::function<void()> batch_ended_;
  const std::size_t thread_count_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  OpenBatches open_;                            ///< batches in the order of their numbers
  std::map<std::uint64_t, Progress> progress_;  ///< key: number of the batch
  bool paused_ = false;
  std::vector<std::jthread> threads_;  ///< declared last: they use the other members
};

}  // namespace oblique::worker
