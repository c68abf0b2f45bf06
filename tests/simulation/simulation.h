#pragma once

#include <cstdint>

namespace oblique::simulation {

struct SimulationSettings {
  std::int64_t chaos_ms = 25'000;     ///< faults happen for so long
  std::int64_t healing_ms = 600'000;  ///< then all must come to its end within this
  bool killers = false;  ///< some points kill their workers; no other fault happens then
};

/// What happened in one run, to show that the faults were real.
struct SimulationOutcome {
  std::uint64_t points = 0;
  std::uint64_t failed_points = 0;
  std::uint64_t server_crashes = 0;
  std::uint64_t worker_faults = 0;
  std::uint64_t events = 0;
  std::int64_t healed_after_ms = 0;  ///< from the last fault to the end of the last study
};

/// The real service, scheduler and worker conversations in a simulated world of crashes, broken
/// connections, full disks and lost power, all from one seed. Checks invariants after each event.
/// Throws Violation (or std::logic_error from an invariant) when something must not happen: an
/// acknowledged result that is not durable, a point stored twice, an acknowledged study forgotten
/// or not complete at the end, a wrong or missing row, a lease that leaks.
SimulationOutcome simulate(std::uint64_t seed, const SimulationSettings& settings);

}  // namespace oblique::simulation
