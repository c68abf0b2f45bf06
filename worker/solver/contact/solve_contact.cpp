#include "worker/solver/contact/solve_contact.h"

#include <chrono>
#include <cstddef>
#include <utility>

#include "worker/solver/contact/contact_outcome.h"
#include "worker/solver/contact/reaction_peaks.h"

namespace oblique::solver {

CaseResult solve_contact(const Motion& motion, const ContactParameters& parameters,
                         const ContactSteps& steps, ChainState accepted, const Tracing& tracing) {
  const auto started = std::chrono::steady_clock::now();
  const TipState touch = motion.tip(accepted);
  const Energies in = motion.energies(accepted);
  Contact contact(parameters, touch, steps);
  motion.restart(contact.force(), accepted);
  const ContactTracer tracer(motion, tracing, touch);
  Eigen::Matrix2Xd reactions_N;
  motion.reactions(contact.force(), accepted, reactions_N);
  ReactionPeaks reaction_peaks(static_cast<std::size_t>(reactions_N.cols()));
  Eigen::RowVectorXd squared_N2(reactions_N.cols());
  const auto observe = [&] {
    motion.reactions(contact.force(), accepted, reactions_N);
    squared_N2 = reactions_N.colwise().squaredNorm();
    reaction_peaks.set_span(0, contact.time_s(), 0.0);
    reaction_peaks.add(squared_N2.data());
    if (tracing.sink) {
      tracer.accepted(contact, accepted);
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
  CaseResult result = contact_result(contact, parameters, touch, in, motion.energies(accepted));
  result.reaction_peaks = reaction_peaks.peaks(0);
  result.solver.dt_s = steps.compression_s;
  result.solver.steps = contact.steps();
  result.solver.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace oblique::solver
