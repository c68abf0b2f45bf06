#pragma once

#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace.h"
#include "worker/solver/reference/contact.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/motion.h"

namespace oblique::solver {

/// Solves one contact by any integrator, from the state `touch` of `motion` to separation. The
/// result lacks H, the fall time and the solver's name and version. Throws SolveError when there is
/// no answer.
CaseResult solve_contact(const Motion& motion, const ContactParameters& parameters,
                         const ContactSteps& steps, ChainState touch, const Tracing& tracing);

/// Result of a finished contact without H, fall time, reactions and the solver's name, version and
/// time. `in` and `out` are the energies at touch and separation. Throws SolveError when the energy
/// balance shows that the step is too long.
CaseResult contact_result(const Contact& contact, const TipState& touch, const Energies& in,
                          const Energies& out);

/// Passes the row of an accepted instant to tracing.sink, which must be set.
void trace_instant(const Motion& motion, const Tracing& tracing, const TipState& touch,
                   const Contact& contact, const ChainState& state);

/// Passes kFallRows instants of the fall to tracing.sink, from release to the touch at drop H_m.
/// Times are exact to a thousandth of a step. Throws exceptions of Fall::state_at.
void trace_fall(const Motion& motion, const Fall& fall, double H_m, const Tracing& tracing);

}  // namespace oblique::solver
