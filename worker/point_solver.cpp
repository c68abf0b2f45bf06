#include "worker/point_solver.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "worker/solver/estimate.h"
#include "worker/solver/point_runs.h"

namespace oblique::worker {
namespace {

protocol::PointResult message_of(const solver::Outcome& outcome) {
  return outcome.result ? protocol::to_message(outcome.number, *outcome.result)
                        : protocol::failed_point(outcome.number, outcome.error);
}

/// The points of a batch that a thread is given.
class BatchPoints : public solver::PointSource {
 public:
  BatchPoints(const Batch& batch, const BatchSolver::NextPoint& next)
      : batch_(batch), next_(next) {}

  std::optional<std::uint64_t> next() override {
    const auto position = next_();
    position_ = position.value_or(position_);
    return position ? std::optional(batch_.point_at(*position)) : std::nullopt;
  }

  solver::ModelPoint point(std::uint64_t number) override {
    if (const std::string fault = batch_.points().fault(number); !fault.empty()) {
      throw solver::InputError(fault);
    }
    const protocol::Point point = batch_.points().point(number);
    return {point.model, {point.H_m, point.mu, point.e_star}};
  }

  solver::ModelParameters model(std::uint64_t number) override {
    return batch_.points().model(number);
  }

  std::vector<solver::ModelParameters> models_ahead() override {
    std::vector<solver::ModelParameters> models;
    std::uint64_t at = position_;
    for (int run = 0;
         run < solver::kRunsAhead && models.size() < solver::kFallsAhead && at < batch_.size();
         ++run) {
      const protocol::Segment segment = batch_.points().segment_at(batch_.point_at(at));
      solver::add_ahead(models, batch_.points().model(segment.model));
      at = batch_.first_to_solve(batch_.end_of_model(at), batch_.size());
    }
    return models;
  }

 private:
  const Batch& batch_;
  const BatchSolver::NextPoint& next_;
  std::uint64_t position_ = 0;  ///< of the point given last
};

}  // namespace

void PointSolver::solve(const Batch& batch, const BatchSolver::NextPoint& next,
                        const BatchSolver::TakeResult& take) {
  BatchPoints points(batch, next);
  solver::solve_points_of_models(points, falls_, batch.points().wants_errors(),
                                 [&](solver::Outcome&& outcome) {
                                   protocol::PointResult result = message_of(outcome);
                                   protocol::set_inputs(result, batch.points());
                                   take(std::move(result));
                                 });
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
      result.errors = solver::errors_by_companion(model, result, falls_);
    }
    return message_of({kNumber, std::move(result), {}});
  } catch (const std::exception& error) {
    return protocol::failed_point(kNumber, error.what());
  }
}

}  // namespace oblique::worker
