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
#include "worker/solver/library/point_runs.h"

namespace oblique::worker {
namespace {

protocol::PointResult message_of(const solver::PointOutcome& outcome) {
  return outcome.result ? protocol::to_message(outcome.number, *outcome.result)
                        : protocol::failed_point(outcome.number, outcome.error);
}

/// The points of a batch that a thread is given.
class BatchPoints : public solver::PointSource {
 public:
  BatchPoints(const Batch& batch, const BatchSolver::NextPoint& next)
      : batch_(batch), next_(next) {}

  std::optional<std::uint64_t> next() override { return next_(); }

  solver::ModelPoint point(std::uint64_t number) override {
    if (const std::string fault = batch_.points->fault(number); !fault.empty()) {
      throw solver::InputError(fault);
    }
    const protocol::Point point = batch_.points->point(number);
    return {point.model, point.H_m, point.mu, point.e_star};
  }

  solver::ModelParameters model(std::uint64_t number) override {
    return batch_.points->model(number);
  }

  std::vector<solver::ModelParameters> models_ahead(std::uint64_t point) override {
    std::vector<solver::ModelParameters> models;
    const std::uint64_t end = batch_.first_point + batch_.count;
    for (int run = 0; run < solver::kRunsAhead && models.size() < solver::kFallsAhead; ++run) {
      const protocol::Segment segment = batch_.points->segment_at(point);
      solver::add_ahead(models, batch_.points->model(segment.model));
      const std::uint64_t segment_end = segment.first_point + segment.count;
      if (segment_end >= end) {
        break;
      }
      point = batch_.first_to_solve(segment_end, end);
      if (point == end) {
        break;
      }
    }
    return models;
  }

 private:
  const Batch& batch_;
  const BatchSolver::NextPoint& next_;
};

}  // namespace

PointSolver::PointSolver(std::size_t threads)
    : falls_({.bytes = solver::bytes_of_falls(threads)}) {}

void PointSolver::solve(const Batch& batch, const BatchSolver::NextPoint& next,
                        const BatchSolver::TakeResult& take) {
  BatchPoints points(batch, next);
  solver::solve_points_of_models(
      points, falls_, batch.points->wants_errors(),
      [&take](solver::PointOutcome&& outcome) { take(message_of(outcome)); });
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
          model, result, [this](std::span<const solver::ModelParameters> models) {
            return solver::falls_of(falls_, models);
          });
    }
    return message_of({kNumber, std::move(result), {}});
  } catch (const std::exception& error) {
    return protocol::failed_point(kNumber, error.what());
  }
}

}  // namespace oblique::worker
