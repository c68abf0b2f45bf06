#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::solver {

/// One accepted instant of a contact, or an instant of the fall before it, for traces.
struct TraceRow {
  double t_s;  ///< since touch
  double fn_N;
  double ft_N;
  double uy_m;  ///< normal deformation
  double ux_m;  ///< tangential deformation
  double xP_m;  ///< position of P
  double vP_m_s;
  double x_m;  ///< tip
  double y_m;
  double vt_m_s;
  double vn_m_s;
  std::string state;  ///< SC, SR, sC or sR; kFalling in the fall
  double kinetic_J;   ///< of the whole chain
  double strain_J;    ///< 0 when unstressed
  double gravity_J;   ///< 0 at the height of O
  double momentum_x_Ns;
  double momentum_y_Ns;
  /// Forces on the outer link at O and at each joint, x and y in turn [N].
  std::vector<double> reactions_N;
  /// Positions of the nodes, O first and the tip last, x and y in turn [m]; empty if not requested.
  std::vector<double> nodes_m;
};

/// TraceRow::state before touch, when forces and deformations are zero and P moves with the tip.
inline constexpr std::string_view kFalling = "falling";
/// Rows of the fall: evenly spaced from release to touch, both included.
inline constexpr int kFallRows = 121;

/// Whether a compression or restitution ended just before a row. `before` is the state of the
/// previous row, empty for the first row.
inline bool ends_phase(std::string_view before, std::string_view state) {
  return !before.empty() && before != kFalling && before.back() != state.back();
}

/// Selects the rows of a contact to compute, and receives them.
struct Tracing {
  using Sink = std::function<void(const TraceRow&)>;
  Sink sink;  ///< called at every accepted step, from touch to separation; may be empty
  bool with_shape = false;  ///< fill TraceRow::nodes_m
  bool with_fall = false;   ///< first pass kFallRows instants of the fall to `sink`
};

}  // namespace oblique::solver
