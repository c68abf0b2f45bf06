#include "worker/solver/point_runs.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "worker/solver/estimate.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/fall_model.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::solver {
namespace {

constexpr std::uint64_t kLargestTask = 32;

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
        return std::optional(falls_.fall(model, source_.models_ahead()));
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

  FallCache& falls_;
  PointSource& source_;
  const TakeOutcome& sink_;
  std::optional<std::uint64_t> held_;  ///< a point taken whose fall was missing
  std::optional<FingerPoint> first_;   ///< of the run that has begun
  std::optional<Finger> finger_;       ///< of the point given last
  std::uint64_t model_ = 0;            ///< its model's number
};

}  // namespace

void add_ahead(std::vector<ModelParameters>& models, const ModelParameters& model) {
  auto falling = fall_model(model);
  if (models.empty() || !(models.back() == falling)) {
    models.push_back(std::move(falling));
  }
}

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
  return std::clamp<std::uint64_t>(left / (4 * threads), 1, kLargestTask);
}

}  // namespace oblique::solver
