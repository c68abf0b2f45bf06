#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "tests/support/recipes.h"

namespace oblique::server {

/// A study of `points` points of one model.
inline std::shared_ptr<const protocol::PointTable> table_of(std::uint64_t points) {
  return std::make_shared<const protocol::PointTable>(protocol::recipe_of(
      {{protocol::listed("H", {1.0}), protocol::range("mu", 0.0, points == 1 ? 0.0 : 1.0, points),
        protocol::listed("e", {1.0})}}));
}

/// Returns the points of a batch message in the order in which a worker solves them.
inline std::vector<std::uint64_t> points_of(const protocol::Batch& batch) {
  std::vector<std::uint64_t> points;
  std::uint64_t reached = 0;
  for (int i = 0; i + 1 < batch.ranges_size(); i += 2) {
    reached += static_cast<std::uint64_t>(batch.ranges(i));
    for (std::int64_t count = batch.ranges(i + 1); count > 0; --count) {
      points.push_back(reached++);
    }
  }
  return points;
}

/// A solved point. Its invented outputs all differ, and none has a short decimal form.
inline protocol::PointResult solved_point(std::uint64_t point) {
  solver::CaseResult result{};
  const double third = 1.0 / 3.0 + static_cast<double>(point);
  result.fall_time_s = third * 1.0;
  result.duration_s = third * 1e-5;
  result.fn_peak_N = third * 1e4;
  result.energy.closure = third * 1e-9;
  result.mode = "SC SR sR";
  result.major_mode = "SC SR";
  result.margin = third * 1e-3;
  result.margin_event = "turn";
  result.errors.mode_same = point % 2 == 0 ? 1 : 0;
  result.errors.fn_peak = third * 1e-2;
  result.errors.v_out = third * 1e-1;
  result.peaks = {{0.0, third, 2.0, false}, {1e-5 / 3.0, third * 7.0, 1e30 / 3.0, true}};
  result.ft_peaks = {{third, -third}};
  result.phases = {{solver::PhaseKind::kCompression, 0.0, third * 1e-4},
                   {solver::PhaseKind::kRestitution, third * 1e-4, third * 2e-4},
                   {solver::PhaseKind::kCompression, third * 2e-4, third * 3e-4}};
  result.stick_intervals = {{0.0, third * 1e-6}};
  for (int joint = 1; joint <= 3; ++joint) {
    result.reaction_peaks.push_back({third * 1e-5 * joint, third * 1e3 / joint});
  }
  result.solver.steps = 1234;
  result.solver.wall_s = 0.25;
  return protocol::to_message(point, result);
}

/// A solved point with the inputs of the study `table`, as a worker sends it.
inline protocol::PointResult solved_point(std::uint64_t point, const protocol::PointTable& table) {
  protocol::PointResult result = solved_point(point);
  protocol::set_inputs(result, table);
  return result;
}

}  // namespace oblique::server
