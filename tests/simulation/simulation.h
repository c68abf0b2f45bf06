#pragma once

#include <cstdint>
#include <string>

namespace oblique::simulation {

struct SimulationSettings {
  std::int64_t chaos_ms = 25'000;     ///< faults happen for so long
  std::int64_t healing_ms = 600'000;  ///< then all must come to its end within this
  /// A failed sync loses what it should have written and later ones succeed, as on Linux. SQLite
  /// cannot live with that: commits that were acknowledged after such a failure can be lost.
  bool forgetful_syncs = false;
  bool killers = false;  ///< some points kill their workers; no other fault happens then
  /// Beside one worker that nothing happens to but breaking connections, others are killed and
  /// halted again and again, connections are cut, and peers take batches and vanish. No point may
  /// fail for it. No other fault happens then.
  bool storms = false;
};

/// What happened in one run or more, to show that the faults were real.
struct SimulationOutcome {
  std::uint64_t points = 0;
  std::uint64_t failed_points = 0;
  std::uint64_t server_kills = 0;
  std::uint64_t power_losses = 0;
  std::uint64_t deaths_in_writes = 0;  ///< of the kills and losses of power
  std::uint64_t failed_syncs = 0;      ///< of these, too: each ends the server
  std::uint64_t server_stops = 0;
  std::uint64_t undone_commits = 0;  ///< that losing power undid
  std::uint64_t refused_kept = 0;    ///< commits that failed and were there after a crash
  std::uint64_t worker_faults = 0;
  std::uint64_t disk_faults = 0;     ///< times that the disk was full or failed
  std::uint64_t failed_commits = 0;  ///< because of that
  std::uint64_t partitions = 0;
  std::uint64_t clock_jumps = 0;
  std::uint64_t cuts = 0;            ///< of single connections, in storms
  std::uint64_t vanished_peers = 0;  ///< with batches
  std::uint64_t growths = 0;         ///< of studies
  std::uint64_t renamings = 0;
  std::uint64_t deletions = 0;
  std::uint64_t cleared_rows = 0;  ///< of deleted studies
  std::uint64_t deaths = 0;        ///< of workers, by points that kill
  std::uint64_t events = 0;
  std::int64_t healed_after_ms = 0;  ///< from the last fault to the end of the last study, at most

  SimulationOutcome& operator+=(const SimulationOutcome& other);
  std::string text() const;
  bool operator==(const SimulationOutcome&) const = default;
};

/// The real service, scheduler, store and worker conversations in a simulated world of crashes,
/// broken connections, partitions, jumping clocks, full and failing disks, torn writes and lost
/// power, all from one seed. Checks invariants after each event. Throws Violation (or
/// std::logic_error from an invariant) when something must not happen: an acknowledged result that
/// was not committed, a point stored twice, a store that lost more or other things than power may
/// take, an acknowledged study or change forgotten, a study not complete at the end, a wrong or
/// missing row, a damaged database, a lease that leaks. Not for several threads at once.
SimulationOutcome simulate(std::uint64_t seed, const SimulationSettings& settings);

}  // namespace oblique::simulation
