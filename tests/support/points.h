#pragma once

#include <cstdint>
#include <memory>

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

/// A solved point with made-up outputs that do not repeat and that no short decimal equals.
inline protocol::PointResult solved_point(std::uint64_t point) {
  protocol::PointResult result;
  const double third = 1.0 / 3.0 + static_cast<double>(point);
  result.set_point(point);
  result.set_fall_time_s(third * 1.0);
  result.set_duration_s(third * 1e-5);
  result.set_fn_peak_n(third * 1e4);
  result.set_closure(third * 1e-9);
  result.set_mode("SC SR sR");
  result.set_major_mode("SC SR");
  for (const double value : {0.0, third, 2.0, 1e-5 / 3.0, third * 7.0, 1e300 / 3.0}) {
    result.add_peaks(value);
  }
  result.add_major_peaks(1);
  result.add_ft_peaks(third);
  result.add_ft_peaks(-third);
  result.add_phase_ends_s(third * 1e-4);
  result.add_phase_ends_s(third * 2e-4);
  result.add_phase_ends_s(third * 3e-4);
  result.add_stick_intervals(0.0);
  result.add_stick_intervals(third * 1e-6);
  for (int joint = 0; joint < 3; ++joint) {
    result.add_reaction_peaks(third * 1e-5 * (joint + 1));
    result.add_reaction_peaks(third * 1e3 / (joint + 1));
  }
  result.set_steps(1234);
  result.set_wall_s(0.25);
  return result;
}

}  // namespace oblique::server
