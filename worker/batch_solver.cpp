#include "worker/batch_solver.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <optional>
#include <string>

#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "worker/solver/model/errors.h"

namespace oblique::worker {

class BatchSolver::Task : public solver::PointSource {
 public:
  Task(BatchSolver& solver, OpenBatches::iterator open, const std::stop_token& stop)
      : solver_(solver), open_(*open), batch_(open->batch), stop_(stop) {}

  std::optional<std::uint64_t> next() override {
    do {
      const std::uint64_t found = batch_.first_to_solve(next_, end_);
      batch_.append_points(next_, found, left_out_);
      next_ = found;
      if (next_ < end_) {
        // Points may be slow: the rest of a task that is dropped is not waited for.
        return open_.dropped ? std::nullopt : std::optional(next_++);
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
  std::size_t model_of(std::uint64_t position) override {
    return batch_.points().segment_at(batch_.point_at(position)).model;
  }
  solver::ModelParameters model(std::size_t number) override {
    return batch_.points().model(number);
  }
  std::optional<std::uint64_t> behind_model(std::uint64_t position) override {
    const auto behind = batch_.first_to_solve(batch_.end_of_model(position), batch_.size());
    return behind < batch_.size() ? std::optional(behind) : std::nullopt;
  }

  void take(solver::Outcome&& outcome) {
    constexpr std::chrono::milliseconds kLongestWait{20};  // of a result in its thread
    const std::uint64_t number = batch_.point_at(outcome.number);
    results_.push_back(outcome.result ? protocol::to_message(number, *outcome.result)
                                      : protocol::failed_point(number, outcome.error));
    protocol::set_inputs(results_.back(), batch_.points());
    if (Clock::now() - busy_since_ > kLongestWait) {
      const std::lock_guard lock(solver_.mutex_);
      hand_on();
    }
  }

  /// Needs the lock.
  void hand_on() {
    if (results_.empty() && left_out_.empty()) {
      return;  // the time since is that of results to come
    }
    const Clock::time_point now = Clock::now();
    if (!open_.unwanted) {
      Progress& progress = solver_.progress_of(batch_);
      progress.results.insert(progress.results.end(), std::move_iterator(results_.begin()),
                              std::move_iterator(results_.end()));
      progress.left_out.insert(progress.left_out.end(), left_out_.begin(), left_out_.end());
      progress.busy_s += std::chrono::duration<double>(now - busy_since_).count();
    }
    results_.clear();
    left_out_.clear();
    busy_since_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Takes the next part of the batch, of which a filter may keep nothing. False when none is left.
  bool take_more() {
    std::unique_lock lock(solver_.mutex_);
    hand_on();
    if (solver_.paused_) {
      solver_.changed_.wait(lock, stop_, [&] { return !solver_.paused_ || open_.dropped; });
      busy_since_ = Clock::now();
    }
    const std::uint64_t left = batch_.size() - open_.given;
    if (open_.dropped || stop_.stop_requested() || left == 0) {
      return false;
    }
    next_ = open_.given;
    open_.given += solver::points_of_task(left, solver_.thread_count_);
    end_ = open_.given;
    return true;
  }

  BatchSolver& solver_;
  OpenBatch& open_;  // stays while a thread is at work on it
  const Batch& batch_;
  const std::stop_token& stop_;
  std::uint64_t next_ = 0;                       // position
  std::uint64_t end_ = 0;                        // past the last position
  std::vector<protocol::PointResult> results_;   // not handed on yet
  std::vector<Batch::Range> left_out_;           // the same, of points that a filter leaves out
  Clock::time_point busy_since_ = Clock::now();  // work before this is handed on
};

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
  drop([&](OpenBatch& open) {
    const bool is_of_study = open.batch.study_id() == study_id;
    open.unwanted = open.unwanted || is_of_study;
    return is_of_study;
  });
}

void BatchSolver::drop_batch(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  drop([&](const OpenBatch& open) { return open.batch.number() == number; });
}

void BatchSolver::drop_all() {
  const std::lock_guard lock(mutex_);
  drop([](const OpenBatch&) { return true; });
}

/// A batch that is worked on stays, marked, until the last thread leaves it. Needs the lock.
void BatchSolver::drop(const std::function<bool(OpenBatch&)>& is_to_drop) {
  open_.remove_if([&](OpenBatch& open) {
    open.dropped = is_to_drop(open) || open.dropped;
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
    const auto open = next_batch();
    Task task(*this, open, stop);
    ++open->solvers;
    lock.unlock();
    solve_(open->batch, task, [&](solver::Outcome&& outcome) { task.take(std::move(outcome)); });
    lock.lock();
    task.hand_on();
    if (--open->solvers > 0) {
      continue;
    }
    const bool ended = !open->dropped && open->given == open->batch.size();
    if (ended) {
      progress_of(open->batch).batch_done = true;
    }
    if (open->dropped || ended) {
      open_.erase(open);
    }
    if (ended) {
      lock.unlock();
      batch_ended_();
      lock.lock();
    }
  }
}

}  // namespace oblique::worker
