#include "worker/solver/motion/trace_of_chain.h"

#include <string>
#include <vector>

namespace oblique::solver {
namespace {

constexpr AffineContactForce<double> kNothingTouched{};

TraceRow falling_row(const Motion& motion, ChainState& state, double touch_s, bool with_shape) {
  const TipState tip = motion.tip(state);
  TraceRow row{};
  row.t_s = state.t_s - touch_s;
  row.xP_m = row.x_m = tip.x_m;
  row.vP_m_s = row.vt_m_s = tip.vx_m_s;
  row.y_m = tip.y_m;
  row.vn_m_s = tip.vy_m_s;
  row.state = kFalling;
  // Reactions are then those of this state, whatever step led there.
  motion.restart(kNothingTouched, state);
  tell_chain(motion, kNothingTouched, state, with_shape, row);
  return row;
}

}  // namespace

void tell_chain(const Motion& motion, const AffineContactForce<double>& force,
                const ChainState& state, bool with_shape, TraceRow& row) {
  const auto in_turn = [](const Eigen::Matrix2Xd& columns) {
    return std::vector<double>(columns.data(), columns.data() + columns.size());
  };
  Eigen::Matrix2Xd reactions_N;
  motion.reactions(force, state, reactions_N);
  row.reactions_N = in_turn(reactions_N);
  const Energies energies = motion.energies(state);
  row.kinetic_J = energies.kinetic_J;
  row.strain_J = energies.strain_J;
  row.gravity_J = energies.gravity_J;
  const Eigen::Vector2d momentum_Ns = motion.momentum_Ns(state);
  row.momentum_x_Ns = momentum_Ns.x();
  row.momentum_y_Ns = momentum_Ns.y();
  if (with_shape) {
    row.nodes_m = in_turn(motion.node_positions_m(state));
  }
}

void trace_fall(const Motion& motion, const Fall& fall, double H_m, const Tracing& tracing) {
  ChainState touch = fall.state_at(H_m);
  const double touch_s = touch.t_s;
  for (int i = 0; i + 1 < kFallRows; ++i) {
    ChainState state = fall.path()->state_at_time(touch_s * i / (kFallRows - 1));
    tracing.sink(falling_row(motion, state, touch_s, tracing.with_shape));
  }
  tracing.sink(falling_row(motion, touch, touch_s, tracing.with_shape));
}

}  // namespace oblique::solver
