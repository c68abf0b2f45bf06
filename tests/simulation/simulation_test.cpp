#include "tests/simulation/simulation.h"

#include <cstdint>
#include <exception>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/amount.h"

namespace oblique::simulation {
namespace {

/// Runs seeds until one fails, and prints that seed. `simulate SEED 1` repeats the run.
SimulationOutcome simulate_seeds(std::uint64_t first, std::uint64_t count,
                                 const SimulationSettings& settings) {
  SimulationOutcome all;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    try {
      add(all, simulate(seed, settings));
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

/// The parameter is a group of seeds; CTest runs groups in parallel. In odd groups a failed sync
/// loses its data, as on Linux.
class SimulationTest : public testing::TestWithParam<std::uint64_t> {};

TEST_P(SimulationTest, EveryPointEndsWithOneRightRowDespiteFaults) {
  const std::uint64_t count = seeds(30, 250);
  SimulationSettings settings;
  settings.forgetful_syncs = GetParam() % 2 == 1;
  auto all = simulate_seeds(GetParam() * count + 1, count, settings);
  for (const auto& [what, least] :
       std::map<std::string, std::uint64_t>{{"server kills", count / 2},
                                            {"power losses", count / 2},
                                            {"deaths in writes", count / 4},
                                            {"server stops", count / 4},
                                            {"undone commits", count / 4},
                                            {"failed commits", count},
                                            {"failed syncs", count / 4},
                                            {"worker faults", count},
                                            {"reported crashes", 0},
                                            {"partitions", count / 4},
                                            {"clock jumps", count / 4},
                                            {"growths", count / 4},
                                            {"renamings", count / 4},
                                            {"deletions", count / 4},
                                            {"cleared rows", count}}) {
    EXPECT_GT(all[what], least) << what;
  }
}

INSTANTIATE_TEST_SUITE_P(Part, SimulationTest, testing::Range<std::uint64_t>(0, 8));

TEST(StormsTest, NoPointFailsBecauseOfLostWorkersIfOneWorkerIsSound) {
  SimulationSettings settings;
  settings.storms = true;
  const std::uint64_t count = seeds(10, 200);
  auto all = simulate_seeds(1, count, settings);
  EXPECT_GT(all["worker faults"], 5 * count);
  EXPECT_GT(all["cuts"], 5 * count / 2);
  EXPECT_GT(all["vanished peers"], count / 2);
  EXPECT_GT(all["reported crashes"], count / 2);
}

TEST(SeedTest, TheSameSeedRepeatsARunExactly) {
  EXPECT_EQ(simulate(7, {}), simulate(7, {}));
}

}  // namespace
}  // namespace oblique::simulation
