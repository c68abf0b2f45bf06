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
  std::uint64_t tag;    ///< the caller's name for it
  std::uint64_t group;  ///< cases of one group that follow each other differ in e* only
  const Chain* chain;   ///< must live until the outcome is given
  ContactParameters parameters;
  ContactSteps steps;
  const ChainState* touch;  ///< of the eliminated chain; read when the case is taken
};

/// A result (without H, fall time and solver name), or why there is none.
struct ContactOutcome {
  std::uint64_t tag;
  std::optional<CaseResult> result;
  std::string error;
};

/// Solves the contacts that `source` gives, until it gives nothing more, by the explicit integrator
/// side by side in vector lanes. Chains must have the shape of `shape` (links, elements a link),
/// which need not outlive the call. Outcomes come in the order in which contacts end. With
/// `tracing`, every case is traced.
///
/// A lane whose contact ends takes the next case at once, and a lane that locates an event steps
/// from its own saved state with a length of its own while the others go on. Cases of a group share
/// the contact up to its first turn, where e* begins to count. A case has the same bits whatever
/// lane, neighbours and group it had, and whether these have its chain or others. Cases of equal
/// chains that follow each other are the fastest.
void solve_contacts(const Chain& shape, const std::function<std::optional<ContactCase>()>& source,
                    const std::function<void(ContactOutcome&&)>& sink, const Tracing& tracing = {},
                    const LaneKernel& kernel = runnable_lane_kernels().front());

}  // namespace oblique::solver
