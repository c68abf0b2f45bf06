#include "worker/batch_solver.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "worker/solver/model/errors.h"

namespace oblique::worker {

class BatchSolver::Task : public solver::PointSource {
 public:
  Task(BatchSolver& solver, OpenBatch& open, SolvingSlot& solving)
      : solver_(solver), open_(open), batch_(open.batch), solving_(solving) {
    solving_.study_id = batch_.study_id();
  }

  std::optional<std::uint64_t> next() override {
    if (std::exchange(falls_, 0) > 0) {
      solving_.end_falls();
    }
    do {
      const std::uint64_t found = batch_.first_to_solve(next_, end_);
      batch_.append_points(next_, found, left_out_);
      next_ = found;
      if (next_ < end_) {
        if (open_.dropped) {
          return std::nullopt;
        }
        solving_.begin(batch_.point_at(next_));
        return next_++;
      }
    } while (take_more());
    return std::nullopt;
  }
  solver::ModelPoint point(std::uint64_t position) override {
    const std::uint64_t number = batch_.point_at(position);
    if (const std::string fault = batch_.points().fault(number); !fault.empty()) {
      throw solver::InputError(fault);
    }
    const protocol::Point point = batch_.points().point(number);
    return {point.model, {point.H_m, point.mu, point.e_star}};
  }
  Run run_of(std::uint64_t position) override {
    if (falls_++ < SolvingSlot::kMostFalls) {
      solving_.begin_fall(batch_.point_at(position));
    }
    const auto next = batch_.first_to_solve(batch_.end_of_model(position), batch_.size());
    return {batch_.points().segment_at(batch_.point_at(position)).model,
            next < batch_.size() ? std::optional(next) : std::nullopt};
  }
  solver::ModelParameters model(std::size_t number) override {
    return batch_.points().model(number);
  }

  void take(solver::Outcome&& outcome) {
    constexpr std::chrono::milliseconds kLongestWait{20};
    const std::uint64_t number = batch_.point_at(outcome.number);
    results_.push_back(outcome.result ? protocol::to_message(number, *outcome.result)
                                      : protocol::failed_point(number, outcome.error));
    protocol::set_inputs(results_.back(), batch_.points());
    solving_.end(number);
    if (Clock::now() - busy_since_ > kLongestWait) {
      const std::lock_guard lock(solver_.mutex_);
      pass_on();
    }
  }

  /// Moves the results of this thread to the solver. The caller must hold the lock.
  void pass_on() {
    if (results_.empty() && left_out_.empty()) {
      return;  // the time so far is added to that of the next results
    }
    const Clock::time_point now = Clock::now();
    if (!open_.unwanted) {
      Progress& progress = solver_.progress_of(batch_);
      std::move(results_.begin(), results_.end(), std::back_inserter(progress.results));
      progress.left_out.insert(progress.left_out.end(), left_out_.begin(), left_out_.end());
      progress.busy_s += std::chrono::duration<double>(now - busy_since_).count();
    }
    results_.clear();
    left_out_.clear();
    busy_since_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Takes the next part of the batch. A filter may leave out all points of the part. Returns false
  /// at the end of the batch.
  bool take_more() {
    std::unique_lock lock(solver_.mutex_);
    pass_on();
    if (solver_.paused_) {
      solver_.changed_.wait(lock, [&] { return !solver_.paused_ || open_.dropped; });
      busy_since_ = Clock::now();
    }
    const std::uint64_t left = batch_.size() - open_.given;
    if (open_.dropped || left == 0) {
      return false;
    }
    next_ = open_.given;
    open_.given += solver::points_of_task(left, solver_.thread_count_);
    end_ = open_.given;
    return true;
  }

  BatchSolver& solver_;
  OpenBatch& open_;  ///< the batch is not removed while a thread works on it
  const Batch& batch_;
  SolvingSlot& solving_;
  std::size_t falls_ = 0;                        ///< number of runs whose falls are solved ahead
  std::uint64_t next_ = 0;                       ///< position of the next point
  std::uint64_t end_ = 0;                        ///< position after the last point of this part
  std::vector<protocol::PointResult> results_;   ///< not yet moved to the solver
  std::vector<Batch::Range> left_out_;           ///< not yet moved to the solver
  Clock::time_point busy_since_ = Clock::now();  ///< start of the work on these results
};

BatchSolver::BatchSolver(SolvePoints solve, std::function<void()> batch_ended, std::size_t threads,
                         std::span<SolvingSlot> slots)
    : solve_(std::move(solve)), batch_ended_(std::move(batch_ended)), thread_count_(threads) {
  for (std::size_t i = 0; i < thread_count_; ++i) {
    SolvingSlot* const shared = slots.empty() ? nullptr : &slots[i + 1];
    threads_.emplace_back([this, shared](const std::stop_token& stop) {
      SolvingSlot own{};
      work(stop, shared == nullptr ? own : *shared);
    });
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
  for (OpenBatch& open : open_) {
    open.unwanted = open.unwanted || open.batch.study_id() == study_id;
  }
  drop([](const OpenBatch& open) { return open.unwanted; });
}

void BatchSolver::drop_batch(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  drop([&](const OpenBatch& open) { return open.batch.number() == number; });
}

void BatchSolver::drop_all() {
  const std::lock_guard lock(mutex_);
  drop([](const OpenBatch&) { return true; });
}

/// Removes batches at once, or when their last thread leaves them. The caller must hold the lock.
void BatchSolver::drop(const std::function<bool(const OpenBatch&)>& is_to_drop) {
  open_.remove_if([&](OpenBatch& open) {
    open.dropped = open.dropped || is_to_drop(open);
    return open.dropped && open.solvers == 0;
  });
  changed_.notify_all();
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
      .try_emplace(batch.number(), Progress{.batch = batch.number(),
                                            .study_id = batch.study_id(),
                                            .attempt = batch.attempt(),
                                            .study_uid = batch.study_uid()})
      .first->second;
}

/// The first batch with points that no thread has taken.
BatchSolver::OpenBatches::iterator BatchSolver::next_batch() {
  return std::find_if(open_.begin(), open_.end(), [](const OpenBatch& open) {
    return !open.dropped && open.given < open.batch.size();
  });
}

void BatchSolver::work(const std::stop_token& stop, SolvingSlot& solving) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !paused_ && next_batch() != open_.end(); })) {
    const auto open = next_batch();
    Task task(*this, *open, solving);
    ++open->solvers;
    lock.unlock();
    solve_(open->batch, task, [&](solver::Outcome&& outcome) { task.take(std::move(outcome)); });
    lock.lock();
    task.pass_on();
    if (--open->solvers > 0) {
      continue;
    }
    const bool is_done = !open->dropped && open->given == open->batch.size();
    if (is_done) {
      progress_of(open->batch).batch_done = true;
    }
    if (is_done || open->dropped) {
      open_.erase(open);
    }
    if (is_done) {
      lock.unlock();
      batch_ended_();
      lock.lock();
    }
  }
}

}  // namespace oblique::worker
