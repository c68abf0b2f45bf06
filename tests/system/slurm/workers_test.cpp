// Studies that are solved by workers which a real Slurm starts, through deploy/slurm's script.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/system/slurm/slurm_fixture.h"

namespace oblique::test {
namespace {

class SlurmWorkersTest : public SlurmTest {};

TEST_F(SlurmWorkersTest, AStudyIsCompletedThoughOneJobIsCancelledAndOneIsQueuedAgain) {
  const auto cancelled = submit_workers();
  const auto queued_again = submit_workers();
  wait_for_workers(2);
  submit_study();
  wait_until_solved_by(cancelled, 100);
  wait_until_solved_by(queued_again, 100);
  cluster_->run("scancel", {cancelled});
  cluster_->run("scontrol", {"requeue", queued_again});
  cluster_->begin_now(queued_again);
  wait_until_done();
  EXPECT_EQ(cluster_->field_of(queued_again, "Restarts"), "1");
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

TEST_F(SlurmWorkersTest, WorkersHaveLeftInOrderBeforeTheirTimeIsOver) {
  // A minute is the shortest limit that Slurm has: they leave 53 s before, with work at hand unless
  // this machine is so slow that they begin later.
  const auto job = submit_workers({"--time=1"}, {{"OBLIQUE_WORKER_LEAVE_BEFORE", "53"}});
  submit_study();
  cluster_->wait_for_state(job, "COMPLETED");  // not TIMEOUT
  EXPECT_EQ(cluster_->field_of(job, "ExitCode"), "0:0");
  submit_workers();
  wait_until_done();
  expect_each_point_once();
}

TEST_F(SlurmWorkersTest, PreemptedWorkersGiveBackTheirBatchesAndAreQueuedAgain) {
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

}  // namespace
}  // namespace oblique::test
