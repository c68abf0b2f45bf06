#include "worker/solver/reference/solve_contact.h"

#include <chrono>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/reference/contact_record.h"

namespace oblique::solver {
namespace {

/// Maximum error of the energy balance, relative to the exchanged energy. A larger error shows that
/// the step does not resolve the contact.
constexpr double kWorstClosure = 1e-2;
/// Smallest exchanged energy relative to the energies at touch; smaller ones are rounding errors.
constexpr double kLeastExchanged = 1e-10;

void balance(const Energies& in, const Energies& out, const ContactRecord& record,
             ContactEnergy& energy) {
  const double at_touch_J = in.kinetic_J + std::abs(in.strain_J) + std::abs(in.gravity_J);
  if (!(energy.exchanged_J > kLeastExchanged * at_touch_J)) {
    throw SolveError(
        "the tip touches the ground with hardly any speed, as at its largest drop: the " +
        readable_number(energy.exchanged_J) +
        " J that the contact exchanges drown in the rounding of the " +
        readable_number(at_touch_J) + " J of the finger");
  }
  energy.kinetic_in_J = in.kinetic_J;
  energy.kinetic_change_J = out.kinetic_J - in.kinetic_J;
  energy.strain_change_J = out.strain_J - in.strain_J;
  energy.gravity_change_J = out.gravity_J - in.gravity_J;
  const double missing_J = energy.kinetic_change_J + energy.strain_change_J +
                           energy.gravity_change_J - record.work_n_J() - record.work_t_J();
  energy.closure = std::abs(missing_J) / energy.exchanged_J;
  if (!(energy.closure < kWorstClosure)) {
    throw SolveError("the error of the energy balance of the contact is " +
                     readable_number(energy.closure) + " times the exchanged energy, more than " +
                     exact_number(kWorstClosure) + ": choose a shorter dt");
  }
}

/// A row with the values of the chain. Values of the contact are zero.
TraceRow chain_row(const Motion& motion, const AffineContactForce<double>& force,
                   const ChainState& state, bool with_shape) {
  const auto in_turn = [](const Eigen::Matrix2Xd& columns) {
    return std::vector<double>(columns.data(), columns.data() + columns.size());
  };
  TraceRow row{};
  const TipState tip = motion.tip(state);
  row.x_m = tip.x_m;
  row.y_m = tip.y_m;
  row.vt_m_s = tip.vx_m_s;
  row.vn_m_s = tip.vy_m_s;
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
  return row;
}

TraceRow falling_row(const Motion& motion, ChainState& state, double touch_s, bool with_shape) {
  motion.restart(kNoContact, state);  // so that reactions do not depend on the last step
  TraceRow row = chain_row(motion, kNoContact, state, with_shape);
  row.t_s = state.t_s - touch_s;
  row.xP_m = row.x_m;
  row.vP_m_s = row.vt_m_s;
  row.state = kFalling;
  return row;
}

}  // namespace

CaseResult contact_result(const Contact& contact, const TipState& touch, const Energies& in,
                          const Energies& out) {
  CaseResult result = contact.record().result();
  result.mu = contact.law().mu();
  result.e_star = contact.law().e_star();
  result.impact_x_m = touch.x_m;
  result.vt_in_m_s = touch.vx_m_s;
  result.vn_in_m_s = touch.vy_m_s;
  result.vt_out_m_s = contact.tip().vx_m_s;
  result.vn_out_m_s = contact.tip().vy_m_s;
  const ContactMargin::Nearest nearest = contact.margin().nearest(result.fn_peak_N);
  result.margin = nearest.distance;
  result.margin_event = nearest.event;
  balance(in, out, contact.record(), result.energy);
  result.solver.dt_s = contact.step_lengths().compression_s;
  result.solver.steps = contact.steps();
  return result;
}

void trace_instant(const Motion& motion, const Tracing& tracing, const TipState& touch,
                   const Contact& contact, const ChainState& state) {
  const ContactLaw& law = contact.law();
  const TipState& tip = contact.tip();
  TraceRow row = chain_row(motion, contact.force(), state, tracing.with_shape);
  row.t_s = contact.time_s();
  row.fn_N = law.fn_N(tip);
  row.ft_N = law.ft_N(tip);
  row.uy_m = tip.y_m - touch.y_m;
  row.ux_m = law.ux_m(tip);
  row.xP_m = tip.x_m - row.ux_m;
  row.vP_m_s = law.is_stick() ? 0.0 : law.slip_velocity_m_s(tip);
  row.state = {law.is_stick() ? 'S' : 's', law.is_compression() ? 'C' : 'R'};
  tracing.sink(row);
}

void trace_fall(const Motion& motion, const Fall& fall, double H_m, const Tracing& tracing) {
  ChainState touch = fall.state_at(H_m);
  const double touch_s = touch.t_s;
  for (int i = 0; i + 1 < kFallRows; ++i) {
    ChainState state = fall.state_at_time(touch_s * i / (kFallRows - 1));
    tracing.sink(falling_row(motion, state, touch_s, tracing.with_shape));
  }
  tracing.sink(falling_row(motion, touch, touch_s, tracing.with_shape));
}

CaseResult solve_contact(const Motion& motion, const ContactParameters& parameters,
                         const ContactSteps& steps, ChainState accepted, const Tracing& tracing) {
  const auto started = std::chrono::steady_clock::now();
  const TipState touch = motion.tip(accepted);
  const Energies in = motion.energies(accepted);
  Contact contact(parameters, touch, steps);
  motion.restart(contact.force(), accepted);
  Eigen::Matrix2Xd reactions_N;
  motion.reactions(contact.force(), accepted, reactions_N);
  ReactionPeaks reaction_peaks(static_cast<std::size_t>(reactions_N.cols()));
  Eigen::RowVectorXd squared_N2(reactions_N.cols());
  const auto observe = [&] {
    motion.reactions(contact.force(), accepted, reactions_N);
    squared_N2 = reactions_N.colwise().squaredNorm();
    reaction_peaks.add(contact.time_s(), 0.0, squared_N2.data());
    if (tracing.sink) {
      trace_instant(motion, tracing, touch, contact, accepted);
    }
  };
  observe();
  ChainState trial = accepted;
  while (!contact.finished()) {
    const auto integrals = motion.step(accepted, contact.force(), contact.trial_step_s(), trial);
    const int events = contact.events();
    if (!contact.judge(motion.tip(trial), integrals)) {
      continue;
    }
    std::swap(accepted, trial);
    if (contact.events() != events) {
      motion.restart(contact.force(), accepted);
    }
    observe();
  }
  CaseResult result = contact_result(contact, touch, in, motion.energies(accepted));
  result.reaction_peaks = reaction_peaks.peaks();
  result.solver.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace oblique::solver
