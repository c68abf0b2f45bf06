// What happened in runs, summed up and as text.
#include <algorithm>

#include "tests/simulation/simulation.h"

namespace oblique::simulation {

SimulationOutcome& SimulationOutcome::operator+=(const SimulationOutcome& other) {
  points += other.points;
  failed_points += other.failed_points;
  server_kills += other.server_kills;
  power_losses += other.power_losses;
  deaths_in_writes += other.deaths_in_writes;
  failed_syncs += other.failed_syncs;
  server_stops += other.server_stops;
  undone_commits += other.undone_commits;
  refused_kept += other.refused_kept;
  worker_faults += other.worker_faults;
  disk_faults += other.disk_faults;
  failed_commits += other.failed_commits;
  partitions += other.partitions;
  clock_jumps += other.clock_jumps;
  growths += other.growths;
  renamings += other.renamings;
  deletions += other.deletions;
  cleared_rows += other.cleared_rows;
  cuts += other.cuts;
  vanished_peers += other.vanished_peers;
  deaths += other.deaths;
  events += other.events;
  healed_after_ms = std::max(healed_after_ms, other.healed_after_ms);
  return *this;
}

std::string SimulationOutcome::text() const {
  using std::to_string;
  return to_string(points) + " points, " + to_string(failed_points) + " of them killers of " +
         to_string(deaths) + " workers; " + to_string(server_kills) + " servers killed, " +
         to_string(power_losses) + " losses of power, " + to_string(deaths_in_writes) +
         " of these in the middle of a write, " + to_string(failed_syncs) +
         " after a failed sync, " + to_string(server_stops) + " servers stopped; " +
         to_string(undone_commits) + " commits undone by losing power, " + to_string(refused_kept) +
         " refused ones found after a crash; " + to_string(disk_faults) + " faults of disks, " +
         to_string(failed_commits) + " commits failed; " + to_string(worker_faults) +
         " faults of workers, " + to_string(partitions) + " partitions, " + to_string(clock_jumps) +
         " jumps of the clock, " + to_string(cuts) + " connections cut, " +
         to_string(vanished_peers) + " peers vanished with batches; " + to_string(growths) +
         " growths, " + to_string(renamings) + " renamings and " + to_string(deletions) +
         " deletions of studies, with " + to_string(cleared_rows) + " rows; " + to_string(events) +
         " events; healed after at most " + to_string(healed_after_ms) + " ms";
}

}  // namespace oblique::simulation
