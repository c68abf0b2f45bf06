#pragma once

#include "worker/solver/contact/contact_law.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace.h"
#include "worker/solver/motion/motion.h"

namespace oblique::solver {

/// Solves one contact by any integrator, from `touch` (a state of `motion`, the tip on the ground)
/// to separation. Fills everything of the result but H, the fall time and the solver's name and
/// version. Throws SolveError when there is no answer.
CaseResult solve_contact(const Motion& motion, const ContactParameters& parameters,
                         const ContactSteps& steps, ChainState touch, const Tracing& tracing);

}  // namespace oblique::solver
