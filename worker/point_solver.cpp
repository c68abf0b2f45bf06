#include "worker/point_solver.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <optional>

#include "proto/result_message.h"

namespace oblique::worker {
namespace {

protocol::PointResult message_of(const solver::PointOutcome& outcome) {
  if (!outcome.result) {
    return protocol::failed_point(outcome.number, outcome.error);
  }
  protocol::PointResult result = protocol::to_message(outcome.number, *outcome.result);
  return is_finite(result)
             ? result
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

bool is_finite(const protocol::PointResult& result) {
  const auto finite = [](double value) { return std::isfinite(value); };
  const auto all_finite = [&](const auto& values) {
    return std::all_of(values.begin(), values.end(), finite);
  };
  const double scalars[] = {result.fall_time_s(),
                            result.impact_x_m(),
                            result.vt_in_m_s(),
                            result.vn_in_m_s(),
                            result.duration_s(),
                            result.fn_peak_n(),
                            result.ft_peak_n(),
                            result.impulse_n_ns(),
                            result.impulse_t_ns(),
                            result.slide_m(),
                            result.vt_out_m_s(),
                            result.vn_out_m_s(),
                            result.stick_total_s(),
                            result.kinetic_in_j(),
                            result.friction_j(),
                            result.restitution_j(),
                            result.kinetic_change_j(),
                            result.strain_change_j(),
                            result.gravity_change_j(),
                            result.exchanged_j(),
                            result.closure(),
                            result.dt_s(),
                            result.wall_s()};
  return std::all_of(std::begin(scalars), std::end(scalars), finite) &&
         all_finite(result.peaks()) && all_finite(result.ft_peaks()) &&
         all_finite(result.phase_ends_s()) && all_finite(result.stick_intervals()) &&
         all_finite(result.reaction_peaks());
}

}  // namespace oblique::worker
