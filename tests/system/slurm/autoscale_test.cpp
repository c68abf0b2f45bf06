// oblique autoscale with a real Slurm.
#include <unistd.h>
#include <algorithm>
#include <csignal>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/system/slurm/slurm_fixture.h"

namespace oblique::test {
namespace {

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

  /// Variables for the client: Slurm's, and those that the jobs inherit.
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

TEST_F(SlurmAutoscaleTest, JobsComeUpForAStudyAndEndByThemselvesWhenItIsDone) {
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

TEST_F(SlurmAutoscaleTest, OneThatIsStoppedLeavesItsJobsAndTheNextOneCountsThem) {
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

}  // namespace
}  // namespace oblique::test
