#include "worker/solver/solve_contact.h"

#include <chrono>
#include <optional>
#include <utility>

#include "worker/solver/contact_outcome.h"

namespace oblique::solver {

CaseResult solve_contact(const Motion& motion, const ContactParameters& parameters,
                         const ContactSteps& steps, ChainState accepted,
                         const Finger::Extras& extras) {
  const auto started = std::chrono::steady_clock::now();
  const TipState touch = motion.tip(accepted);
  const Energies in = motion.energies(accepted);
  Contact contact(parameters, touch, steps);
  motion.restart(contact.force(), accepted);
  std::optional<ContactObserver> observer;
  if (ContactObserver::is_needed(extras)) {
    observer.emplace(motion, extras, touch);
    observer->accepted(contact, accepted);
  }
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
    if (observer) {
      observer->accepted(contact, accepted);
    }
  }
  CaseResult result = contact_result(contact, parameters, touch, in, motion.energies(accepted));
  if (observer) {
    result.reaction_peaks = observer->reaction_peaks();
  }
  result.solver.dt_s = steps.compression_s;
  result.solver.steps = contact.steps();
  result.solver.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace oblique::solver
