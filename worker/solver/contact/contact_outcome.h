#pragma once

#include "worker/solver/contact/contact.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace.h"
#include "worker/solver/motion/motion.h"

namespace oblique::solver {

/// Result of a finished contact, all but H, the fall time and the solver's report. `in` and `out`
/// are the energies at touch and separation. Throws SolveError when the energy balance misses so
/// much of the exchanged work that the step resolves nothing.
CaseResult contact_result(const Contact& contact, const ContactParameters& parameters,
                          const TipState& touch, const Energies& in, const Energies& out);

/// Hands the trace that is asked for on, row by row.
class ContactTracer {
 public:
  /// `motion` and `tracing` must outlive this. `tracing.sink` must be set.
  ContactTracer(const Motion& motion, const Tracing& tracing, const TipState& touch)
      : motion_(motion), tracing_(tracing), touch_y_m_(touch.y_m) {}

  /// At each accepted instant.
  void accepted(const Contact& contact, const ChainState& state) const;

 private:
  const Motion& motion_;
  const Tracing& tracing_;
  double touch_y_m_;
};

}  // namespace oblique::solver
