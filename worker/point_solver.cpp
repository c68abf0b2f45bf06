#include "worker/point_solver.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "worker/solver/estimate.h"
#include "worker/solver/model/fall_model.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::worker {
namespace {

/// Runs of points of one model that are looked at ahead of a point whose fall is missing, and
/// models of another fall than the one before among them that are kept in mind.
constexpr int kRunsAhead = 512;
constexpr std::size_t kFallsAhead = 64;

/// Falls of a model of usual size that a thread has in hand, and as many ahead.
constexpr std::size_t kBytesAThread = std::size_t{96} << 20;
constexpr std::size_t kFewestBytes = std::size_t{256} << 20;

protocol::PointResult message_of(const solver::PointOutcome& outcome) {
  if (!outcome.result) {
    return protocol::failed_point(outcome.number, outcome.error);
  }
  return solver::is_finite(*outcome.result)
             ? protocol::to_message(outcome.number, *outcome.result)
             : protocol::failed_point(outcome.number, "the solver gave a value that is not finite");
}

/// Models of the points of `batch` behind `point`, in order, those of one fall that follow each
/// other once.
std::vector<solver::ModelParameters> models_ahead(const Batch& batch, std::uint64_t point) {
  std::vector<solver::ModelParameters> models;
  const std::uint64_t end = batch.first_point + batch.count;
  for (int run = 0; run < kRunsAhead && models.size() < kFallsAhead; ++run) {
    const protocol::Segment segment = batch.points->segment_at(point);
    auto model = solver::fall_model(batch.points->model(segment.model));
    if (models.empty() || !(models.back() == model)) {
      models.push_back(std::move(model));
    }
    const std::uint64_t segment_end = segment.first_point + segment.count;
    if (segment_end >= end) {
      break;
    }
    point = batch.points->first_left_in(segment_end, end);
    if (point == end) {
      break;
    }
  }
  return models;
}

}  // namespace

PointSolver::PointSolver(std::size_t threads)
    : falls_({.bytes = std::max(kFewestBytes, threads * kBytesAThread)}) {}

/// Gives the points of a batch with their fingers. A point whose fall is missing ends a run of
/// points: those under way are solved first, since a fall may take long, and then it begins the
/// next run.
class PointSolver::BatchPoints {
 public:
  BatchPoints(solver::FallCache& falls, const Batch& batch, const BatchSolver::NextPoint& next,
              const BatchSolver::TakeResult& take)
      : falls_(falls), batch_(batch), next_(next), take_(take) {}

  /// Waits for the fall of the first point of a run. False when no point is left.
  bool begin_run() {
    while (!first_) {
      if (!held_ && !(held_ = next_())) {
        return false;
      }
      const std::uint64_t number = *std::exchange(held_, std::nullopt);
      first_ = point_of(number, [&](const solver::ModelParameters& model) {
        return std::optional(falls_.fall(model, models_ahead(batch_, number)));
      });
    }
    return true;
  }

  /// The next point of the run.
  std::optional<solver::FingerPoint> next() {
    if (first_) {
      return std::exchange(first_, std::nullopt);
    }
    while (!held_ && (held_ = next_())) {
      const std::uint64_t number = *held_;
      bool is_missing = false;
      auto point = point_of(number, [&](const solver::ModelParameters& model) {
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
  std::optional<solver::FingerPoint> point_of(std::uint64_t number, const FallOf& fall_of) {
    try {
      if (const std::string fault = batch_.points->fault(number); !fault.empty()) {
        throw solver::InputError(fault);
      }
      const protocol::Point point = batch_.points->point(number);
      if (!finger_ || point.model != model_) {
        finger_.reset();
        const solver::ModelParameters model = batch_.points->model(point.model);
        const std::optional<solver::FallOutcome> fall = fall_of(model);
        if (!fall) {
          return std::nullopt;
        }
        if (!fall->fallen) {
          throw solver::SolveError(fall->error);
        }
        finger_.emplace(model, fall->fallen);
        model_ = point.model;
      }
      return solver::FingerPoint{*finger_, {number, point.H_m, point.mu, point.e_star}};
    } catch (const std::exception& error) {
      take_(protocol::failed_point(number, error.what()));
      return std::nullopt;
    }
  }

  solver::FallCache& falls_;
  const Batch& batch_;
  const BatchSolver::NextPoint& next_;
  const BatchSolver::TakeResult& take_;
  std::optional<std::uint64_t> held_;         ///< a point taken whose fall was missing
  std::optional<solver::FingerPoint> first_;  ///< of the run that has begun
  std::optional<solver::Finger> finger_;      ///< of the point given last
  std::uint64_t model_ = 0;                   ///< its model's number
};

std::vector<solver::FallOutcome> PointSolver::falls_of(
    std::span<const solver::ModelParameters> models) {
  std::vector<solver::FallOutcome> falls;
  for (std::size_t i = 0; i < models.size(); ++i) {
    falls.push_back(falls_.fall(models[i], models.subspan(i + 1)));
  }
  return falls;
}

void PointSolver::solve(const Batch& batch, const BatchSolver::NextPoint& next,
                        const BatchSolver::TakeResult& take) {
  BatchPoints points(falls_, batch, next, take);
  const auto next_of_run = [&] { return points.next(); };
  const auto take_outcome = [&](solver::PointOutcome&& outcome) { take(message_of(outcome)); };
  while (points.begin_run()) {
    if (batch.points->wants_errors()) {
      solver::solve_points_with_errors(
          next_of_run,
          [this](std::span<const solver::ModelParameters> models) { return falls_of(models); },
          take_outcome);
    } else {
      solver::solve_points(next_of_run, take_outcome);
    }
  }
}

protocol::PointResult PointSolver::trace(const protocol::TraceOrder& order,
                                         const solver::Tracing::Sink& sink) {
  constexpr std::uint64_t kNumber = 0;
  try {
    const solver::ModelParameters model = protocol::from_message(order.model());
    const solver::FallOutcome fall = falls_.fall(model);
    if (!fall.fallen) {
      throw solver::SolveError(fall.error);
    }
    const solver::Finger finger(model, fall.fallen);
    auto result =
        finger.solve(order.h_m(), order.mu(), order.e_star(), {sink, order.shape(), order.fall()});
    if (order.errors()) {
      result.errors = solver::errors_by_companion(
          model, result,
          [this](std::span<const solver::ModelParameters> models) { return falls_of(models); });
    }
    return message_of({kNumber, std::move(result), {}});
  } catch (const std::exception& error) {
    return protocol::failed_point(kNumber, error.what());
  }
}

}  // namespace oblique::worker
