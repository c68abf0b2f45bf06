// Usage: simulate FIRST COUNT [storms | forgetful]. Runs the seeds FIRST to FIRST + COUNT - 1 and
// prints those that fail.
#include <cstdint>
#include <exception>
#include <iostream>
#include <string>

#include "tests/simulation/simulation.h"

using oblique::simulation::add;
using oblique::simulation::SimulationOutcome;
using oblique::simulation::SimulationSettings;

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: simulate FIRST_SEED COUNT [storms | forgetful]\n";
    return 2;
  }
  try {
    const std::string mode = argc > 3 ? argv[3] : "";
    SimulationSettings settings;
    settings.storms = mode == "storms";
    settings.forgetful_syncs = mode == "forgetful";
    const std::uint64_t first = std::stoull(argv[1]);
    const std::uint64_t end = first + std::stoull(argv[2]);
    SimulationOutcome all;
    std::uint64_t failures = 0;
    for (std::uint64_t seed = first; seed < end; ++seed) {
      try {
        add(all, oblique::simulation::simulate(seed, settings));
      } catch (const std::exception& error) {
        ++failures;
        std::cout << "seed " << seed << ": " << error.what() << std::endl;
      }
    }
    std::cout << failures << " failed: " << oblique::simulation::text_of(all) << "\n";
    return failures == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 2;
  }
}
