#pragma once

#include <vector>

#include "worker/solver/case_result.h"
#include "worker/solver/contact.h"
#include "worker/solver/motion.h"
#include "worker/solver/reaction_peaks.h"
#include "worker/solver/solve.h"

namespace oblique::solver {

/// Result of a finished contact, all but H, the fall time and the solver's report. `in` and `out`
/// are the energies at touch and separation. Throws SolveError when the energy balance misses so
/// much of the exchanged work that the step resolves nothing.
CaseResult contact_result(const Contact& contact, const ContactParameters& parameters,
                          const TipState& touch, const Energies& in, const Energies& out);

/// Serves what is asked for besides the result, at each accepted instant.
class ContactObserver {
 public:
  /// `motion` and `extras` must outlive this.
  ContactObserver(const Motion& motion, const Finger::Extras& extras, const TipState& touch)
      : motion_(motion), extras_(extras), touch_y_m_(touch.y_m) {}

  /// Whether anything is asked for at all.
  static bool is_needed(const Finger::Extras& extras) {
    return extras.reaction_peaks || extras.trace;
  }
  void accepted(const Contact& contact, const ChainState& state);
  std::vector<ReactionPeak> reaction_peaks() const;

 private:
  const Motion& motion_;
  const Finger::Extras& extras_;
  double touch_y_m_;
  ReactionPeaks peaks_;
};

}  // namespace oblique::solver
