#include "worker/solver/contact/contact_outcome.h"

#include <cmath>
#include <string>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/motion/trace_of_chain.h"

namespace oblique::solver {
namespace {

/// A balance that misses this much of the exchanged work means the step resolves nothing.
constexpr double kWorstClosure = 1e-2;
/// Work below this fraction of the energies at touch drowns in their rounding.
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
    throw SolveError("the energy balance of the contact misses " + readable_number(energy.closure) +
                     " of the exchanged work, more than " + exact_number(kWorstClosure) +
                     ": dt is too long");
  }
}

TraceRow trace_row(const Contact& contact, double touch_y_m) {
  const ContactLaw& law = contact.law();
  const TipState& tip = contact.tip();
  TraceRow row{};
  row.t_s = contact.time_s();
  row.fn_N = law.fn_N(tip);
  row.ft_N = law.ft_N(tip);
  row.uy_m = tip.y_m - touch_y_m;
  row.ux_m = law.ux_m(tip);
  row.xP_m = tip.x_m - row.ux_m;
  row.vP_m_s = law.is_stick() ? 0.0 : law.slip_velocity_m_s(tip);
  row.x_m = tip.x_m;
  row.y_m = tip.y_m;
  row.vt_m_s = tip.vx_m_s;
  row.vn_m_s = tip.vy_m_s;
  row.state = {law.is_stick() ? 'S' : 's', law.is_compression() ? 'C' : 'R'};
  return row;
}

}  // namespace

CaseResult contact_result(const Contact& contact, const ContactParameters& parameters,
                          const TipState& touch, const Energies& in, const Energies& out) {
  CaseResult result{};
  result.mu = parameters.mu;
  result.e_star = parameters.e_star;
  result.impact_x_m = touch.x_m;
  result.vt_in_m_s = touch.vx_m_s;
  result.vn_in_m_s = touch.vy_m_s;
  result.vt_out_m_s = contact.tip().vx_m_s;
  result.vn_out_m_s = contact.tip().vy_m_s;
  contact.record().write_to(result);
  const ContactMargin::Nearest nearest = contact.margin().nearest(result.fn_peak_N);
  result.margin = nearest.distance;
  result.margin_event = ContactMargin::name_of(nearest.event);
  balance(in, out, contact.record(), result.energy);
  return result;
}

void ContactTracer::accepted(const Contact& contact, const ChainState& state) const {
  TraceRow row = trace_row(contact, touch_y_m_);
  tell_chain(motion_, contact.force(), state, tracing_.with_shape, row);
  tracing_.sink(row);
}

}  // namespace oblique::solver
