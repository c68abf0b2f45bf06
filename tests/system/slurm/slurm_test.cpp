// Workers that a real Slurm starts, by the script of deploy/slurm, by `oblique autoscale`, or by
// deploy/examples/campaign.sh.
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/process.h"
#include "tests/support/programs.h"
#include "tests/support/reserved_port.h"
#include "tests/system/slurm/slurm_cluster.h"

namespace oblique::test {
namespace {

/// A server with keys, and a Slurm for its workers. Tests are skipped if Slurm is not installed.
class SlurmTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const auto unavailable_reason = SlurmCluster::unavailable_reason();
        !unavailable_reason.empty()) {
      GTEST_SKIP() << "Slurm cannot be used: " << unavailable_reason;
    }
    cluster_.emplace(folder_);
    const auto made = run_oblique(folder_, {"keygen", folder_.file("keys")});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    server_.emplace(folder_, database_, Environment{{"OBLIQUE_KEYS", key_of("server")}});
  }

  void TearDown() override {
    if (HasFailure() && cluster_) {
      std::cerr << "Log of the server:\n" << server_->process().err();
      for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
        if (entry.path().extension() == ".log") {
          std::ifstream log(entry.path());
          std::cerr << entry.path().filename() << ":\n" << log.rdbuf() << '\n';
        }
      }
    }
  }

  /// Returns the key file of a role: server, client, reader or worker.
  std::string key_of(const std::string& role) const {
    return folder_.file("keys/" + role + ".key");
  }

  /// Returns the environment variables that the batch script requires.
  Environment worker_environment() const {
    return {{"OBLIQUE_WORKER_SERVER", server_->worker_url()},
            {"OBLIQUE_WORKER_KEYS", key_of("worker")},
            {"OBLIQUE_WORKER_PROGRAM", worker_program()}};
  }

  /// Submits the batch script with additional arguments and variables. Returns the id of its job.
  std::string submit_workers(std::vector<std::string> arguments = {},
                             const Environment& more = {}) const {
    Environment all = more;
    all.merge(worker_environment());
    arguments.insert(arguments.begin(), {"--parsable", kTimeLimit});
    arguments.emplace_back(OBLIQUE_WORKERS_SCRIPT);
    return cluster_->run("sbatch", arguments, all);
  }

  /// Waits until `count` workers have joined the server since its start.
  void wait_for_workers(int count) {
    wait_until("workers join", [&] {
      const std::string log = server_->process().err();
      int joined = 0;
      for (auto at = log.find(" joins"); at != std::string::npos; at = log.find(" joins", at + 1)) {
        ++joined;
      }
      return joined >= count;
    });
  }

  /// Submits a new study of `kPoints` points.
  void submit_study() {
    const std::string side = std::to_string(kSide);
    const auto submitted = run_oblique(
        folder_, {"submit", "--server", server_->client_url(), "--keys", key_of("client"),
                  "--preset", "paper", "--H", "1", "--mu", "0.1:2.0:" + side, "--e",
                  "0.5:1.0:" + side, "--no-reuse", "--name", "study" + std::to_string(++studies_)});
    ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  }

  double rows() const { return Database(database_).rows(); }

  /// Waits until workers of `job` have solved `points` points of the latest study.
  void wait_until_solved_by(const std::string& job, int points) const {
    wait_until("job " + job + " solves points", [&] {
      return Database(database_).number(
                 "SELECT count(*) FROM results JOIN workers USING (worker_id) WHERE study_id "
                 "= " +
                 std::to_string(studies_) + " AND name LIKE 'slurm-" + job + "-%'") >= points;
    });
  }

  void wait_until_done() const {
    wait_until("every point has a row", [this] { return rows() >= studies_ * kPoints; });
  }

  /// Expects one solved row for each point and no lost worker.
  void expect_each_point_once() {
    const Database database(database_);
    EXPECT_EQ(database.rows(), studies_ * kPoints);
    EXPECT_EQ(database.number("SELECT count(*) FROM results WHERE status <> 'solved'"), 0.0);
    EXPECT_EQ(server_->process().err().find("is lost"), std::string::npos)
        << server_->process().err();
  }

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  static constexpr int kSide = 25;  ///< sanitizers make programs about twenty times slower
#else
  static constexpr int kSide = 110;
#endif
  static constexpr double kPoints = kSide * kSide;

  /// Time limit of jobs [min], which ends the jobs of a killed test.
  static constexpr const char* kTimeLimit = "--time=5";

  TemporaryFolder folder_;
  std::string database_{folder_.file("study.db")};
  std::optional<SlurmCluster> cluster_;
  std::optional<Server> server_;
  int studies_ = 0;
};

using SlurmWorkersTest = SlurmTest;

TEST_F(SlurmWorkersTest, AStudyCompletesAlthoughOneJobIsCancelledAndOneIsRequeued) {
  const auto cancelled = submit_workers();
  const auto requeued = submit_workers();
  wait_for_workers(2);
  submit_study();
  wait_until_solved_by(cancelled, 100);
  wait_until_solved_by(requeued, 100);
  cluster_->run("scancel", {cancelled});
  cluster_->run("scontrol", {"requeue", requeued});
  cluster_->begin_now(requeued);
  wait_until_done();
  EXPECT_EQ(cluster_->field_of(requeued, "Restarts"), "1");
  expect_each_point_once();
}

TEST_F(SlurmWorkersTest, OneJobRunsAWorkerOnEachOfItsNodesUntilThereIsNoMoreWork) {
  const auto job = submit_workers({"--nodes=2"}, {{"OBLIQUE_WORKER_IDLE_EXIT", "3"}});
  wait_for_workers(2);
  submit_study();
  wait_until_done();
  EXPECT_EQ(Database(database_).texts("SELECT name FROM workers ORDER BY name"),
            (std::vector<std::string>{"slurm-" + job + "-n1", "slurm-" + job + "-n2"}));
  expect_each_point_once();
  cluster_->wait_for_state(job, "COMPLETED");
  EXPECT_EQ(cluster_->field_of(job, "ExitCode"), "0:0");
}

TEST_F(SlurmWorkersTest, WorkersLeaveInOrderBeforeTheirTimeLimit) {
  // One minute is the shortest time limit in Slurm. The workers leave 53 s before it. Points are
  // still open then, unless this machine is so slow that the workers start later.
  const auto job = submit_workers({"--time=1"}, {{"OBLIQUE_WORKER_LEAVE_BEFORE", "53"}});
  submit_study();
  cluster_->wait_for_state(job, "COMPLETED");  // not TIMEOUT
  EXPECT_EQ(cluster_->field_of(job, "ExitCode"), "0:0");
  submit_workers();
  wait_until_done();
  expect_each_point_once();
}

TEST_F(SlurmWorkersTest, PreemptedWorkersGiveBackTheirBatchesAndAreRequeued) {
  for (const char* partition : {"work", "grace"}) {
    const auto job = submit_workers({"--nodes=2", std::string("--partition=") + partition});
    submit_study();
    wait_until_solved_by(job, 100);
    cluster_->run("sbatch", {"--partition=urgent", "--exclusive", "--wait", "--wrap", "true"});
    cluster_->begin_now(job);
    wait_until_done();
    EXPECT_EQ(cluster_->field_of(job, "Restarts"), "1") << partition;
    cluster_->run("scancel", {job});
    cluster_->wait_for_state(job, "CANCELLED");
  }
  expect_each_point_once();
}

class SlurmAutoscaleTest : public SlurmTest {
 protected:
  std::vector<std::string> autoscale(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{
        "autoscale",     "slurm",          "--server", server_->client_url(),
        "--keys",        key_of("reader"), "--script", OBLIQUE_WORKERS_SCRIPT,
        "--sbatch-args", kTimeLimit};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  /// Returns the environment of the client: Slurm's variables, and variables that jobs inherit.
  Environment environment() const {
    Environment all = cluster_->environment();
    all.merge(worker_environment());
    return all;
  }

  Outcome once(const std::vector<std::string>& more) const {
    return Process(folder_, client_program(), autoscale(more), environment()).outcome();
  }

  std::size_t listed_jobs() const {
    const auto jobs = cluster_->run("squeue", {"--noheader", "--format=%A"});
    return jobs.empty() ? 0U
                        : 1U + static_cast<std::size_t>(std::count(jobs.begin(), jobs.end(), '\n'));
  }

  void wait_for_jobs(std::size_t count) const {
    wait_until("there are " + std::to_string(count) + " jobs", [&] {
      usleep(50'000);
      return listed_jobs() == count;
    });
  }
};

TEST_F(SlurmAutoscaleTest, JobsStartForAStudyAndEndByThemselvesWhenItIsDone) {
  auto variables = environment();
  variables["OBLIQUE_WORKER_IDLE_EXIT"] = "3";
  const auto half = std::to_string(static_cast<int>(kPoints / 2) + 1);
  Process scaling(folder_, client_program(),
                  autoscale({"--max", "4", "--points-per-job", half, "--interval", "0.2"}),
                  variables);
  submit_study();
  wait_until_done();
  wait_for_jobs(0);
  expect_each_point_once();
  scaling.send(SIGINT);
  EXPECT_EQ(scaling.wait(), 130);
  EXPECT_NE(scaling.err().find("submitting 2 jobs"), std::string::npos) << scaling.err();
}

TEST_F(SlurmAutoscaleTest, JobsOfAStoppedAutoscalerContinueAndTheNextAutoscalerCountsThem) {
  {
    Process scaling(folder_, client_program(), autoscale({"--min", "2", "--max", "2"}),
                    environment());
    wait_for_jobs(2);
    scaling.send(SIGINT);
    EXPECT_EQ(scaling.wait(), 130);
  }
  const auto again = once({"--min", "2", "--max", "2", "--once"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const auto dry = once({"--min", "3", "--max", "3", "--dry-run"});
  EXPECT_NE(dry.err.find("would submit 1 job with: sbatch"), std::string::npos) << dry.err;
  EXPECT_EQ(listed_jobs(), 2U);
}

/// Tests of campaign.sh with oblique installed in a folder.
class SlurmCampaignTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const auto unavailable_reason = SlurmCluster::unavailable_reason();
        !unavailable_reason.empty()) {
      GTEST_SKIP() << "Slurm cannot be used: " << unavailable_reason;
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

TEST_F(SlurmCampaignTest, JobsSolveAStudyWriteItsResultsToAFileAndLeaveNothingRunning) {
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
  // A second run has nothing to solve and needs no job.
  Process again(folder_, "/bin/sh", {"campaign.sh", "sticking.toml", "1"}, environment());
  EXPECT_EQ(again.wait(), 0) << again.err();
  EXPECT_NE(again.out().find("80 results in sticking.csv\n"), std::string::npos);
}

}  // namespace
}  // namespace oblique::test
