// Servers that are killed while studies are extended, renamed or deleted.
#include <chrono>
#include <csignal>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/amount.h"
#include "tests/support/database.h"
#include "tests/support/programs.h"

namespace oblique::test {
namespace {

const int kRounds = amount(4, 12);
constexpr int kPointsPerBlock = 200;

class GrowthKillTest : public ::testing::Test {
 protected:
  /// Writes a study file with `blocks` blocks of 200 points. No other study contains these points.
  std::string study_file(const std::string& name, double k, int blocks) const {
    const std::string path = folder_.file(name + ".toml");
    std::ofstream file(path);
    file << "name = \"" << name << "\"\n[model]\npreset = \"paper\"\nk = " << k << "\n";
    for (int block = 0; block < blocks; ++block) {
      file << "[[block]]\nH = " << 0.8 + 0.01 * block
           << "\nmu = { from = 0.1, to = 2.0, count = 20 }\n"
              "e = { from = 0.5, to = 1.0, count = 10 }\n";
    }
    return path;
  }

  std::unique_ptr<Process> client(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--server", server_->client_url(), "--timeout", "600"});
    return std::make_unique<Process>(folder_, client_program(), arguments);
  }
  std::unique_ptr<Process> submit(const std::string& file) const {
    return client({"submit", file});
  }

  void kill_server_within(int most_ms) {
    std::this_thread::sleep_for(
        std::chrono::milliseconds(std::uniform_int_distribution<int>(0, most_ms)(random_)));
    server_->process().send(SIGKILL);
    EXPECT_EQ(server_->process().wait(), -SIGKILL);
    server_ = std::make_unique<Server>(folder_, database_, *server_);
  }

  std::vector<std::string> names() const {
    return Database(database_).texts("SELECT name FROM studies ORDER BY name");
  }
  double number(const std::string& sql) const { return Database(database_).number(sql); }

  TemporaryFolder folder_;
  std::string database_ = folder_.file("grows.db");
  std::unique_ptr<Server> server_ = std::make_unique<Server>(folder_, database_);
  std::mt19937 random_{14};
};

TEST_F(GrowthKillTest, AcknowledgedChangesSurviveAKillAtAnyTime) {
  const Worker worker(folder_, server_->worker_url());
  std::string victim;
  for (int round = 0; round < kRounds; ++round) {
    const auto growing = submit(study_file("grows", 2.7e7, round + 1));
    const auto deleting = victim.empty() ? nullptr : client({"delete", victim, "--yes"});
    kill_server_within(80);
    EXPECT_EQ(growing->wait(), 0) << "round " << round << ": " << growing->err();
    EXPECT_EQ(number("SELECT points FROM studies WHERE name = 'grows'"),
              kPointsPerBlock * (round + 1))
        << round;
    if (deleting != nullptr) {
      // The client sends the request again to the next server, but the killed server may already
      // have deleted the study.
      const int code = deleting->wait();
      EXPECT_TRUE(code == 0 || deleting->err().find("no study") != std::string::npos)
          << round << ": " << deleting->err();
      EXPECT_EQ(number("SELECT count(*) FROM studies WHERE name = '" + victim + "'"), 0) << round;
    }
    // The next round deletes this study after its results are stored, or while they arrive.
    victim = "victim " + std::to_string(round);
    const auto next = submit(study_file(victim, 1e7 + round, 2));
    EXPECT_EQ(next->wait(), 0) << next->err();
  }
  EXPECT_EQ(client({"rename", victim, "stays"})->wait(), 0);
  kill_server_within(0);
  EXPECT_EQ(names(), (std::vector<std::string>{"grows", "stays"}));
  wait_until("all points are solved and deleted rows are gone", [&] {
    return number("SELECT count(*) FROM studies WHERE state = 'done'") == 2 &&
           number(
               "SELECT count(*) FROM results WHERE study_id IN"
               " (SELECT study_id FROM deletions)") == 0;
  });
  EXPECT_EQ(number("SELECT count(*) FROM results"), kPointsPerBlock * (kRounds + 2));
  EXPECT_EQ(number("SELECT count(DISTINCT point) FROM runs WHERE study = 'grows'"),
            kPointsPerBlock * kRounds);
  EXPECT_EQ(number("SELECT count(*) FROM completed_ranges WHERE study_id NOT IN"
                   " (SELECT study_id FROM studies)"),
            0);
  server_->process().send(SIGTERM);
  EXPECT_EQ(server_->process().wait(), 0);
  const Outcome check = run_oblique(folder_, {"check", "--db", database_});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
}

}  // namespace
}  // namespace oblique::test
