#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/model/trace.h"
#include "worker/solver/reference/solve_contact.h"

namespace oblique::solver {

/// A contact to solve, from touch on.
struct ContactCase {
  std::uint64_t number;  ///< the caller's, in the outcome
  std::uint64_t group;   ///< cases of one group that follow each other differ in e* only
  const Chain* chain;    ///< must live until the outcome is given
  ContactParameters parameters;
  ContactSteps steps;
  const ChainState* touch;  ///< of the eliminated chain; read when the case is taken
};

/// Solves the contacts that `source` gives, until it gives nothing more, by the explicit integrator
/// side by side in vector lanes (README.md). Chains must have the shape of `shape` (links, elements
/// a link), which need not outlive the call. Outcomes, without H, fall time and solver name, come
/// in the order in which contacts end; each has the same bits whatever its lane, neighbours and
/// group. With `tracing`, every case is traced.
void solve_contacts(const Chain& shape, const std::function<std::optional<ContactCase>()>& source,
                    const std::function<void(Outcome&&)>& sink, const Tracing& tracing = {},
                    const LaneKernel& kernel = runnable_lane_kernels().front());

}  // namespace oblique::solver
