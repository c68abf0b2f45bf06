#pragma once

namespace oblique::solver {

/// Tip position and velocity in the fixed frame, origin at O, y up.
struct TipState {
  double x_m;
  double y_m;
  double vx_m_s;
  double vy_m_s;
};

}  // namespace oblique::solver
