#include "worker/solver/solve_contact.h"

#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

#include "worker/solver/contact.h"
#include "worker/solver/errors.h"
#include "worker/solver/reaction_peaks.h"

namespace oblique::solver {
namespace {

/// A balance that misses this much of the exchanged work means the step resolves nothing.
constexpr double kWorstClosure = 1e-2;

void balance(const Energies& in, const Energies& out, const ContactRecord& record,
             ContactEnergy& energy) {
  energy.kinetic_in_J = in.kinetic_J;
  energy.kinetic_change_J = out.kinetic_J - in.kinetic_J;
  energy.strain_change_J = out.strain_J - in.strain_J;
  energy.gravity_change_J = out.gravity_J - in.gravity_J;
  const double missing_J = energy.kinetic_change_J + energy.strain_change_J +
                           energy.gravity_change_J - record.work_n_J() - record.work_t_J();
  energy.closure = std::abs(missing_J) / energy.exchanged_J;
  if (!(energy.closure < kWorstClosure)) {
    std::ostringstream message;
    message << "the energy balance of the contact misses " << energy.closure
            << " of the exchanged work, more than " << kWorstClosure << ": dt is too long";
    throw SolveError(message.str());
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

/// Serves what is asked for besides the result, at each accepted instant.
class Observer {
 public:
  Observer(const Motion& motion, const Finger::Extras& extras, double touch_y_m)
      : motion_(motion), extras_(extras), touch_y_m_(touch_y_m) {}

  void accepted(const Contact& contact, const ChainState& state) {
    if (!extras_.trace && !extras_.reaction_peaks) {
      return;
    }
    const auto reactions = motion_.reactions(contact.force(), state);
    if (extras_.reaction_peaks) {
      peaks_.add(contact.time_s(), reactions);
    }
    if (extras_.trace) {
      TraceRow row = trace_row(contact, touch_y_m_);
      for (const auto& reaction : reactions) {
        row.reactions_N.insert(row.reactions_N.end(), {reaction.x_N, reaction.y_N});
      }
      extras_.trace(row);
    }
  }
  std::vector<ReactionPeak> reaction_peaks() const { return peaks_.peaks(); }

 private:
  const Motion& motion_;
  const Finger::Extras& extras_;
  double touch_y_m_;
  ReactionPeaks peaks_;
};

}  // namespace

CaseResult solve_contact(const Motion& motion, const ContactParameters& parameters,
                         const ContactSteps& steps, ChainState accepted,
                         const Finger::Extras& extras) {
  const auto started = std::chrono::steady_clock::now();
  const TipState touch = motion.tip(accepted);
  const Energies energies_in = motion.energies(accepted);
  Contact contact(parameters, touch, steps);
  motion.restart(contact.force(), accepted);
  Observer observer(motion, extras, touch.y_m);
  observer.accepted(contact, accepted);
  ChainState trial = accepted;
  while (!contact.finished()) {
    const auto integrals = motion.step(accepted, contact.force(), contact.trial_step_s(), trial);
    const int events = contact.events();
    if (contact.judge(motion.tip(trial), integrals)) {
      std::swap(accepted, trial);
      if (contact.events() != events) {
        motion.restart(contact.force(), accepted);
      }
      observer.accepted(contact, accepted);
    }
  }

  CaseResult result{};
  result.mu = parameters.mu;
  result.e_star = parameters.e_star;
  result.impact_x_m = touch.x_m;
  result.vt_in_m_s = touch.vx_m_s;
  result.vn_in_m_s = touch.vy_m_s;
  const TipState out = motion.tip(accepted);
  result.vt_out_m_s = out.vx_m_s;
  result.vn_out_m_s = out.vy_m_s;
  contact.record().write_to(result);
  result.reaction_peaks = observer.reaction_peaks();
  balance(energies_in, motion.energies(accepted), contact.record(), result.energy);
  result.solver.dt_s = steps.compression_s;
  result.solver.steps = contact.steps();
  result.solver.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace oblique::solver
