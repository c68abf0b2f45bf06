// The store on the simulated disk, without the rest of the world: every moment of a short life.
#include "tests/simulation/disk/simulated_disk.h"

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "tests/simulation/disk/simulated_files.h"
#include "tests/simulation/world.h"
#include "tests/support/amount.h"
#include "tests/support/recipes.h"

namespace oblique::simulation {
namespace {

constexpr std::uint64_t kPoints = 8;

server::AddStudy study(std::uint64_t id) {
  return {id, "study " + std::to_string(id),
          std::make_shared<const protocol::PointTable>(protocol::recipe_of(
              {{protocol::listed("H", {1.0}), protocol::range("mu", 0.0, 1.0, kPoints),
                protocol::listed("e", {1.0})}})),
          "2026-01-01T00:00:00.000Z"};
}

server::AddResults result(const server::AddStudy& study, std::uint64_t point) {
  server::AddResults results{
      study.study_id, study.table.get(), 0, "1", "", 1, "2026-01-01T00:00:01.000Z", {}};
  results.results.emplace_back().set_point(point);
  return results;
}

/// Opens the store and gives it some changes. False when the process died on the way.
bool live(SimulatedDisk& disk) {
  try {
    disk.open();
    for (std::uint64_t id = 1; id <= 3; ++id) {
      const server::AddStudy added = study(id);
      if (disk.model().study(id) == nullptr) {
        const server::Change change = added;
        disk.commit({&change, 1});
      }
      for (std::uint64_t point = 0; point < kPoints; ++point) {
        if (!disk.model().rows(id).contains(point)) {
          const server::Change change = result(added, point);
          disk.commit({&change, 1});
        }
      }
    }
    disk.close();
  } catch (const server::StorageError&) {
    EXPECT_TRUE(disk.died());
  }
  return !disk.died();
}

/// As `live`, on a disk where something fails once: what is refused is tried again.
void live_through_a_failure(SimulatedDisk& disk) {
  const auto insist = [](const auto& attempt) {
    constexpr int kTries = 3;
    for (int tries = 1;; ++tries) {
      try {
        attempt();
        return;
      } catch (const server::StorageError&) {
        if (tries == kTries) {
          throw;
        }
      }
    }
  };
  insist([&] {
    try {
      disk.open();
    } catch (const server::StorageError&) {
      disk.crash(false);
      throw;
    }
  });
  for (std::uint64_t id = 1; id <= 3; ++id) {
    const server::Change added = study(id);
    insist([&] { disk.commit({&added, 1}); });
    for (std::uint64_t point = 0; point < kPoints; ++point) {
      const server::Change change = result(std::get<server::AddStudy>(added), point);
      insist([&] { disk.commit({&change, 1}); });
    }
  }
}

TEST(FailingSync, NoneThatFailsAndForgetsLosesAStudyWhenThePowerGoes) {
  std::uint64_t failures = 0;
  for (std::int64_t sync = 1;; ++sync) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      World world(seed * 1000 + static_cast<std::uint64_t>(sync));
      SimulatedDisk disk(world);
      disk.files().plan_failing_sync(sync);
      live_through_a_failure(disk);
      if (disk.files().awaits_failing_sync()) {
        EXPECT_GT(failures, 20U);
        return;
      }
      ++failures;
      disk.crash(true);
      // The model refuses what is not there any more and was promised.
      ASSERT_NO_THROW(disk.open()) << "sync " << sync << ", seed " << seed;
      disk.check_rows();
    }
  }
}

class SimulatedDiskTest : public testing::TestWithParam<bool> {};

TEST_P(SimulatedDiskTest, NoDeathInAnyOperationLosesWhatWasPromised) {
  const bool power_is_lost = GetParam();
  bool survived = false;
  std::uint64_t deaths = 0;
  for (std::int64_t operation = 1; !survived; operation += test::amount(4, 1)) {
    World world(static_cast<std::uint64_t>(operation));
    SimulatedDisk disk(world, DiskAtFirst::kEmptyFile);
    disk.files().plan_death(operation);
    survived = live(disk);
    deaths += survived ? 0U : 1U;
    disk.crash(power_is_lost);
    ASSERT_TRUE(live(disk)) << "death in operation " << operation;
    disk.open();
    disk.check_rows();
  }
  EXPECT_GT(deaths, 50U);
}

INSTANTIATE_TEST_SUITE_P(WithOrWithoutPower, SimulatedDiskTest, testing::Bool(),
                         [](const testing::TestParamInfo<bool>& lost) {
                           return lost.param ? "PowerIsLost" : "ProcessIsKilled";
                         });

}  // namespace
}  // namespace oblique::simulation
