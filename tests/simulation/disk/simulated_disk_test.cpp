// The store on a simulated disk, without a server, interrupted at each operation of a short run.
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

/// Opens the store and commits all studies and results that it does not contain yet.
void solve_all(SimulatedDisk& disk) {
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
}

/// Solves all points and closes the store. Returns false if the process died.
bool live(SimulatedDisk& disk) {
  try {
    solve_all(disk);
    disk.close();
  } catch (const server::StorageError&) {
    EXPECT_TRUE(disk.died());
  }
  return !disk.died();
}

TEST(FailingSync, EndsTheServerAndLosesNoStudyAfterAPowerFailure) {
  std::uint64_t failures = 0;
  for (std::int64_t sync = 1;; ++sync) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      World world(seed * 1000 + static_cast<std::uint64_t>(sync));
      SimulatedDisk disk(world);
      disk.files().plan_failing_sync(sync);
      bool ended = false;
      try {
        solve_all(disk);
      } catch (const server::StorageGone&) {
        ended = true;
        if (seed % 3 == 0) {  // after a failed sync, close() does not merge the log
          disk.close();
          EXPECT_TRUE(disk.files().exists(disk.files().path() + "-wal"));
        }
      } catch (const server::StorageError&) {
        ended = true;  // the sync of the log during start failed
        EXPECT_LE(sync, 2);
      }
      if (disk.files().awaits_failing_sync()) {
        EXPECT_FALSE(ended);
        EXPECT_GT(failures, 20U);
        return;
      }
      ++failures;
      EXPECT_TRUE(ended) << "sync " << sync << ", seed " << seed;
      // In half of the cases a restarted server solves the remaining points before the power fails.
      const bool starts_again = seed % 2 == 0;
      if (starts_again) {
        disk.crash(false);
        ASSERT_NO_THROW(solve_all(disk)) << "sync " << sync << ", seed " << seed;
      }
      disk.crash(true);
      // open() throws if an acknowledged change is missing.
      ASSERT_NO_THROW(disk.open()) << "sync " << sync << ", seed " << seed;
      disk.check_rows();
    }
  }
}

class SimulatedDiskTest : public testing::TestWithParam<bool> {};

TEST_P(SimulatedDiskTest, NoAcknowledgedChangeIsLostWhicheverOperationIsInterrupted) {
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
