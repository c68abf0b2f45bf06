#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace oblique::simulation {

struct SimulationSettings {
  std::int64_t chaos_ms = 25'000;     ///< faults happen for so long
  std::int64_t healing_ms = 600'000;  ///< then all must come to its end within this
  /// A failed sync loses what it should have written and later ones succeed, as on Linux. SQLite
  /// cannot live with that: commits that were acknowledged after such a failure can be lost.
  bool forgetful_syncs = false;
  /// Beside one worker that nothing happens to but breaking connections, others are killed and
  /// halted again and again, connections are cut, and peers take batches and vanish. No point may
  /// fail for it. No other fault happens then.
  bool storms = false;
};

/// How often things happened in one run or more, by name, to show that the faults were real.
using SimulationOutcome = std::map<std::string, std::uint64_t>;
void add(SimulationOutcome& all, const SimulationOutcome& more);
std::string text_of(const SimulationOutcome& outcome);

/// The real service, scheduler, store and worker conversations in a simulated world of crashes,
/// broken connections, partitions, jumping clocks, full and failing disks, torn writes and lost
/// power, all from one seed. Checks invariants after each event. Throws Violation (or
/// std::logic_error from an invariant) when something must not happen: an acknowledged result that
/// was not committed, a point stored twice, a store that lost more or other things than power may
/// take, an acknowledged study or change forgotten, a study not complete at the end, a wrong or
/// missing row, a damaged database, a lease that leaks. Not for several threads at once.
SimulationOutcome simulate(std::uint64_t seed, const SimulationSettings& settings);

}  // namespace oblique::simulation
