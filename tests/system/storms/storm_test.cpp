// Workers that are lost again and again beside a sound one: every point is solved.
#include <string>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/many_points.h"
#include "tests/system/storms/storm.h"

namespace oblique::test {
namespace {

class StormTest : public ::testing::Test {
 protected:
  /// A study of many points, of which a filter may leave some out, is solved by one worker in such
  /// a storm. Returns how many blows fell.
  int weather(StormKind kind, const std::string& filter = {}) {
    Server server(folder_, folder_.file("many.db"));
    Storm storm(kind, folder_, server.worker_url());
    std::vector<std::string> arguments{"submit", "--server", server.client_url()};
    const auto points = many_points("many");
    arguments.insert(arguments.end(), points.begin(), points.end());
    if (!filter.empty()) {
      arguments.insert(arguments.end(), {"--where", filter});
    }
    const Outcome submitted = run_oblique(folder_, arguments);
    EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
    if (kind == StormKind::kVanishingPeers) {
      // They had every chance before there was anybody else.
      wait_until("the first peers vanished", [&] { return storm.blows() >= 2; });
    }
    Worker sound(folder_, server.worker_url(), {"--threads", "1"});
    wait_until("the study is done",
               [&] { return database_.texts("SELECT state FROM studies").at(0) == "done"; });
    storm.end();
    const double left_in = database_.number("SELECT points FROM studies");
    EXPECT_TRUE(filter.empty() ? left_in == kManyPoints : left_in < kManyPoints) << left_in;
    EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), left_in);
    EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status <> 'solved'"), 0);
    const Outcome workers =
        run_oblique(folder_, {"workers", "--server", server.client_url(), "--format", "csv"});
    EXPECT_NE(workers.out.find(",proven"), std::string::npos) << workers.out;
    return storm.blows();
  }

  TemporaryFolder folder_;
  Database database_{folder_.file("many.db")};
};

TEST_F(StormTest, AWorkerKilledAgainAndAgainBesideASoundOneFailsNoPoint) {
  EXPECT_GE(weather(StormKind::kKilledWorkers), 5) << "too few to be a test";
}

TEST_F(StormTest, AConnectionCutAgainAndAgainFailsNoPoint) {
  EXPECT_GE(weather(StormKind::kCutConnections), 5) << "too few to be a test";
}

TEST_F(StormTest, PeersThatTakeBatchesAndVanishUnderEverNewNamesFailNoPoint) {
  EXPECT_GE(weather(StormKind::kVanishingPeers, "sin(1000 * mu) > -0.9"), 2)
      << "too few to be a test";
}

}  // namespace
}  // namespace oblique::test
