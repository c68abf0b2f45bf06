#include "client/autoscale/slurm_engine.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using ::testing::HasSubstr;

/// Programs of Slurm's names that do as told, found first in PATH.
class SlurmEngineTest : public ::testing::Test {
 protected:
  SlurmEngineTest() : path_(std::getenv("PATH")) {
    setenv("PATH", (folder_.path().string() + ":" + path_).c_str(), 1);
  }
  ~SlurmEngineTest() override { setenv("PATH", path_.c_str(), 1); }

  /// A program that notes its arguments, one a line, and goes on with `script`.
  void pretend(const std::string& program, const std::string& script) {
    const auto file = folder_.file(program);
    std::ofstream(file) << "#!/bin/sh\nprintf '%s\\n' \"$@\" > " << folder_.file("arguments")
                        << "\n"
                        << script << "\n";
    chmod(file.c_str(), 0700);
  }

  std::string arguments() const {
    std::ifstream file(folder_.file("arguments"));
    return {std::istreambuf_iterator<char>(file), {}};
  }

  static SlurmSettings settings() {
    SlurmSettings settings;
    settings.script = "workers.sbatch";
    settings.sbatch_arguments = {"--partition=short"};
    settings.job_name = "sweeps";
    settings.comment = "oblique autoscale for tcp://head:7600";
    return settings;
  }

  std::string listing_error() {
    try {
      engine_.jobs();
      return "none";
    } catch (const EngineError& error) {
      return error.what();
    }
  }

  test::TemporaryFolder folder_;
  std::string path_;
  SlurmEngine engine_{settings()};
};

TEST_F(SlurmEngineTest, ListsTheJobsThatBearItsComment) {
  pretend("squeue", R"(cat <<'END'
12|RUNNING|oblique autoscale for tcp://head:7600
13|PENDING|oblique autoscale for tcp://head:7600
14|RUNNING|oblique autoscale for tcp://other:7600
15|RUNNING|(null)
16|COMPLETING|oblique autoscale for tcp://head:7600
17|TIMEOUT|oblique autoscale for tcp://head:7600
18|COMPLETED|oblique autoscale for tcp://head:7600
19|NEVER_HEARD_OF|oblique autoscale for tcp://head:7600
END)");
  std::string seen;
  for (const auto& job : engine_.jobs()) {
    seen += job.id + ":" + std::to_string(static_cast<int>(job.state)) + " ";
  }
  EXPECT_EQ(seen, "12:1 13:0 16:2 17:3 18:3 19:1 ");
  EXPECT_THAT(arguments(), HasSubstr("--name=sweeps\n"));
}

TEST_F(SlurmEngineTest, AnEmptyListIsNoError) {
  pretend("squeue", "");
  EXPECT_TRUE(engine_.jobs().empty());
}

TEST_F(SlurmEngineTest, WhatIsNoListIsRefused) {
  for (const char* line : {"12", "12|RUNNING", "x12|RUNNING|y", "|RUNNING|y", "12_[1-4]|PENDING|y",
                           "slurm_load_jobs error: Unable to contact slurm controller"}) {
    pretend("squeue", "echo '" + std::string(line) + "'");
    EXPECT_THAT(listing_error(), HasSubstr("squeue lists what is no job")) << line;
  }
}

TEST_F(SlurmEngineTest, AControllerThatIsAwayIsAnErrorWithItsWords) {
  pretend("squeue", "echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2; exit 1");
  EXPECT_EQ(listing_error(),
            "squeue ended with exit code 1: slurm_load_jobs error: Unable to contact slurm "
            "controller");
}

TEST_F(SlurmEngineTest, OfWhatSqueueSaysInManyLinesTheLastIsTold) {
  pretend("squeue", "echo 'squeue: error: trying again' >&2; echo 'squeue: away' >&2; exit 1");
  EXPECT_EQ(listing_error(), "squeue ended with exit code 1: squeue: away");
}

TEST_F(SlurmEngineTest, WhereThereIsNoSlurmItSaysWhereItShouldRun) {
  setenv("PATH", folder_.path().c_str(), 1);
  EXPECT_EQ(listing_error(), "Slurm's squeue is not in PATH: run this where sbatch works");
}

TEST_F(SlurmEngineTest, VariablesThatFilterTheListHaveNoEffect) {
  setenv("SQUEUE_PARTITION", "other", 1);
  pretend("squeue", "echo \"12|RUNNING|${SQUEUE_PARTITION}oblique autoscale for tcp://head:7600\"");
  EXPECT_EQ(engine_.jobs().size(), 1U);
  unsetenv("SQUEUE_PARTITION");
}

TEST_F(SlurmEngineTest, SubmitsTheScriptUnderItsNameWhateverElseIsAsked) {
  pretend("sbatch", "echo '4711;cluster'");
  EXPECT_EQ(engine_.submit(), "4711");
  EXPECT_EQ(arguments(),
            "--partition=short\n--parsable\n--job-name=sweeps\n"
            "--comment=oblique autoscale for tcp://head:7600\nworkers.sbatch\n");
  EXPECT_EQ(engine_.submission(),
            "sbatch --partition=short --parsable --job-name=sweeps "
            "'--comment=oblique autoscale for tcp://head:7600' workers.sbatch");
}

TEST_F(SlurmEngineTest, ASubmissionThatGivesNoNumberIsAnError) {
  pretend("sbatch", "echo Submitted batch job 12");
  EXPECT_THROW(engine_.submit(), EngineError);
}

TEST_F(SlurmEngineTest, SignalsWhatRunsAndCancelsWhatWaits) {
  pretend("scancel", "");
  engine_.retire({"12", "13"});
  EXPECT_EQ(arguments(), "--signal=TERM\n--quiet\n12\n13\n");
  engine_.withdraw({"14"});
  EXPECT_EQ(arguments(), "--state=PENDING\n--quiet\n14\n");
  engine_.end({"15"});
  EXPECT_EQ(arguments(), "--quiet\n15\n");
}

TEST_F(SlurmEngineTest, AnEmptyOrderIsNone) {
  pretend("scancel", "exit 1");
  engine_.end({});
  EXPECT_EQ(arguments(), "");
}

TEST_F(SlurmEngineTest, KnowsItsWorkersByTheirNames) {
  EXPECT_EQ(engine_.job_of_worker("slurm-12-n1"), "12");
  EXPECT_EQ(engine_.job_of_worker("slurm-12-rack-7-n1"), "12");
  for (const char* name : {"n1:4711", "slurm-", "slurm-12", "slurm-x-n1", "slurm--n1"}) {
    EXPECT_EQ(engine_.job_of_worker(name), std::nullopt) << name;
  }
}

TEST_F(SlurmEngineTest, ArgumentsThatMakeOtherJobsAreWrongUsage) {
  for (const char* argument :
       {"--array=1-4", "-a1-4", "-J", "--job-name=x", "--comment", "-W", "--arr=1-4", "--comm=x"}) {
    auto wrong = settings();
    wrong.sbatch_arguments = {argument};
    EXPECT_THROW(SlurmEngine{wrong}, solver::InputError) << argument;
  }
}

TEST_F(SlurmEngineTest, ANameThatSqueueTakesForSeveralIsWrongUsage) {
  auto wrong = settings();
  wrong.job_name = "day,night";
  EXPECT_THROW(SlurmEngine{wrong}, solver::InputError);
}

}  // namespace
}  // namespace oblique::client
