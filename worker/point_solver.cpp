#include "worker/point_solver.h"

#include <exception>
#include <memory>
#include <optional>

#include "proto/result_message.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::worker {
namespace {

protocol::PointResult message_of(const solver::PointOutcome& outcome) {
  if (!outcome.result) {
    return protocol::failed_point(outcome.number, outcome.error);
  }
  return solver::is_finite(*outcome.result)
             ? protocol::to_message(outcome.number, *outcome.result)
             : protocol::failed_point(outcome.number, "the solver gave a value that is not finite");
}

}  // namespace

PointSolver::PointSolver(std::size_t models_kept) : fingers_(models_kept) {}

void PointSolver::solve(const Batch& batch, const BatchSolver::NextPoint& next,
                        const BatchSolver::TakeResult& take) {
  std::shared_ptr<const solver::Finger> finger;
  try {
    finger = fingers_.finger(batch.points->model(batch.model));
  } catch (const std::exception& error) {
    while (const auto point = next()) {
      take(protocol::failed_point(*point, error.what()));
    }
    return;
  }
  finger->solve_points(
      [&]() -> std::optional<solver::PointRequest> {
        const auto number = next();
        if (!number) {
          return std::nullopt;
        }
        const protocol::Point point = batch.points->point(*number);
        return solver::PointRequest{*number, point.H_m, point.mu, point.e_star};
      },
      [&](solver::PointOutcome&& outcome) { take(message_of(outcome)); });
}

}  // namespace oblique::worker
