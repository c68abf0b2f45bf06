#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/model/trace.h"
#include "worker/solver/reference/solve_contact.h"

namespace oblique::solver {

/// A contact to solve.
struct ContactCase {
  std::uint64_t number;  ///< of the outcome
  std::uint64_t group;   ///< consecutive cases of one group differ only in e*
  const Chain* chain;    ///< must live until the outcome is passed on
  ContactParameters parameters;
  ContactSteps steps;
  const ChainState* touch;  ///< must live until the next case is taken from the source
};

/// Solves the contacts of `source` by the explicit integrator, side by side in vector lanes
/// (README.md). All chains must have the shape of `shape`. Outcomes lack H, fall time and solver
/// name, and come in the order in which contacts end. Each has the same bits in any lane, with any
/// neighbours and group. Traces all cases if `tracing` has a sink.
void solve_contacts(const Chain& shape, const std::function<std::optional<ContactCase>()>& source,
                    const std::function<void(Outcome&&)>& sink, const Tracing& tracing = {},
                    const LaneKernel& kernel = runnable_lane_kernels().front());

}  // namespace oblique::solver
