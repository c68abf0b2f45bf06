// Full disks, failing syncs, and `oblique run` when it is stopped or killed.
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/many_points.h"

namespace oblique::test {
namespace {

// ---- Disks ----

/// Limits the size of the files that a process writes, to simulate a full disk.
void limit_files(pid_t pid, rlim_t bytes) {
  const rlimit limit{bytes, RLIM_INFINITY};
  ASSERT_EQ(prlimit(pid, RLIMIT_FSIZE, &limit, nullptr), 0);
}

std::string status_of(const TemporaryFolder& folder, const Server& server) {
  return run_oblique(folder, {"status", "full", "--server", server.client_url(), "--format", "csv"})
      .out;
}

TEST(DiskFullTest, AStudyWaitsForDiskSpaceReportsThisAndLosesNothing) {
  const TemporaryFolder folder;
  const std::string file = folder.file("full.db");
  const Database database(file);
  Server server(folder, file);
  constexpr rlim_t kRoom = 600'000;
  limit_files(server.process().pid(), kRoom);
  const Outcome submitted =
      run_oblique(folder, {"submit", "--preset", "paper", "--H", "1", "--mu", "0.1:2.0:50", "--e",
                           "0.5:1.0:40", "--name", "full", "--server", server.client_url()});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  Worker worker(folder, server.worker_url());
  wait_until("the study waits for the disk", [&] {
    return status_of(folder, server).find("accepts no results") != std::string::npos;
  });
  const double rows = database.rows();
  EXPECT_GT(rows, 0);
  EXPECT_LT(rows, 2000);
  const Outcome refused =
      run_oblique(folder, {"submit", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1",
                           "--name", "another", "--server", server.client_url()});
  // The submission succeeds if its rows still fit below the limit.
  EXPECT_TRUE(refused.exit_code == 0 || refused.err.find("was not stored") != std::string::npos)
      << refused.err;
  EXPECT_TRUE(is_running(server.process().pid()));
  EXPECT_TRUE(is_running(worker.pid()));
  limit_files(server.process().pid(), RLIM_INFINITY);
  const std::string rows_of_study = " FROM results WHERE study_id = 1";
  wait_until("the study is done",
             [&] { return database.number("SELECT count(*)" + rows_of_study) == 2000; });
  EXPECT_EQ(database.number("SELECT count(DISTINCT point)" + rows_of_study), 2000);
  EXPECT_EQ(status_of(folder, server).find("accepts no results"), std::string::npos);
  EXPECT_EQ(run_oblique(folder, {"check", "--db", file}).exit_code, 0);
}

TEST(FailedSyncTest, AServerExitsWithOneAndTheNextServerRecovers) {
  const TemporaryFolder folder;
  const std::string file = folder.file("failing.db");
  // LD_PRELOAD separates paths at spaces and colons, so a link whose path has none is used.
  const std::string library = folder.file("failing_sync.so");
  std::filesystem::create_symlink(OBLIQUE_FAILING_SYNC, library);
  const std::string mark = folder.file("fails");
  const auto submit = [&](const Server& server, const std::string& name) {
    return run_oblique(folder, {"submit", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e",
                                "1", "--name", name, "--server", server.client_url()});
  };
  {
    Server server(folder, file, {{"LD_PRELOAD", library}, {"OBLIQUE_FAIL_SYNC", mark}});
    ASSERT_EQ(submit(server, "before").exit_code, 0);
    std::ofstream(mark).put('x');
    EXPECT_NE(submit(server, "lost").exit_code, 0) << "the study was not stored";
    EXPECT_EQ(server.process().wait(), 1);
    EXPECT_NE(server.process().err().find("the disk failed to store"), std::string::npos)
        << server.process().err();
  }
  Server next(folder, file);
  EXPECT_EQ(submit(next, "after").exit_code, 0);
  Worker worker(folder, next.worker_url());
  for (const char* study : {"before", "after"}) {
    EXPECT_EQ(run_oblique(folder, {"watch", study, "--server", next.client_url()}).exit_code, 0);
  }
  EXPECT_EQ(run_oblique(folder, {"check", "--db", file}).exit_code, 0);
}

// ---- Runs ----

/// Runs `oblique run` on a study that takes long enough to be interrupted.
class RunTest : public ::testing::Test {
 protected:
  std::vector<std::string> arguments() const {
    return many_points("some", {"run", "--workers", "2", "--db", folder_.file("some.db")});
  }
  static constexpr double kPoints = kManyPoints;

  /// Waits until results are stored, and returns the server and the workers of a run.
  std::vector<pid_t> started_by(const Process& run) {
    wait_until("rows in the database", [&] { return database_.rows() >= kPoints / 400; });
    const auto children = children_of(run.pid());
    EXPECT_EQ(children.size(), 3U);
    return children;
  }

  static void expect_gone(const std::vector<pid_t>& processes) {
    wait_until("all processes of the run are gone",
               [&] { return std::none_of(processes.begin(), processes.end(), is_running); });
  }

  TemporaryFolder folder_;
  Database database_{folder_.file("some.db")};
};

TEST_F(RunTest, CtrlCLeavesNothingRunningAndTheSameCommandContinues) {
  Process run(folder_, client_program(), arguments());
  const auto children = started_by(run);
  kill(-run.pid(), SIGINT);  // signals the process group, as a terminal does
  EXPECT_EQ(run.wait(), 128 + SIGINT);
  EXPECT_NE(run.err().find("the same command continues"), std::string::npos) << run.err();
  EXPECT_EQ(run.out(), "");
  for (const pid_t child : children) {
    EXPECT_FALSE(is_running(child));
  }
  const double rows = database_.rows();
  ASSERT_LT(rows, kPoints) << "the study was complete before the run was stopped";
  const auto kept = database_.texts("SELECT point || ' ' || solved_at FROM results ORDER BY point");

  const Outcome again = run_oblique(folder_, arguments());
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(database_.rows(), kPoints);
  const auto now = database_.texts("SELECT point || ' ' || solved_at FROM results ORDER BY point");
  EXPECT_TRUE(std::includes(now.begin(), now.end(), kept.begin(), kept.end(),
                            [](const std::string& a, const std::string& b) {
                              return std::stoll(a) != std::stoll(b) ? std::stoll(a) < std::stoll(b)
                                                                    : a < b;
                            }))
      << "points were solved again";
}

TEST_F(RunTest, ARunThatIsKilledLeavesNoProcessAndTheSameCommandContinues) {
  Process run(folder_, client_program(), arguments());
  const auto children = started_by(run);
  run.send(SIGKILL);
  EXPECT_EQ(run.wait(), -SIGKILL);
  expect_gone(children);
  ASSERT_LT(database_.rows(), kPoints) << "the study was complete before the run was killed";
  const Outcome again = run_oblique(folder_, arguments());
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), kPoints);
}

TEST(WorkerOfARunTest, EndsIfTheRunWasKilledBeforeTheWorkerStarted) {
  const TemporaryFolder folder;
  Process parent(folder, client_program(), {"--help"});
  parent.wait();
  Process worker(
      folder, worker_program(),
      {"--server", "tcp://127.0.0.1:1", "--stop-with-parent", std::to_string(parent.pid())});
  EXPECT_EQ(worker.wait(), 0);
  EXPECT_NE(worker.err().find("parent process ended before"), std::string::npos) << worker.err();
}

TEST_F(RunTest, ARunContinuesWhenOneOfItsWorkersIsKilled) {
  Process run(folder_, client_program(), arguments());
  const auto children = started_by(run);
  // `oblique run` starts its workers after the server
  const pid_t worker = *std::max_element(children.begin(), children.end());
  kill(worker, SIGKILL);
  EXPECT_EQ(run.wait(), 0) << run.err();
  EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), kPoints);
}

TEST_F(RunTest, ASecondRunOnADatabaseInUseIsRefusedAndTheFirstContinues) {
  Process first(folder_, client_program(), arguments());
  started_by(first);
  Process second(folder_, client_program(), arguments());
  EXPECT_EQ(second.wait(), 1);
  EXPECT_NE(second.err().find("is in use by `oblique run` (process "), std::string::npos)
      << second.err();
  EXPECT_EQ(first.wait(), 0) << first.err();
  EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), kPoints);
}

}  // namespace
}  // namespace oblique::test
