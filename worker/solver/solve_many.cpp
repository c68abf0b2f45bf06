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
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "worker/solver/estimate.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/result_fields.h"
#include "worker/solver/point_runs.h"

namespace oblique::solver {
namespace {

/// Gives the points of a source with their fingers. A point whose fall is missing ends a run of
/// points: those under way are solved first, since a fall may take long, and then it begins the
/// next run.
class PointRuns {
 public:
  PointRuns(FallCache& falls, PointSource& source, const TakeOutcome& sink)
      : falls_(falls), source_(source), sink_(sink) {}

  /// Waits for the fall of the first point of a run. False when no point is left.
  bool begin_run() {
    while (!first_) {
      if (!held_ && !(held_ = source_.next())) {
        return false;
      }
      const std::uint64_t number = *std::exchange(held_, std::nullopt);
      first_ = point_of(number, [&](const ModelParameters& model) {
        return std::optional(falls_.fall(model, models_ahead(number)));
      });
    }
    return true;
  }

  /// The next point of the run.
  std::optional<FingerPoint> next() {
    if (first_) {
      return std::exchange(first_, std::nullopt);
    }
    while (!held_ && (held_ = source_.next())) {
      bool is_missing = false;
      auto point = point_of(*held_, [&](const ModelParameters& model) {
        auto fall = falls_.kept_fall(model);
        is_missing = !fall;
        return fall;
      });
      if (is_missing) {
        break;  // it stays held
      }
      held_.reset();
      if (point) {
        return point;
      }
    }
    return std::nullopt;
  }

 private:
  /// Nothing when `fall_of` gives no fall, and when the point has failed, which is handed on.
  template <class FallOf>
  std::optional<FingerPoint> point_of(std::uint64_t number, const FallOf& fall_of) {
    try {
      const ModelPoint point = source_.point(number);
      if (!finger_ || point.model != model_) {
        finger_.reset();
        const ModelParameters model = source_.model(point.model);
        const std::optional<FallOutcome> fall = fall_of(model);
        if (!fall) {
          return std::nullopt;
        }
        if (!fall->fallen) {
          throw SolveError(fall->error);
        }
        finger_.emplace(model, fall->fallen);
        model_ = point.model;
      }
      return FingerPoint{*finger_, number, point.point};
    } catch (const std::exception& error) {
      sink_({number, std::nullopt, error.what()});
      return std::nullopt;
    }
  }

  /// Models of that point and of those behind it, in order, those of one fall that follow each
  /// other once: their falls are solved beside its own.
  std::vector<ModelParameters> models_ahead(std::uint64_t number) {
    constexpr int kMostRuns = 4096;  // of points of one model
    constexpr std::size_t kMostFalls = 64;
    std::vector<ModelParameters> models;
    std::optional<std::uint64_t> at = number;
    for (int run = 0; at && run < kMostRuns && models.size() < kMostFalls; ++run) {
      ModelParameters falling = fall_model(source_.model(source_.model_of(*at)));
      if (models.empty() || !(models.back() == falling)) {
        models.push_back(std::move(falling));
      }
      at = source_.behind_model(*at);
    }
    return models;
  }

  FallCache& falls_;
  PointSource& source_;
  const TakeOutcome& sink_;
  std::optional<std::uint64_t> held_;  ///< a point taken whose fall was missing
  std::optional<FingerPoint> first_;   ///< of the run that has begun
  std::optional<Finger> finger_;       ///< of the point given last
  std::size_t model_ = 0;              ///< its model's number
};

}  // namespace

void solve_points_of_models(PointSource& source, FallCache& falls, bool with_errors,
                            const TakeOutcome& sink) {
  PointRuns runs(falls, source, sink);
  const auto next_of_run = [&runs] { return runs.next(); };
  const auto take = [&sink](Outcome&& outcome) {
    if (outcome.result && !is_finite(*outcome.result)) {
      outcome.result.reset();
      outcome.error = "the solver gave a value that is not finite";
    }
    sink(std::move(outcome));
  };
  while (runs.begin_run()) {
    if (with_errors) {
      solve_points_with_errors(next_of_run, falls, take);
    } else {
      solve_points(next_of_run, take);
    }
  }
}

std::uint64_t points_of_task(std::uint64_t left, std::size_t threads) {
  constexpr std::uint64_t kLargestTask = 32;
  return std::clamp<std::uint64_t>(left / (4 * threads), 1, kLargestTask);
}

// ---- On many threads ----------------------------------------------------------------------------

namespace {

using namespace std::chrono_literals;
constexpr auto kBetweenQuestions = 50ms;
/// Threads that take longer to end, as in the middle of a long fall, are left to end by themselves.
constexpr auto kLongestFarewell = 150ms;

/// A point under its place in the caller's list.
struct Entry {
  ModelPoint point;
  std::size_t number;
};

/// Neighbours share a model, a fall, the state at touch, and all until the first turn. NaN has a
/// place too.
bool is_before(const Entry& a, const Entry& b) {
  std::strong_ordering order = a.point.model <=> b.point.model;
  for (double Point::*const value : {&Point::H_m, &Point::mu, &Point::e_star}) {
    if (std::is_eq(order)) {
      order = std::strong_order(a.point.point.*value, b.point.point.*value);
    }
  }
  return std::is_eq(order) ? a.number < b.number : std::is_lt(order);
}

/// Models so that those of one fall follow each other, falls in the order of their first models.
struct OrderedModels {
  explicit OrderedModels(std::span<const ModelParameters> given) : places(given.size()) {
    std::unordered_map<std::uint64_t, std::size_t> falls;  // numbers by hash
    std::vector<std::pair<std::size_t, std::size_t>> by_fall;
    for (std::size_t i = 0; i < given.size(); ++i) {
      const auto fall = falls.try_emplace(fall_hash(given[i]), falls.size()).first;
      by_fall.emplace_back(fall->second, i);
    }
    std::sort(by_fall.begin(), by_fall.end());
    for (const auto& [fall, number] : by_fall) {
      places[number] = models.size();
      models.push_back(given[number]);
    }
  }

  std::vector<ModelParameters> models;
  std::vector<std::size_t> places;  ///< of the given models among these
};

/// Points to solve and who solves them. Held by each thread, so that one that is left behind has
/// all that it needs.
class Work {
 public:
  Work(std::span<const ModelParameters> models, std::span<const ModelPoint> points,
       const TakeOutcome& take, const ManyOptions& options, std::size_t threads)
      : take_(&take),
        errors_(options.errors),
        falls_(options.falls ? options.falls : std::make_shared<FallCache>()),
        threads_(threads) {
    OrderedModels ordered(models);
    models_ = std::move(ordered.models);
    for (const ModelPoint& point : points) {
      if (point.model >= models_.size()) {
        throw InputError("a point has model " + std::to_string(point.model) + " of " +
                         std::to_string(models_.size()) + ": they count from 0");
      }
      points_.push_back({{ordered.places[point.model], point.point}, points_.size()});
    }
    std::sort(points_.begin(), points_.end(), is_before);
  }

  /// Solves tasks until none is left, on a thread of its own.
  void solve() {
    Source source(*this);
    try {
      solve_points_of_models(source, *falls_, errors_, [this](Outcome&& outcome) {
        outcome.number = points_[outcome.number].number;
        hand_on(std::move(outcome));
      });
    } catch (...) {
      const std::lock_guard lock(mutex_);
      fail(std::current_exception());
    }
    leave(1);
  }

  /// Counts threads that have ended, or could not be started.
  void leave(std::size_t threads) {
    const std::lock_guard lock(mutex_);
    threads_ -= threads;
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

 private:
  /// The points of one thread: tasks of neighbours. A point's number is its place among points_.
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
      return work_.points_[number].point;
    }
    std::size_t model_of(std::uint64_t number) override {
      return work_.points_[number].point.model;
    }
    ModelParameters model(std::size_t number) override { return work_.models_[number]; }
    std::optional<std::uint64_t> behind_model(std::uint64_t number) override {
      const auto& points = work_.points_;
      const auto behind = std::upper_bound(
          points.begin() + static_cast<std::ptrdiff_t>(number), points.end(), model_of(number),
          [](std::size_t model, const Entry& entry) { return model < entry.point.model; });
      return behind == points.end()
                 ? std::nullopt
                 : std::optional(static_cast<std::uint64_t>(behind - points.begin()));
    }

   private:
    Work& work_;
    std::uint64_t next_ = 0;
    std::uint64_t end_ = 0;
  };

  bool take_task(std::uint64_t& begin, std::uint64_t& end) {
    const std::lock_guard lock(mutex_);
    const std::uint64_t left = points_.size() - given_;
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
      fail(std::current_exception());
    }
  }

  /// Needs the lock.
  void fail(std::exception_ptr failure) {
    failure_ = failure_ ? failure_ : std::move(failure);
    stopped_ = true;
    changed_.notify_all();
  }

  std::vector<ModelParameters> models_;
  std::vector<Entry> points_;  ///< neighbours together
  std::atomic<bool> stopped_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  const TakeOutcome* take_;  ///< null: nobody wants outcomes any more
  const bool errors_;
  const std::shared_ptr<FallCache> falls_;
  std::size_t threads_;      ///< at work
  std::uint64_t given_ = 0;  ///< points in tasks
  std::size_t outcomes_ = 0;
  std::exception_ptr failure_;
};

/// Throws std::system_error when not one can be started; fewer do it all.
std::vector<std::thread> start_threads(std::size_t count, const std::shared_ptr<Work>& work) {
  std::vector<std::thread> threads;
  threads.reserve(count);
  try {
    while (threads.size() < count) {
      threads.emplace_back([work] { work->solve(); });
    }
  } catch (const std::system_error&) {
    work->leave(count - threads.size());
    if (threads.empty()) {
      throw;
    }
  }
  return threads;
}

}  // namespace

bool solve_many(std::span<const ModelParameters> models, std::span<const ModelPoint> points,
                const TakeOutcome& take, const ManyOptions& options) {
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t count = std::min(std::max<std::size_t>(points.size(), 1),
                                     options.threads == 0 ? cores : options.threads);
  const auto work = std::make_shared<Work>(models, points, take, options, count);
  std::vector<std::thread> threads = start_threads(count, work);
  const auto end = [&] {
    const bool all_end = work->end();
    for (std::thread& thread : threads) {
      all_end ? thread.join() : thread.detach();
    }
  };
  try {
    const bool is_complete = work->wait(options.goes_on);
    end();
    return is_complete;
  } catch (...) {
    end();
    throw;
  }
}

}  // namespace oblique::solver
