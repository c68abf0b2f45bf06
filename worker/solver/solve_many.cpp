#include "worker/solver/solve_many.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstdint>
#include <exception>
#include <future>
#include <iterator>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "worker/solver/estimate.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/result_fields.h"
#include "worker/solver/parallel_for.h"
#include "worker/solver/point_runs.h"

namespace oblique::solver {
namespace {

/// The points of a source with their fingers.
class FingerSource {
 public:
  FingerSource(FallCache& falls, PointSource& source, const TakeOutcome& sink)
      : falls_(falls), source_(source), sink_(sink) {}

  /// Returns the next point; nothing at the end. Without `solves_falls`, also returns nothing if
  /// the point's fall is missing; the next call then returns the point.
  std::optional<FingerPoint> next(bool solves_falls) {
    while (upcoming_ || (upcoming_ = source_.next())) {
      const std::uint64_t number = *upcoming_;
      try {
        const ModelPoint point = source_.point(number);
        if (!finger_ || point.model != model_) {
          finger_.reset();
          const ModelParameters model = source_.model(point.model);
          const auto fall =
              solves_falls ? falls_.fall(model, models_from(number)) : falls_.kept_fall(model);
          if (!fall) {
            return std::nullopt;
          }
          if (!fall->fallen) {
            throw SolveError(fall->error);
          }
          finger_.emplace(model, fall->fallen);
          model_ = point.model;
        }
        upcoming_.reset();
        return FingerPoint{*finger_, number, point.point};
      } catch (const std::exception& error) {
        upcoming_.reset();
        sink_({number, std::nullopt, error.what()});
      }
    }
    return std::nullopt;
  }

 private:
  /// Fall models of this point and of later ones, without consecutive duplicates.
  std::vector<ModelParameters> models_from(std::uint64_t number) {
    constexpr int kMaxRuns = 4096;
    constexpr std::size_t kMaxFalls = 64;
    std::vector<ModelParameters> models;
    std::optional<std::uint64_t> at = number;
    for (int i = 0; at && i < kMaxRuns && models.size() < kMaxFalls; ++i) {
      const PointSource::Run run = source_.run_of(*at);
      ModelParameters falling = fall_model(source_.model(run.model));
      if (models.empty() || !(models.back() == falling)) {
        models.push_back(std::move(falling));
      }
      at = run.next;
    }
    return models;
  }

  FallCache& falls_;
  PointSource& source_;
  const TakeOutcome& sink_;
  std::optional<std::uint64_t> upcoming_;
  std::optional<Finger> finger_;  ///< finger of the last point
  std::size_t model_ = 0;         ///< number of its model
};

}  // namespace

void solve_points_of_models(PointSource& source, FallCache& falls, bool with_errors,
                            const TakeOutcome& sink) {
  FingerSource fingers(falls, source, sink);
  const auto take = [&sink](Outcome&& outcome) {
    if (outcome.result && !is_finite(*outcome.result)) {
      outcome.result.reset();
      outcome.error = "the solver gave a value that is not finite";
    }
    sink(std::move(outcome));
  };
  // A fall may take long, so the points under way are finished before a missing fall is solved.
  while (auto first = fingers.next(true)) {
    const auto next = [&] {
      return first ? std::exchange(first, std::nullopt) : fingers.next(false);
    };
    if (with_errors) {
      solve_points_with_errors(next, falls, take);
    } else {
      solve_points(next, take);
    }
  }
}

std::uint64_t points_of_task(std::uint64_t left, std::size_t threads) {
  constexpr std::uint64_t kLargestTask = 32;
  return std::clamp<std::uint64_t>(left / (4 * threads), 1, kLargestTask);
}

// ---- On several threads -------------------------------------------------------------------------

namespace {

using namespace std::chrono_literals;
// An interrupted call returns within the sum of these times. It abandons threads that solve a fall.
constexpr auto kPollInterval = 50ms;
constexpr auto kLongestJoin = 140ms;

/// The data that the threads of one call share. Abandoned threads keep it alive.
class Work {
 public:
  Work(std::span<const ModelParameters> models, std::span<const ModelPoint> points,
       const TakeOutcome& take, const ManyOptions& options, std::size_t threads)
      : models_(models.begin(), models.end()),
        take_(take),
        errors_(options.errors),
        falls_(options.falls ? options.falls : std::make_shared<FallCache>()),
        threads_(threads) {
    for (const ModelPoint& point : points) {
      if (point.model >= models.size()) {
        throw InputError("a point has model " + std::to_string(point.model) + " of " +
                         std::to_string(models.size()) + ": they count from 0");
      }
      points_.push_back({point, points_.size()});
    }
    // Sorts points so that neighbours share the fall, the model, the state at touch, and the
    // contact until its first compression ends.
    std::vector<std::uint64_t> fall_of_model;
    std::ranges::transform(models_, std::back_inserter(fall_of_model), fall_hash);
    const auto bits = [](double value) {
      return std::bit_cast<std::uint64_t>(value);
    };  // orders NaN
    std::ranges::sort(points_, {}, [&](const Entry& entry) {
      const auto& [model, point] = entry.point;
      return std::tuple(fall_of_model[model], model, bits(point.H_m), bits(point.mu),
                        bits(point.e_star), entry.number);
    });
  }

  /// Solves points on one of the threads until none is left.
  void solve() {
    Source source(*this);
    try {
      solve_points_of_models(source, *falls_, errors_, [this](Outcome&& outcome) {
        const std::lock_guard lock(mutex_);
        if (!stopped_) {
          outcome.number = points_[outcome.number].number;
          take_(std::move(outcome));
          ++outcomes_;
        }
      });
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = failure_ ? failure_ : std::current_exception();
      stopped_ = true;
    }
  }

  bool is_stopped() const { return stopped_; }
  std::size_t outcomes() const { return outcomes_; }
  void rethrow_failure() {
    const std::lock_guard lock(mutex_);
    if (failure_) {
      std::rethrow_exception(failure_);
    }
  }
  /// After this call `take` is not called any more.
  void stop() {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }

 private:
  struct Entry {
    ModelPoint point;
    std::size_t number;  ///< index in the caller's list
  };

  /// The points of one thread, numbered by their indices in points_.
  class Source : public PointSource {
   public:
    explicit Source(Work& work) : work_(work) {}

    std::optional<std::uint64_t> next() override {
      if (next_ == end_) {
        const std::lock_guard lock(work_.mutex_);
        next_ = work_.given_;
        if (next_ < work_.points_.size()) {
          work_.given_ += points_of_task(work_.points_.size() - next_, work_.threads_);
        }
        end_ = work_.given_;
      }
      return work_.stopped_ || next_ == end_ ? std::nullopt : std::optional(next_++);
    }
    ModelPoint point(std::uint64_t number) override {
      if (work_.stopped_) {  // so that the point's fall is not solved
        throw SolveError("stopped");
      }
      return work_.points_[number].point;
    }
    Run run_of(std::uint64_t number) override {
      const auto& points = work_.points_;
      const std::size_t model = points[number].point.model;
      const auto end =
          std::partition_point(points.begin() + static_cast<std::ptrdiff_t>(number), points.end(),
                               [model](const Entry& entry) { return entry.point.model == model; });
      const auto next = static_cast<std::uint64_t>(end - points.begin());
      return {model, end == points.end() ? std::nullopt : std::optional(next)};
    }
    ModelParameters model(std::size_t number) override { return work_.models_[number]; }

   private:
    Work& work_;
    std::uint64_t next_ = 0;
    std::uint64_t end_ = 0;
  };

  const std::vector<ModelParameters> models_;
  std::vector<Entry> points_;
  const TakeOutcome& take_;  ///< invalid once stopped
  const bool errors_;
  const std::shared_ptr<FallCache> falls_;
  const std::size_t threads_;
  std::atomic<bool> stopped_ = false;
  std::atomic<std::size_t> outcomes_ = 0;
  std::mutex mutex_;
  std::uint64_t given_ = 0;  ///< points that threads have taken
  std::exception_ptr failure_;
};

}  // namespace

bool solve_many(std::span<const ModelParameters> models, std::span<const ModelPoint> points,
                const TakeOutcome& take, const ManyOptions& options) {
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t threads = std::min(std::max<std::size_t>(points.size(), 1),
                                       options.threads == 0 ? cores : options.threads);
  const auto work = std::make_shared<Work>(models, points, take, options, threads);
  std::packaged_task<void()> solving(
      [work, threads] { parallel_for(threads, threads, [&work](std::size_t) { work->solve(); }); });

  struct Running {
    ~Running() {
      work.stop();
      ended.wait_for(kLongestJoin) == std::future_status::ready ? thread.join() : thread.detach();
    }
    Work& work;
    std::future<void> ended;
    std::thread thread;
  };
  std::future<void> ended = solving.get_future();
  Running running{*work, std::move(ended), std::thread(std::move(solving))};
  while (running.ended.wait_for(kPollInterval) != std::future_status::ready &&
         !work->is_stopped()) {
    if (options.goes_on && !options.goes_on(work->outcomes())) {
      return false;
    }
  }
  work->rethrow_failure();
  return true;
}

}  // namespace oblique::solver
