// simulate FIRST COUNT [killers]: runs that many seeds and names those that fail.
#include <algorithm>
#include <cstdint>
#include <exception>
#include <iostream>
#include <string>

#include "tests/simulation/simulation.h"

int main(int argc, char** argv) {
  using namespace oblique::simulation;
  if (argc < 3) {
    std::cerr << "usage: simulate FIRST_SEED COUNT [killers]\n";
    return 2;
  }
  SimulationSettings settings;
  settings.killers = argc > 3 && std::string(argv[3]) == "killers";
  SimulationOutcome all;
  int failures = 0;
  try {
    const std::uint64_t first = std::stoull(argv[1]);
    const std::uint64_t count = std::stoull(argv[2]);
    for (std::uint64_t seed = first; seed < first + count; ++seed) {
      try {
        const auto outcome = simulate(seed, settings);
        all.points += outcome.points;
        all.failed_points += outcome.failed_points;
        all.server_crashes += outcome.server_crashes;
        all.worker_faults += outcome.worker_faults;
        all.events += outcome.events;
        all.healed_after_ms = std::max(all.healed_after_ms, outcome.healed_after_ms);
      } catch (const std::exception& error) {
        std::cout << "seed " << seed << ": " << error.what() << std::endl;
        ++failures;
      }
    }
    std::cout << count << " seeds, " << failures << " failed: " << all.points << " points, "
              << all.failed_points << " of them killers; " << all.server_crashes
              << " crashes of the server, " << all.worker_faults << " faults of workers, "
              << all.events << " events; healed after at most " << all.healed_after_ms << " ms\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
  return failures == 0 ? 0 : 1;
}
