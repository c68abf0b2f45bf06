#include "worker/solver/solve_many.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <compare>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <numeric>
#include <system_error>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "worker/solver/model/fall_model.h"
#include "worker/solver/point_runs.h"

namespace oblique::solver {
namespace {

using namespace std::chrono_literals;
constexpr auto kBetweenQuestions = 50ms;
/// Threads that take longer to end, as in the middle of a long fall, are left to end by themselves.
constexpr auto kLongestFarewell = 150ms;

/// Whether the point `a`, given as number `i`, is solved before `b`, number `j`. NaN has a place
/// too.
bool is_before(const ModelPoint& a, std::size_t i, const ModelPoint& b, std::size_t j) {
  if (a.model != b.model) {
    return a.model < b.model;
  }
  for (double Point::*const value : {&Point::H_m, &Point::mu, &Point::e_star}) {
    if (const auto order = std::strong_order(a.point.*value, b.point.*value); std::is_neq(order)) {
      return std::is_lt(order);
    }
  }
  return i < j;
}

/// Points to solve and who solves them. Held by each thread, so that one that is left behind has
/// all that it needs.
class Work {
 public:
  Work(std::span<const ModelParameters> models, std::span<const ModelPoint> points,
       const TakeOutcome& take, const ManyOptions& options, std::size_t threads)
      : points_(points.begin(), points.end()),
        order_(points.size()),
        take_(&take),
        errors_(options.errors),
        falls_(options.falls ? options.falls : std::make_shared<FallCache>()),
        threads_(threads) {
    const std::vector<std::size_t> places = take_models(models);
    for (ModelPoint& point : points_) {
      if (point.model >= models_.size()) {
        throw InputError("a point has model " + std::to_string(point.model) + " of " +
                         std::to_string(models_.size()) + ": they count from 0");
      }
      point.model = places[point.model];
    }
    // Neighbours share a model, a fall, the state at touch, and all until the first turn.
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::sort(order_.begin(), order_.end(), [this](std::size_t a, std::size_t b) {
      return is_before(points_[a], a, points_[b], b);
    });
  }

  void solve() {
    Source source(*this);
    try {
      solve_points_of_models(source, *falls_, errors_, [this](Outcome&& outcome) {
        outcome.number = order_[outcome.number];
        hand_on(std::move(outcome));
      });
    } catch (...) {
      fail(std::current_exception());
    }
    const std::lock_guard lock(mutex_);
    --threads_;
    changed_.notify_all();
  }

  /// Waits for all, or for the first failure; whether all was handed on.
  bool wait(const std::function<bool(std::size_t)>& goes_on) {
    std::unique_lock lock(mutex_);
    const auto is_over = [this] { return threads_ == 0 || failure_; };
    while (!changed_.wait_for(lock, kBetweenQuestions, is_over)) {
      const std::size_t outcomes = outcomes_;
      lock.unlock();
      if (goes_on && !goes_on(outcomes)) {
        return false;
      }
      lock.lock();
    }
    if (failure_) {
      std::rethrow_exception(failure_);
    }
    return true;
  }

  /// Behind this nothing is handed on. Whether all threads are about to end.
  bool end() {
    std::unique_lock lock(mutex_);
    take_ = nullptr;
    stopped_ = true;
    return changed_.wait_for(lock, kLongestFarewell, [this] { return threads_ == 0; });
  }

  /// Counts threads that could not be started.
  void miss(std::size_t threads) {
    const std::lock_guard lock(mutex_);
    threads_ -= threads;
  }

 private:
  /// The points of one thread: tasks of neighbours.
  class Source : public PointSource {
   public:
    explicit Source(Work& work) : work_(work) {}

    std::optional<std::uint64_t> next() override {
      if (work_.stopped_ || (next_ == end_ && !work_.take_task(next_, end_))) {
        return std::nullopt;
      }
      return next_++;
    }
    ModelPoint point(std::uint64_t number) override {
      if (work_.stopped_) {  // one that was kept for a fall of its own
        throw SolveError("nobody waits for it any more");
      }
      return work_.at(number);
    }
    ModelParameters model(std::uint64_t number) override { return work_.models_[number]; }
    std::vector<ModelParameters> models_ahead() override {
      std::vector<ModelParameters> models;
      std::uint64_t number = next_ - 1;  // given last
      for (int run = 0; run < kRunsAhead && models.size() < kFallsAhead; ++run) {
        const std::size_t model = work_.at(number).model;
        add_ahead(models, work_.models_[model]);
        const auto rest = work_.order_.begin() + static_cast<std::ptrdiff_t>(number);
        const auto behind = std::upper_bound(
            rest, work_.order_.end(), model,
            [this](std::size_t m, std::size_t i) { return m < work_.points_[i].model; });
        if (behind == work_.order_.end()) {
          break;
        }
        number = static_cast<std::uint64_t>(behind - work_.order_.begin());
      }
      return models;
    }

   private:
    Work& work_;
    std::uint64_t next_ = 0;
    std::uint64_t end_ = 0;
  };

  /// Sets models_ so that models of one fall follow each other, falls in the order of their first
  /// models. Returns where each one is.
  std::vector<std::size_t> take_models(std::span<const ModelParameters> models) {
    std::unordered_map<std::uint64_t, std::size_t> falls;  // numbers by hash
    std::vector<std::pair<std::size_t, std::size_t>> by_fall;
    for (std::size_t i = 0; i < models.size(); ++i) {
      const auto fall = falls.try_emplace(fall_hash(models[i]), falls.size()).first;
      by_fall.emplace_back(fall->second, i);
    }
    std::sort(by_fall.begin(), by_fall.end());
    std::vector<std::size_t> places(models.size());
    for (const auto& [fall, number] : by_fall) {
      places[number] = models_.size();
      models_.push_back(models[number]);
    }
    return places;
  }

  /// By its place in the order.
  const ModelPoint& at(std::uint64_t number) const { return points_[order_[number]]; }

  bool take_task(std::uint64_t& begin, std::uint64_t& end) {
    const std::lock_guard lock(mutex_);
    const std::uint64_t left = order_.size() - given_;
    if (left == 0) {
      return false;
    }
    begin = given_;
    given_ += points_of_task(left, std::max<std::size_t>(threads_, 1));
    end = given_;
    return true;
  }

  void hand_on(Outcome&& outcome) {
    const std::lock_guard lock(mutex_);
    if (take_ == nullptr || failure_) {
      return;
    }
    try {
      (*take_)(std::move(outcome));
      ++outcomes_;
    } catch (...) {
      set_failure(std::current_exception());
    }
  }

  void fail(std::exception_ptr failure) {
    const std::lock_guard lock(mutex_);
    if (!failure_) {
      set_failure(std::move(failure));
    }
  }

  void set_failure(std::exception_ptr failure) {
    failure_ = std::move(failure);
    stopped_ = true;
    changed_.notify_all();
  }

  std::vector<ModelParameters> models_;
  std::vector<ModelPoint> points_;
  std::vector<std::size_t> order_;  ///< places of points, neighbours together
  std::atomic<bool> stopped_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  const TakeOutcome* take_;  ///< null: nobody wants outcomes any more
  const bool errors_;
  const std::shared_ptr<FallCache> falls_;
  std::size_t threads_;      ///< at work
  std::uint64_t given_ = 0;  ///< of the order
  std::size_t outcomes_ = 0;
  std::exception_ptr failure_;
};

/// The threads at some work. However that ends, nothing is handed on when this is gone.
class Threads {
 public:
  explicit Threads(Work& work) : work_(work) {}
  ~Threads() {
    const bool all_end = work_.end();
    for (std::thread& thread : threads_) {
      all_end ? thread.join() : thread.detach();
    }
  }
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  /// Throws std::system_error when not one can be started; fewer do it all.
  void start(std::size_t count, const std::shared_ptr<Work>& work) {
    threads_.reserve(count);
    try {
      while (threads_.size() < count) {
        threads_.emplace_back([work] { work->solve(); });
      }
    } catch (const std::system_error&) {
      work_.miss(count - threads_.size());
      if (threads_.empty()) {
        throw;
      }
    }
  }

 private:
  Work& work_;
  std::vector<std::thread> threads_;
};

std::size_t threads_for(const ManyOptions& options, std::size_t points) {
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  return std::min(std::max<std::size_t>(points, 1), options.threads == 0 ? cores : options.threads);
}

}  // namespace

bool solve_many(std::span<const ModelParameters> models, std::span<const ModelPoint> points,
                const TakeOutcome& take, const ManyOptions& options) {
  const std::size_t threads = threads_for(options, points.size());
  const auto work = std::make_shared<Work>(models, points, take, options, threads);
  Threads running(*work);
  running.start(threads, work);
  return work->wait(options.goes_on);
}

}  // namespace oblique::solver
