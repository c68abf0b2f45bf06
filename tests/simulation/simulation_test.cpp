#include "tests/simulation/simulation.h"

#include <exception>

#include <gtest/gtest.h>

namespace oblique::simulation {
namespace {

/// Runs `count` seeds and names the first that fails. `simulate SEED 1` runs it again.
SimulationOutcome simulate_seeds(std::uint64_t count, const SimulationSettings& settings) {
  SimulationOutcome all;
  for (std::uint64_t seed = 1; seed <= count; ++seed) {
    try {
      const auto outcome = simulate(seed, settings);
      all.points += outcome.points;
      all.failed_points += outcome.failed_points;
      all.server_crashes += outcome.server_crashes;
      all.worker_faults += outcome.worker_faults;
    } catch (const std::exception& error) {
      ADD_FAILURE() << "seed " << seed << ": " << error.what();
      return all;
    }
  }
  return all;
}

TEST(SimulationTest, EveryPointEndsWithOneRightRowWhateverBreaks) {
  constexpr std::uint64_t kSeeds = 300;
  const auto all = simulate_seeds(kSeeds, {});
  EXPECT_GT(all.server_crashes, kSeeds);
  EXPECT_GT(all.worker_faults, kSeeds);
  EXPECT_EQ(all.failed_points, 0U);
}

TEST(SimulationTest, OnlyThePointsThatKillTheirWorkersFail) {
  SimulationSettings settings;
  settings.killers = true;
  const auto all = simulate_seeds(100, settings);
  EXPECT_GT(all.failed_points, 50U);
}

TEST(SimulationTest, ASeedGivesTheSameRunAgain) {
  const auto first = simulate(7, {});
  const auto second = simulate(7, {});
  EXPECT_EQ(first.events, second.events);
  EXPECT_EQ(first.healed_after_ms, second.healed_after_ms);
}

}  // namespace
}  // namespace oblique::simulation
