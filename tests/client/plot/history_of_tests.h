#pragma once

#include <string>

#include "client/plot/point_figure.h"

namespace oblique::client::plot::test {

/// A made-up contact of 200 us at rising and falling force: it sticks for a quarter of the time, is
/// compressed for a half, and e* = 0.5 makes restitution four times as stiff.
inline PointHistory small_history() {
  PointHistory history{.name = "Point 3 of a study",
                       .model = solver::preset("paper"),
                       .H_m = 1.0,
                       .mu = 1.2,
                       .e_star = 0.5};
  constexpr int kSteps = 20;
  for (int i = 0; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    const double force_N = 4000.0 * share * (1.0 - share);
    const bool compresses = i < kSteps / 2;
    const double depth_m = compresses ? force_N / 1e7 : 1e-4 - (1000.0 - force_N) / 4e7;
    const bool sticks = i < kSteps / 4;
    const double xP_m = sticks ? 0.6 : 0.6 - 1e-4 * (share - 0.25);
    const double ux_m = -force_N / 1e7;
    history.rows.push_back({.t_s = 2e-4 * share,
                            .fn_N = force_N,
                            .ft_N = force_N,
                            .uy_m = -depth_m,
                            .ux_m = ux_m,
                            .xP_m = xP_m,
                            .vP_m_s = sticks ? 0.0 : -0.5,
                            .x_m = xP_m + ux_m,
                            .y_m = -1.0 - depth_m,
                            .vt_m_s = -5.0 + 4.0 * share,
                            .vn_m_s = -5.0 + 10.0 * share,
                            .state = std::string(sticks ? "S" : "s") + (compresses ? "C" : "R"),
                            .kinetic_J = 9.0 - share,
                            .strain_J = 0.5 * share,
                            .gravity_J = -3.0,
                            .momentum_x_Ns = 0.0,
                            .momentum_y_Ns = 0.0,
                            .reactions_N = {},
                            .nodes_m = {0.0, 0.0, 0.3, -0.75, 0.6 - 0.001 * share, -1.0}});
  }
  history.falls = {{0.5, {0.0, 0.0, 0.4, -0.5, 0.9, -0.5}}};
  return history;
}

}  // namespace oblique::client::plot::test
