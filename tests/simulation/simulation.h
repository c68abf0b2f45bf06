#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace oblique::simulation {

struct SimulationSettings {
  std::int64_t chaos_ms = 25'000;     ///< duration of faults
  std::int64_t healing_ms = 600'000;  ///< time after the faults within which all studies must end
  /// If true, a failed sync loses its data and later syncs succeed, as on Linux. SQLite cannot
  /// handle that: commits acknowledged after such a failure can be lost.
  bool forgetful_syncs = false;
  /// If true, workers (all but one) are killed or frozen repeatedly, connections are cut, and peers
  /// take batches and disappear. There are no other faults, and no point may fail.
  bool storms = false;
};

/// Number of occurrences of each event, by name, in one or more runs; shows that faults happened.
using SimulationOutcome = std::map<std::string, std::uint64_t>;
void add(SimulationOutcome& all, const SimulationOutcome& more);
std::string text_of(const SimulationOutcome& outcome);

/// Runs the real service, scheduler, store and worker conversations in a simulated world. One seed
/// determines all faults: crashes, broken connections, partitions, jumping clocks, full and failing
/// disks, torn writes and power failures. Checks invariants after each event. Throws Violation (or
/// std::logic_error from an invariant) if: an acknowledged result was not committed, a point was
/// stored twice, a store lost data that must survive a power failure, an acknowledged study or
/// change is missing, a study is not complete at the end, a row is wrong or missing, a database is
/// damaged, or a lease remains at the end. Not thread-safe.
SimulationOutcome simulate(std::uint64_t seed, const SimulationSettings& settings);

}  // namespace oblique::simulation
