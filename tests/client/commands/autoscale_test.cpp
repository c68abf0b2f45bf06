#include "client/commands/autoscale.h"

#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;

TEST(JobsToSubmit, AreOnePerHundredOpenPointsWithinLimitsMinusExistingJobs) {
  const struct {
    std::uint64_t open;
    std::size_t jobs;
    std::size_t least;
    std::size_t most;
    std::size_t submitted;
  } cases[] = {
      {0, 0, 0, 5, 0},      // nothing to do
      {1, 0, 0, 5, 1},      // one open point needs one job
      {100, 0, 0, 5, 1},    // one job for each 100 points
      {101, 0, 0, 5, 2},    // rounded up
      {101, 1, 0, 5, 1},    // one job exists
      {101, 2, 0, 5, 0},    // both needed jobs exist
      {101, 4, 0, 5, 0},    // surplus jobs end by themselves
      {1'000, 0, 0, 5, 5},  // the maximum
      {1'000, 3, 0, 5, 2},  // maximum of 5 jobs, 3 exist
      {1'000, 9, 0, 5, 0},  // maximum of 5 jobs, 9 exist
      {0, 0, 2, 5, 2},      // the minimum
      {0, 1, 2, 5, 1},      // minimum of 2 jobs, 1 exists
      {~std::uint64_t{0}, 0, 0, 10'000, 10'000},
  };
  for (const auto& each : cases) {
    EXPECT_EQ(jobs_to_submit(each.open, each.jobs, {each.least, each.most, 100}), each.submitted)
        << each.open << " open points, " << each.jobs << " jobs";
  }
}

TEST(OpenPoints, IncludeOnlyRunningStudiesThatMoreWorkersCanHelp) {
  const struct {
    const char* state;
    std::uint64_t points;
    std::uint64_t solved;
    const char* waits_for;
    std::uint64_t open;
  } cases[] = {
      {"running", 100, 30, "", 65},  // 3 points failed, a filter leaves out 2
      {"running", 100, 30, "a worker", 65},
      {"running", 100, 30, "the database, which accepts no results: disk full", 0},
      {"paused", 100, 30, "", 0},
      {"done", 100, 95, "", 0},
      {"running", 10, 30, "", 0},  // impossible: more points solved than exist
  };
  protocol::StatusReply all;
  std::uint64_t sum = 0;
  for (const auto& each : cases) {
    protocol::StatusReply status;
    auto& study = *status.add_studies();
    study.set_state(each.state);
    study.set_points(each.points);
    study.set_solved(each.solved);
    study.set_failed(3);
    study.set_left_out(2);
    study.set_waits_for(each.waits_for);
    EXPECT_EQ(open_points(status), each.open) << each.state << ' ' << each.waits_for;
    *all.add_studies() = study;
    sum += each.open;
  }
  EXPECT_EQ(open_points(all), sum);
}

/// `oblique autoscale` with a server and fake programs `squeue` and `sbatch`.
class Autoscale : public testing::Test {
 protected:
  Autoscale() {
    std::ofstream(folder_.file("jobs")) << "#!/bin/sh\n";
    install_fake("sbatch", "echo \"$@\" >> sbatch.log; echo '4711;cluster'");
    const auto submitted =
        test::run_oblique(folder_, {"submit", "--server", server_.client_url(), "--H", "1", "--mu",
                                    "0.1:2:5", "--e", "0.5:1:5", "--name", "study"});
    EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
  }

  void install_fake(const std::string& program, const std::string& script) const {
    std::ofstream(folder_.file(program)) << "#!/bin/sh\n" << script << '\n';
    chmod(folder_.file(program).c_str(), 0700);
  }

  std::unique_ptr<test::Process> started(const std::vector<std::string>& more,
                                         test::Environment environment = {}) const {
    environment.insert({"PATH", folder_.path().string() + ":/usr/bin:/bin"});
    std::vector<std::string> arguments{
        "autoscale", "slurm", "--server", server_.client_url(), "--script",
        "jobs",      "--max", "4",        "--points-per-job",   "5"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return std::make_unique<test::Process>(folder_, test::client_program(), arguments, environment);
  }

  std::string submissions() const {
    std::ifstream file(folder_.file("sbatch.log"));
    return {std::istreambuf_iterator<char>(file), {}};
  }

  test::TemporaryFolder folder_;
  test::Server server_{folder_, folder_.file("a.db")};
};

TEST_F(Autoscale, SubmitsTheScriptForMissingJobs) {
  install_fake("squeue",
               "echo \"$@\" > squeue.log\n"
               "printf 'RUNNING\\nPENDING\\nCOMPLETING\\n%s' \"${SQUEUE_PARTITION+FILTERED}\"");
  const std::string name = "--job-name=oblique@" + server_.client_url().substr(6);
  const std::string command = "--partition=short -A lab7 --parsable " + name + " jobs\n";
  const std::vector<std::string> arguments{"--sbatch-args", "--partition=short  -A lab7"};
  const auto with = [&](const std::string& flag) {
    auto all = arguments;
    all.push_back(flag);
    return all;
  };
  const auto dry = started(with("--dry-run"))->outcome();
  EXPECT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_EQ(dry.err,
            "25 points are open and 2 jobs are pending or running: would submit 2 jobs "
            "with: sbatch " +
                command);
  EXPECT_EQ(submissions(), "");
  const auto once = started(with("--once"), {{"SQUEUE_PARTITION", "other"}})->outcome();
  EXPECT_EQ(once.exit_code, 0) << once.err;
  EXPECT_THAT(once.err, HasSubstr("submitted job 4711\n"));
  EXPECT_EQ(submissions(), command + command);
  std::ifstream squeue_log(folder_.file("squeue.log"));
  EXPECT_THAT(std::string(std::istreambuf_iterator<char>(squeue_log), {}),
              HasSubstr("--me --array --name=oblique@" + server_.client_url().substr(6)));
}

TEST_F(Autoscale, FailsAtOnceIfSlurmFails) {
  const auto error = [this](const test::Environment& environment = {}) {
    const auto outcome = started({}, environment)->outcome();
    EXPECT_EQ(outcome.exit_code, 1);
    return outcome.err;
  };
  EXPECT_THAT(error({{"PATH", "/nowhere"}}), HasSubstr("squeue is not in PATH"));
  install_fake("squeue", "echo RUNNING; echo 'no controller' >&2; exit 1");
  EXPECT_THAT(error(), HasSubstr("squeue ended with exit code 1: no controller"));
  EXPECT_EQ(submissions(), "");
  install_fake("squeue", "");
  install_fake("sbatch", "echo 'invalid partition' >&2; exit 1");
  EXPECT_THAT(error(), HasSubstr("sbatch ended with exit code 1: invalid partition"));
}

TEST_F(Autoscale, ContinuesAfterAFailureOfSlurmAndEndsWithASignal) {
  install_fake("squeue", "[ ! -e away ] || exit 1; [ ! -e sbatch.log ] || cat jobs.now");
  std::ofstream(folder_.file("jobs.now")) << "RUNNING\nRUNNING\nPENDING\n";
  const auto client = started({"--interval", "0.1"});
  const auto wait_until_printed = [&](const std::string& words) {
    test::wait_until(words, [&] { return client->err().find(words) != std::string::npos; });
  };
  wait_until_printed("are pending or running: submitting 1 job\n");
  std::ofstream(folder_.file("away")) << "";
  wait_until_printed("trying again every 0.1 s");
  std::filesystem::remove(folder_.file("away"));
  wait_until_printed("succeeded again");
  client->send(SIGINT);
  EXPECT_EQ(client->wait(), 130);
  EXPECT_THAT(client->err(), HasSubstr("scancel --name oblique@"));
}

TEST(AutoscaleFlags, ThatCannotWorkAreWrongUsage) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("jobs")) << "server=${OBLIQUE_WORKER_SERVER:?\"needed\"}\n"
                                     << "keys=${OBLIQUE_WORKER_KEYS:-}\n";
  ASSERT_EQ(test::run_oblique(folder, {"keygen", "keys"}).exit_code, 0);
  const auto outcome_of = [&](std::vector<std::string> arguments, const test::Environment& more) {
    arguments.insert(arguments.begin(),
                     {"autoscale", "--server", "tcp://127.0.0.1:1", "--timeout", "0.1"});
    return test::Process(folder, test::client_program(), arguments, more).outcome();
  };
  const struct {
    std::vector<std::string> arguments;
    const char* expected;
  } wrong[] = {
      {{"slurm"}, "--max is required"},
      {{"pbs", "--max", "1"}, "it must be slurm"},
      {{"slurm", "--min", "3", "--max", "2", "--script", "jobs"}, "it must be at most --max 2"},
      {{"slurm", "--max", "2", "--script", "jobs", "--name", "a,b"}, "--name a,b is not allowed"},
      {{"slurm", "--max", "2", "--script", "jobs", "--sbatch-args", "--array=1-3"}, "is one job"},
      {{"slurm", "--max", "2", "--script", "jobs"}, "OBLIQUE_WORKER_SERVER is not set"},
  };
  for (const auto& [arguments, expected] : wrong) {
    const auto outcome = outcome_of(arguments, {});
    EXPECT_EQ(outcome.exit_code, 2) << expected << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(expected));
  }
  const auto warned =
      outcome_of({"slurm", "--max", "2", "--script", "jobs", "--once", "--keys", "keys/reader.key"},
                 {{"OBLIQUE_WORKER_SERVER", "tcp://127.0.0.1:2"}});
  EXPECT_EQ(warned.exit_code, 1) << warned.err;
  EXPECT_THAT(warned.err, HasSubstr("OBLIQUE_WORKER_KEYS is not set"));
}

}  // namespace
}  // namespace oblique::client
