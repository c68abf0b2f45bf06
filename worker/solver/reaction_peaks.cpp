#include "worker/solver/reaction_peaks.h"

#include <cmath>

namespace oblique::solver {
namespace {

/// Largest value of the parabola through three points whose middle one is the highest.
ReactionPeak parabola_peak(const std::array<double, 3>& t, const std::array<double, 3>& f) {
  const double left = (f[1] - f[0]) / (t[1] - t[0]);
  const double right = (f[2] - f[1]) / (t[2] - t[1]);
  const double curvature = (right - left) / (t[2] - t[0]);
  if (!(curvature < 0.0)) {
    return {t[1], f[1]};
  }
  const double slope = left + curvature * (t[1] - t[0]);  // at the middle point
  const double shift = -0.5 * slope / curvature;
  return {t[1] + shift, f[1] + 0.5 * slope * shift};
}

}  // namespace

void ReactionPeaks::add(double t_s, const std::vector<JointReaction>& reactions) {
  tracks_.resize(reactions.size());
  for (std::size_t i = 0; i < reactions.size(); ++i) {
    Track& track = tracks_[i];
    const double force = std::hypot(reactions[i].x_N, reactions[i].y_N);
    if (track.seen > 0 && !(t_s > track.t_s[2])) {
      continue;
    }
    track.t_s = {track.t_s[1], track.t_s[2], t_s};
    track.force_N = {track.force_N[1], track.force_N[2], force};
    ++track.seen;
    if (force > track.largest.force_N) {
      track.largest = {t_s, force};
    }
    if (track.seen >= 3 && track.force_N[1] >= track.force_N[0] &&
        track.force_N[1] >= track.force_N[2]) {
      const ReactionPeak peak = parabola_peak(track.t_s, track.force_N);
      if (peak.force_N > track.largest.force_N) {
        track.largest = peak;
      }
    }
  }
}

std::vector<ReactionPeak> ReactionPeaks::peaks() const {
  std::vector<ReactionPeak> peaks;
  for (const Track& track : tracks_) {
    peaks.push_back(track.largest);
  }
  return peaks;
}

}  // namespace oblique::solver
