#include "tests/simulation/simulation.h"

#include <exception>

#include <gtest/gtest.h>

namespace oblique::simulation {
namespace {

/// Runs seeds and names the first that fails. `simulate SEED 1` runs it again.
SimulationOutcome simulate_seeds(std::uint64_t first, std::uint64_t count,
                                 const SimulationSettings& settings) {
  SimulationOutcome all;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    try {
      all += simulate(seed, settings);
    } catch (const std::exception& error) {
      ADD_FAILURE() << "seed " << seed << ": " << error.what();
      return all;
    }
  }
  return all;
}

/// 2000 seeds in parts, which CTest runs beside each other; in every second part a sync that fails
/// forgets what it should have kept, as on Linux.
class SimulationTest : public testing::TestWithParam<std::uint64_t> {};

TEST_P(SimulationTest, EveryPointEndsWithOneRightRowWhateverBreaks) {
  constexpr std::uint64_t kSeeds = 250;
  SimulationSettings settings;
  settings.forgetful_syncs = GetParam() % 2 == 1;
  const auto all = simulate_seeds(GetParam() * kSeeds + 1, kSeeds, settings);
  EXPECT_GT(all.server_kills, kSeeds / 2);
  EXPECT_GT(all.power_losses, kSeeds / 2);
  EXPECT_GT(all.deaths_in_writes, kSeeds / 4);
  EXPECT_GT(all.server_stops, kSeeds / 4);
  EXPECT_GT(all.undone_commits, kSeeds / 4);
  EXPECT_GT(all.failed_commits, kSeeds);
  EXPECT_GT(all.worker_faults, kSeeds);
  EXPECT_GT(all.partitions, kSeeds / 4);
  EXPECT_GT(all.clock_jumps, kSeeds / 4);
  EXPECT_GT(all.growths, kSeeds / 4);
  EXPECT_GT(all.renamings, kSeeds / 4);
  EXPECT_GT(all.deletions, kSeeds / 4);
  EXPECT_GT(all.cleared_rows, kSeeds);
  EXPECT_EQ(all.failed_points, 0U);
}

INSTANTIATE_TEST_SUITE_P(Part, SimulationTest, testing::Range<std::uint64_t>(0, 8));

TEST(KillersTest, OnlyThePointsThatKillTheirWorkersFail) {
  SimulationSettings settings;
  settings.killers = true;
  const auto all = simulate_seeds(1, 100, settings);
  EXPECT_GT(all.failed_points, 50U);
}

TEST(StormsTest, NoPointFailsForWorkersThatAreLostBesideASoundOne) {
  SimulationSettings settings;
  settings.storms = true;
  const auto all = simulate_seeds(1, 200, settings);
  EXPECT_GT(all.worker_faults, 1000U);
  EXPECT_GT(all.cuts, 500U);
  EXPECT_GT(all.vanished_peers, 100U);
  EXPECT_EQ(all.failed_points, 0U);
}

TEST(SeedTest, GivesTheSameRunAgain) {
  EXPECT_EQ(simulate(7, {}), simulate(7, {}));
}

}  // namespace
}  // namespace oblique::simulation
