#pragma once

#include "worker/solver/model/trace.h"
#include "worker/solver/motion/fall.h"
#include "worker/solver/motion/motion.h"

namespace oblique::solver {

/// Fills what a row tells of the whole chain: reactions, energies, momentum, and where it is wanted
/// the shape.
void tell_chain(const Motion& motion, const AffineContactForce<double>& force,
                const ChainState& state, bool with_shape, TraceRow& row);

/// Hands kFallRows instants of the fall on, from release to the drop H_m. The last one is the touch
/// itself, as the contact's first row, but for the state and the velocity of P. Times in between
/// are met to a thousandth of a step. Throws what Fall::state_at throws.
void trace_fall(const Motion& motion, const Fall& fall, double H_m, const Tracing& tracing);

}  // namespace oblique::solver
