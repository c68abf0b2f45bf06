// The recipe of a campaign, with oblique installed as its user has it.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/process.h"
#include "tests/support/reserved_port.h"
#include "tests/system/slurm/slurm_cluster.h"

namespace oblique::test {
namespace {

class SlurmCampaignTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const auto objection = SlurmCluster::objection(); !objection.empty()) {
      GTEST_SKIP() << "no Slurm here: " << objection;
    }
    for (const char* part : {"server", "worker", "client"}) {
      Process install(folder_, "/usr/bin/env",
                      {OBLIQUE_CMAKE, "--install", OBLIQUE_BUILD_FOLDER, "--prefix", prefix_,
                       "--component", part});
      ASSERT_EQ(install.wait(), 0) << install.err();
    }
    std::filesystem::copy(OBLIQUE_CAMPAIGN, folder_.path() / "campaign.sh");
    cluster_.emplace(folder_);
  }

  Environment environment() const {
    Environment all = cluster_->environment();
    all["PATH"] = prefix_ + "/bin:/usr/bin:/bin:/usr/sbin:/sbin";
    all["HOST"] = "127.0.0.1";
    all["SBATCH_ARGS"] = "--time=5";
    all["OBLIQUE_SERVER_CLIENT_PORT"] = client_port_.number();
    all["OBLIQUE_SERVER_WORKER_PORT"] = worker_port_.number();
    all["OBLIQUE_SERVER_HTTP"] = "off";
    return all;
  }

  std::string text_of(const std::string& name) const {
    std::ifstream file(folder_.file(name));
    return {std::istreambuf_iterator<char>(file), {}};
  }

  TemporaryFolder folder_;
  std::string prefix_{folder_.file("installed")};
  ReservedPort client_port_;
  ReservedPort worker_port_;
  std::optional<SlurmCluster> cluster_;
};

TEST_F(SlurmCampaignTest, JobsSolveAStudyItsResultsAreInAFileAndNothingIsLeftRunning) {
  std::ofstream(folder_.file("sticking.toml"))
      << "name = \"sticking\"\n[[block]]\nH = 1.0\nmu = { from = 0.5, to = 2.0, count = 40 }\n"
         "e = [0.5, 1.0]\n";
  Process campaign(folder_, "/bin/sh", {"campaign.sh", "sticking.toml", "1"}, environment());
  ASSERT_EQ(campaign.wait(), 0) << campaign.err() << text_of("server.log")
                                << text_of("autoscale.log") << cluster_->log();
  EXPECT_NE(campaign.out().find("80 results in sticking.csv\n"), std::string::npos)
      << campaign.out();
  EXPECT_EQ(text_of("sticking.csv").substr(0, 6), "point,");
  EXPECT_EQ(Database(folder_.file("campaign.db"))
                .number("SELECT count(*) FROM workers WHERE name LIKE 'slurm-%'"),
            1.0);
  EXPECT_EQ(cluster_->run("squeue", {"--noheader"}), "");
  // Again: nothing is left to solve, and no job is needed.
  Process again(folder_, "/bin/sh", {"campaign.sh", "sticking.toml", "1"}, environment());
  EXPECT_EQ(again.wait(), 0) << again.err();
  EXPECT_NE(again.out().find("80 results in sticking.csv\n"), std::string::npos);
}

}  // namespace
}  // namespace oblique::test
