#include "worker/solver/reference/reaction_peaks.h"

#include <algorithm>
#include <cmath>

namespace oblique::solver {

void ReactionPeaks::Reaction::keep_larger(const ReactionPeak& peak) {
  /// A parabola through three neighbours rises above the middle one by less than a twentieth of it
  /// where steps resolve the motion: lower values need no look.
  constexpr double kWorthALook = 0.9;
  if (peak.force_N > largest.force_N) {
    largest = peak;
    worth_a_look_N2 = kWorthALook * peak.force_N * peak.force_N;
  }
}

void ReactionPeaks::look(Reaction& reaction, const Span& next, double next_N2) const {
  if (reaction.last_N2 < 0.0) {
    return;  // `next` is the first value
  }
  const double middle_N = std::sqrt(reaction.last_N2);
  const double right = (std::sqrt(next_N2) - middle_N) / (next.middle_s - last_.middle_s);
  if (reaction.before_N2 < 0.0) {
    // Falling from the first value on: the straight line through the first two, at the start.
    const double back_s = right <= 0.0 ? 0.5 * last_.width_s : 0.0;
    reaction.keep_larger({last_.middle_s - back_s, middle_N - right * back_s});
    return;
  }
  const double left =
      (middle_N - std::sqrt(reaction.before_N2)) / (last_.middle_s - before_.middle_s);
  const double curvature = (right - left) / (next.middle_s - before_.middle_s);
  ReactionPeak peak{last_.middle_s, middle_N};
  if (curvature < 0.0) {
    const double slope = left + curvature * (last_.middle_s - before_.middle_s);
    const double shift_s = -0.5 * slope / curvature;
    peak.t_s += shift_s;
    peak.force_N += 0.5 * slope * shift_s - curvature * last_.width_s * last_.width_s / 12.0;
  }
  reaction.keep_larger(peak);
}

std::vector<ReactionPeak> ReactionPeaks::peaks() const {
  std::vector<ReactionPeak> peaks;
  peaks.reserve(reactions_.size());
  for (const Reaction& reaction : reactions_) {
    // Rising up to the last value: the straight line through the last two, at the end.
    ReactionPeak end{last_.middle_s, std::sqrt(std::max(reaction.last_N2, 0.0))};
    if (reaction.before_N2 >= 0.0 && reaction.last_N2 >= reaction.before_N2) {
      const double rise_N_s =
          (end.force_N - std::sqrt(reaction.before_N2)) / (last_.middle_s - before_.middle_s);
      end.t_s += 0.5 * last_.width_s;
      end.force_N += rise_N_s * 0.5 * last_.width_s;
    }
    peaks.push_back(end.force_N > reaction.largest.force_N ? end : reaction.largest);
  }
  return peaks;
}

bool ReactionPeaks::rises_at_end() const {
  return std::any_of(reactions_.begin(), reactions_.end(), [](const Reaction& reaction) {
    return reaction.last_N2 > reaction.worth_a_look_N2 && reaction.last_N2 >= reaction.before_N2;
  });
}

}  // namespace oblique::solver
