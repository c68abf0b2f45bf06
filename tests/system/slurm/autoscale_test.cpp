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

  static void wait_until_said(const Process& client, const std::string& words) {
    wait_until("autoscale says: " + words + "; it said: " + client.err(),
               [&] { return client.err().find(words) != std::string::npos; });
  }

  static std::vector<std::string> quickly() {
    return {"--poll", "0.2", "--cool-down", "1", "--target", "1", "--forget", "2"};
  }

  static std::vector<std::string> quickly(const std::vector<std::string>& more) {
    auto all = quickly();
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};

TEST_F(SlurmAutoscaleTest, WorkersComeUpFromNoneAndAreRetiredToTheMinimumWhenTheQueueIsEmpty) {
  Process scaling(folder_, client_program(), autoscale(quickly({"--max", "2"})), environment());
  submit_study();
  wait_until_done();
  wait_for_jobs(0);
  expect_each_point_once();
  scaling.send(SIGINT);
  EXPECT_EQ(scaling.wait(), 130);
  EXPECT_NE(scaling.err().find("submitted: job"), std::string::npos) << scaling.err();
  EXPECT_NE(scaling.err().find("asked to leave:"), std::string::npos) << scaling.err();
}

TEST_F(SlurmAutoscaleTest, OneThatIsStoppedLeavesItsJobsAndTheNextOneFindsThem) {
  {
    Process scaling(folder_, client_program(), autoscale(quickly({"--min", "2", "--max", "2"})),
                    environment());
    wait_for_jobs(2);
    scaling.send(SIGINT);
    EXPECT_EQ(scaling.wait(), 130);
    EXPECT_NE(scaling.err().find("2 jobs go on"), std::string::npos) << scaling.err();
  }
  const auto again = once({"--min", "2", "--max", "2", "--once"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const auto dry = once({"--min", "3", "--max", "3", "--dry-run"});
  EXPECT_NE(dry.err.find("would submit a job with: sbatch"), std::string::npos) << dry.err;
  EXPECT_EQ(listed_jobs(), 2U);
  const auto retired = once({"--retire"});
  EXPECT_EQ(retired.exit_code, 0) << retired.err;
  EXPECT_EQ(listed_jobs(), 0U);
}

TEST_F(SlurmAutoscaleTest, JobsThatTheControllerForgotAreForgottenToo) {
  Process scaling(folder_, client_program(), autoscale(quickly({"--min", "1", "--max", "1"})),
                  environment());
  wait_for_jobs(1);
  cluster_->kill_controller();
  wait_until_said(scaling, "nothing changes until that is over");
  cluster_->start_controller(true);
  wait_until_said(scaling, "the list of jobs is there again");
  wait_until_said(scaling, "vanished");
  submit_study();
  wait_until_done();
  expect_each_point_once();
}

}  // namespace
}  // namespace oblique::test
