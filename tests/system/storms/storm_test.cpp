// If one worker is undisturbed, every point is solved although other workers are lost repeatedly.
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/many_points.h"
#include "tests/system/storms/storm.h"

namespace oblique::test {
namespace {

class StormTest : public ::testing::Test {
 protected:
  /// One undisturbed worker solves studies of many points during a storm, until at least `faults`
  /// faults have happened. `filter` leaves out some points.
  void solve_during(StormKind kind, int faults, const std::string& filter = {}) {
    Server server(folder_, folder_.file("many.db"));
    Storm storm(kind, folder_, server.worker_url());
    std::optional<Worker> sound;
    int studies = 0;
    while (studies == 0 || storm.faults() < faults) {
      submit(server, "many " + std::to_string(++studies), filter);
      if (kind == StormKind::kVanishingPeers) {
        // The undisturbed worker joins after the first peers have vanished.
        wait_until("the first peers vanished", [&] { return storm.faults() >= faults; });
      }
      if (!sound) {
        sound.emplace(folder_, server.worker_url(), std::vector<std::string>{"--threads", "1"});
      }
      wait_until("all studies are done", [&] {
        return database_.number("SELECT count(*) FROM studies WHERE state <> 'done'") == 0;
      });
    }
    storm.end();
    const double left_in = database_.number("SELECT sum(points - left_out) FROM studies");
    const double all = kManyPoints * studies;
    EXPECT_TRUE(filter.empty() ? left_in == all : left_in < all) << left_in;
    EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), left_in);
    EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status <> 'solved'"), 0);
  }

 private:
  void submit(const Server& server, const std::string& name, const std::string& filter) const {
    auto arguments = many_points(name, {"submit", "--no-reuse", "--server", server.client_url()});
    if (!filter.empty()) {
      arguments.insert(arguments.end(), {"--where", filter});
    }
    const Outcome submitted = run_oblique(folder_, arguments);
    EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
  }

  TemporaryFolder folder_;
  Database database_{folder_.file("many.db")};
};

TEST_F(StormTest, RepeatedKillsOfAWorkerFailNoPoint) {
  solve_during(StormKind::kKilledWorkers, 5);
}

TEST_F(StormTest, RepeatedCutsOfAConnectionFailNoPoint) {
  solve_during(StormKind::kCutConnections, 5);
}

TEST_F(StormTest, PeersThatTakeBatchesAndDisappearFailNoPoint) {
  solve_during(StormKind::kVanishingPeers, 2, "sin(1000 * mu) > -0.9");
}

}  // namespace
}  // namespace oblique::test
