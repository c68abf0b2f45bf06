#include "tests/simulation/simulation.h"

#include <exception>

#include <gtest/gtest.h>

#include "tests/support/amount.h"

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

std::uint64_t seeds(int quick, int all) {
  return static_cast<std::uint64_t>(test::amount(quick, all));
}

/// Seeds in parts, which CTest runs beside each other; in every second part a sync that fails
/// forgets what it should have kept, as on Linux.
class SimulationTest : public testing::TestWithParam<std::uint64_t> {};

TEST_P(SimulationTest, EveryPointEndsWithOneRightRowWhateverBreaks) {
  const std::uint64_t count = seeds(40, 250);
  SimulationSettings settings;
  settings.forgetful_syncs = GetParam() % 2 == 1;
  const auto all = simulate_seeds(GetParam() * count + 1, count, settings);
  EXPECT_GT(all.server_kills, count / 2);
  EXPECT_GT(all.power_losses, count / 2);
  EXPECT_GT(all.deaths_in_writes, count / 4);
  EXPECT_GT(all.server_stops, count / 4);
  EXPECT_GT(all.undone_commits, count / 4);
  EXPECT_GT(all.failed_commits, count);
  EXPECT_GT(all.failed_syncs, count / 4);
  EXPECT_GT(all.worker_faults, count);
  EXPECT_GT(all.partitions, count / 4);
  EXPECT_GT(all.clock_jumps, count / 4);
  EXPECT_GT(all.growths, count / 4);
  EXPECT_GT(all.renamings, count / 4);
  EXPECT_GT(all.deletions, count / 4);
  EXPECT_GT(all.cleared_rows, count);
  EXPECT_EQ(all.failed_points, 0U);
}

INSTANTIATE_TEST_SUITE_P(Part, SimulationTest, testing::Range<std::uint64_t>(0, 8));

TEST(KillersTest, OnlyThePointsThatKillTheirWorkersFail) {
  SimulationSettings settings;
  settings.killers = true;
  const std::uint64_t count = seeds(20, 100);
  const auto all = simulate_seeds(1, count, settings);
  EXPECT_GT(all.failed_points, count / 2);
}

TEST(StormsTest, NoPointFailsForWorkersThatAreLostBesideASoundOne) {
  SimulationSettings settings;
  settings.storms = true;
  const std::uint64_t count = seeds(20, 200);
  const auto all = simulate_seeds(1, count, settings);
  EXPECT_GT(all.worker_faults, 5 * count);
  EXPECT_GT(all.cuts, 5 * count / 2);
  EXPECT_GT(all.vanished_peers, count / 2);
  EXPECT_EQ(all.failed_points, 0U);
}

TEST(SeedTest, GivesTheSameRunAgain) {
  EXPECT_EQ(simulate(7, {}), simulate(7, {}));
}

}  // namespace
}  // namespace oblique::simulation
