#include "worker/solver/contact/solve_contact.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

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
  std::vector<double> squared_N2(motion.reactions(contact.force(), accepted).size());
  ReactionPeaks reaction_peaks(squared_N2.size());
  const auto observe = [&] {
    const auto reactions = motion.reactions(contact.force(), accepted);
    std::transform(reactions.begin(), reactions.end(), squared_N2.begin(),
                   [](const JointReaction& r) { return r.x_N * r.x_N + r.y_N * r.y_N; });
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
