// Workers that leave while points are open. Other workers get these points at once, and the server
// counts no lost worker.
#include <csignal>
#include <optional>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/programs.h"
#include "tests/system/many_points.h"

namespace oblique::test {
namespace {

nlohmann::json workers_of(const TemporaryFolder& folder, const Server& server) {
  const Outcome outcome =
      run_oblique(folder, {"workers", "--server", server.client_url(), "--format", "json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return nlohmann::json::parse(outcome.out, nullptr, false);
}

std::optional<nlohmann::json> worker_named(const TemporaryFolder& folder, const Server& server,
                                           const std::string& name) {
  for (const auto& worker : workers_of(folder, server)) {
    if (worker.at("name") == name) {
      return worker;
    }
  }
  return std::nullopt;
}

class LeavingProgramTest : public testing::Test {
 protected:
  /// Submits points whose fall takes more than a minute to solve, so that a worker returns its
  /// batch before it has results.
  void submit_slow_points() const {
    const Outcome outcome = run_oblique(
        folder_, {"submit", "--server", server_.client_url(), "--H", "1", "--mu", "0.1:2:40", "--e",
                  "1", "--elements-per-link", "64", "--name", "study"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  bool holds_points(const std::string& name) {
    const auto worker = worker_named(folder_, server_, name);
    return worker && worker->at("leased_points") > 0;
  }

  TemporaryFolder folder_;
  Server server_{folder_, folder_.file("a.db")};
};

TEST_F(LeavingProgramTest, AfterSigtermAnotherWorkerGetsTheBatchAtOnceAndNoLossCounts) {
  submit_slow_points();
  Worker first(folder_, server_.worker_url(), {"--name", "first", "--threads", "1"});
  wait_until("the first worker works", [&] { return holds_points("first"); });
  Worker second(folder_, server_.worker_url(), {"--name", "second", "--threads", "1"});
  wait_until("the second worker works", [&] { return holds_points("second"); });
  first.send(SIGTERM);
  EXPECT_EQ(first.wait(), 0) << first.err();
  EXPECT_FALSE(worker_named(folder_, server_, "first"));
  const auto rest = worker_named(folder_, server_, "second");
  ASSERT_TRUE(rest);
  EXPECT_EQ(rest->at("losses"), 0);
  EXPECT_EQ(server_.process().err().find("is lost"), std::string::npos) << server_.process().err();
}

TEST_F(LeavingProgramTest, AStudyIsSolvedWithoutLossesAlthoughWorkersComeAndGo) {
  const Outcome submitted =
      run_oblique(folder_, many_points("study", {"submit", "--server", server_.client_url()}));
  ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  Worker last(folder_, server_.worker_url(), {"--name", "last"});
  for (int i = 0; i < 3; ++i) {
    Worker first(folder_, server_.worker_url(), {"--name", "first"});
    wait_until("the first worker has solved points", [&] {
      const auto worker = worker_named(folder_, server_, "first");
      return worker && worker->at("solved_points") > 0;
    });
    first.send(SIGTERM);
    EXPECT_EQ(first.wait(), 0) << first.err();
    EXPECT_EQ(first.err().find("could not be delivered"), std::string::npos) << first.err();
  }
  const auto worker = worker_named(folder_, server_, "last");
  ASSERT_TRUE(worker);
  EXPECT_EQ(worker->at("losses"), 0);
  EXPECT_EQ(server_.process().err().find("is lost"), std::string::npos) << server_.process().err();
}

TEST_F(LeavingProgramTest, AWorkerExitsBeforeTheTimeOfUntil) {
  submit_slow_points();
  Worker worker(folder_, server_.worker_url(), {"--until", "5s", "--threads", "1"});
  EXPECT_EQ(worker.wait(), 0) << worker.err();
  EXPECT_EQ(server_.process().err().find("is lost"), std::string::npos) << server_.process().err();
  EXPECT_NE(server_.process().err().find(" leaves"), std::string::npos);
}

TEST_F(LeavingProgramTest, AWorkerExitsAfterItsLimitOfIdleTime) {
  Worker worker(folder_, server_.worker_url(), {"--idle-exit", "2"});
  EXPECT_EQ(worker.wait(), 0) << worker.err();
  EXPECT_NE(worker.err().find("no work for 2 s: leaving (--idle-exit)"), std::string::npos)
      << worker.err();
  EXPECT_NE(server_.process().err().find(" leaves"), std::string::npos);
}

TEST_F(LeavingProgramTest, AWorkerThatNeverReachedItsServerExitsWithOneAndNamesTheAddress) {
  for (const std::vector<std::string>& end :
       {std::vector<std::string>{"--idle-exit", "0.3"}, {"--until", "0.0012h"}}) {
    Worker worker(folder_, "tcp://127.0.0.1:1", end);
    EXPECT_EQ(worker.wait(), 1) << worker.err();
    EXPECT_NE(worker.err().find("leaving: tcp://127.0.0.1:1 was never reached in "),
              std::string::npos)
        << worker.err();
  }
}

TEST_F(LeavingProgramTest, AWorkerReportsOnceThatNoServerAnswers) {
  Worker refused(folder_, "tcp://127.0.0.1:1", {"--idle-exit", "5"});
  // The first attempt to connect takes 3 s. The idle limit of 5 s ends during the second attempt.
  EXPECT_EQ(refused.wait(), 1);
  const std::string output = refused.err();
  EXPECT_NE(output.find("no server answers at tcp://127.0.0.1:1"), std::string::npos) << output;
  EXPECT_EQ(output.find("no server answers"), output.rfind("no server answers")) << output;
}

TEST(LeavingFlagsTest, InvalidValuesAreWrongUsage) {
  const TemporaryFolder folder;
  for (const auto& [flag, value] :
       std::vector<std::pair<std::string, std::string>>{{"--until", "soon"},
                                                        {"--until", "2026-02-30T00:00:00Z"},
                                                        {"--until", "-5"},
                                                        {"--until", "2020-01-01T00:00:00Z"},
                                                        {"--until", "2s"},
                                                        {"--idle-exit", "-1"},
                                                        {"--idle-exit", "nan"},
                                                        {"--idle-exit", "x"}}) {
    Process process(folder, worker_program(), {flag, value});
    EXPECT_EQ(process.wait(), 2) << flag << value;
    EXPECT_NE(process.err().find(value), std::string::npos) << process.err();
    EXPECT_NE(process.err().find(flag), std::string::npos) << process.err();
  }
}

}  // namespace
}  // namespace oblique::test
