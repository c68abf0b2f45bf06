#pragma once

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
#include "tests/support/programs.h"
#include "tests/system/slurm/slurm_cluster.h"

namespace oblique::test {

/// A server with keys, and a Slurm to run its workers. Skipped where Slurm is not installed.
class SlurmTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const auto objection = SlurmCluster::objection(); !objection.empty()) {
      GTEST_SKIP() << "no Slurm here: " << objection;
    }
    cluster_.emplace(folder_);
    const auto made = run_oblique(folder_, {"keygen", folder_.file("keys")});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    server_.emplace(folder_, database_, Environment{{"OBLIQUE_KEYS", key_of("server")}});
  }

  void TearDown() override {
    if (HasFailure() && cluster_) {
      std::cerr << "The server said:\n" << server_->process().err();
      for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
        if (entry.path().extension() == ".log") {
          std::ifstream log(entry.path());
          std::cerr << entry.path().filename() << ":\n" << log.rdbuf() << '\n';
        }
      }
    }
  }

  /// The key file of a server, client, reader or worker.
  std::string key_of(const std::string& role) const {
    return folder_.file("keys/" + role + ".key");
  }

  /// Variables of the batch script.
  Environment worker_environment() const {
    return {{"OBLIQUE_WORKER_SERVER", server_->worker_url()},
            {"OBLIQUE_WORKER_KEYS", key_of("worker")},
            {"OBLIQUE_WORKER_PROGRAM", worker_program()}};
  }

  /// Submits the batch script with more arguments and variables; the job's id.
  std::string submit_workers(std::vector<std::string> arguments = {},
                             const Environment& more = {}) const {
    Environment all = more;
    all.merge(worker_environment());
    arguments.insert(arguments.begin(), {"--parsable", kTimeLimit});
    arguments.emplace_back(OBLIQUE_WORKERS_SCRIPT);
    return cluster_->run("sbatch", arguments, all);
  }

  /// Waits until the server has welcomed so many workers since it began.
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

  /// One study more of `kPoints` points.
  void submit_study() {
    const std::string side = std::to_string(kSide);
    const auto submitted = run_oblique(
        folder_, {"submit", "--server", server_->client_url(), "--keys", key_of("client"),
                  "--preset", "paper", "--H", "1", "--mu", "0.1:2.0:" + side, "--e",
                  "0.5:1.0:" + side, "--no-reuse", "--name", "study" + std::to_string(++studies_)});
    ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  }

  double rows() const { return Database(database_).rows(); }

  /// Waits until workers of the job have delivered so many points of the last study.
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

  /// Nothing is lost, and nothing is counted against a point or a worker.
  void expect_each_point_once() {
    const Database database(database_);
    EXPECT_EQ(database.rows(), studies_ * kPoints);
    EXPECT_EQ(database.number("SELECT count(*) FROM results WHERE status <> 'solved'"), 0.0);
    EXPECT_EQ(server_->process().err().find("is lost"), std::string::npos)
        << server_->process().err();
  }

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  static constexpr int kSide = 25;  ///< sanitized programs are some twenty times slower
#else
  static constexpr int kSide = 110;
#endif
  static constexpr double kPoints = kSide * kSide;

  /// Of jobs: those of a test that was killed end by themselves.
  static constexpr const char* kTimeLimit = "--time=5";

  TemporaryFolder folder_;
  std::string database_{folder_.file("study.db")};
  std::optional<SlurmCluster> cluster_;
  std::optional<Server> server_;
  int studies_ = 0;
};

}  // namespace oblique::test
