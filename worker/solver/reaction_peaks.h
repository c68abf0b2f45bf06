#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "worker/solver/case_result.h"
#include "worker/solver/motion.h"

namespace oblique::solver {

/// The largest magnitude of each reaction over a contact, by a parabola through the three instants
/// around the largest one seen.
class ReactionPeaks {
 public:
  /// Instants come in order; equal instants (both sides of an event) count once.
  void add(double t_s, const std::vector<JointReaction>& reactions);
  std::vector<ReactionPeak> peaks() const;

 private:
  struct Track {
    std::array<double, 3> t_s{};      ///< the last three instants
    std::array<double, 3> force_N{};  ///< and magnitudes there
    std::size_t seen = 0;
    ReactionPeak largest{0.0, 0.0};
  };
  std::vector<Track> tracks_;
};

}  // namespace oblique::solver
