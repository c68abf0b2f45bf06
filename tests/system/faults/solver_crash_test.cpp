// The process that solves crashes or is killed; its parent starts another one.
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

std::size_t times(const std::string& part, const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

constexpr const char* kEnded = "ended the process that solves";

class SolverProcessTest : public ::testing::Test {
 protected:
  static pid_t solver_of(const Process& worker) {
    std::vector<pid_t> children;
    wait_until("the worker has a process that solves", [&] {
      children = children_of(worker.pid());
      return children.size() == 1;
    });
    return children[0];
  }
  static void wait_until_welcomed(const Process& worker) {
    wait_until("the worker is welcomed",
               [&] { return worker.err().find("welcomed") != std::string::npos; });
  }
  /// Kills the process that solves and waits until another one runs.
  static void kill_solver(const Process& worker, int signal) {
    const pid_t solver = solver_of(worker);
    kill(solver, signal);
    wait_until("another process solves", [&] { return solver_of(worker) != solver; });
  }
  void submit(const std::vector<std::string>& arguments) const {
    const Outcome submitted = run_oblique(folder_, arguments);
    ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  }
  void wait_for_end() const {
    wait_until("the study is done", [&] {
      return database_.texts("SELECT state FROM studies") == std::vector<std::string>{"done"};
    });
  }
  static void expect_stops(Process& worker) {
    worker.send(SIGTERM);
    EXPECT_EQ(worker.wait(), 0) << worker.err();
  }

  TemporaryFolder folder_;
  Server server_{folder_, folder_.file("a.db")};
  Database database_{folder_.file("a.db")};
};

TEST_F(SolverProcessTest, APointThatCrashesTheSolverCostsAtMostFourCrashesAndOnlyItFails) {
  std::ofstream(folder_.file("study.toml")) << R"(name = "crash"
[model]
preset = "paper"
[[block]]
H = 1.0
mu = { from = 0.1, to = 2.0, count = 63 }
e = { from = 0.5, to = 1.0, count = 65 }
[[block]]
dt = 2e-5  # too large, so that the solver reports an error
H = 1.0
mu = 0.4
e = 1.0
)";
  const std::string library = folder_.file("crashing_solver.so");
  std::filesystem::create_symlink(OBLIQUE_CRASHING_SOLVER, library);
  Worker worker(folder_, server_.worker_url(), {"--threads", "2"}, {{"LD_PRELOAD", library}});
  submit({"submit", folder_.file("study.toml"), "--server", server_.client_url()});
  wait_for_end();
  EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), 4095);
  EXPECT_EQ(database_.texts("SELECT error FROM results WHERE status <> 'solved'"),
            std::vector<std::string>{"the solver crashed on this point: signal 11, twice"});
  const std::size_t crashes = times(kEnded, worker.err());
  EXPECT_GE(crashes, 2U);
  EXPECT_LE(crashes, 4U) << worker.err();
  expect_stops(worker);
}

TEST_F(SolverProcessTest, KilledProcessesAreReplacedAndFailNoPoint) {
  Worker worker(folder_, server_.worker_url(), {"--threads", "1"});
  submit(many_points("some", {"submit", "--server", server_.client_url()}));
  for (int kills = 0; kills < 5; ++kills) {
    const double rows = database_.rows();
    wait_until("further rows", [&] { return database_.rows() > rows; });
    kill_solver(worker, SIGKILL);
  }
  wait_for_end();
  EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), kManyPoints);
  EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE attempt < 1"), 0);
  EXPECT_EQ(times(kEnded, worker.err()), 5U);
  expect_stops(worker);
}

TEST_F(SolverProcessTest, ASoundPointThatIsReportedOnceIsSolved) {
  Worker worker(folder_, server_.worker_url(), {"--threads", "1"});
  submit(many_points("some", {"submit", "--server", server_.client_url()}));
  wait_until("rows", [&] { return database_.rows() > 0; });
  kill_solver(worker, SIGABRT);
  wait_for_end();
  EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), kManyPoints);
}

TEST_F(SolverProcessTest, TheProcessThatSolvesEndsWithItsParentAndLeavesTheServer) {
  Worker worker(folder_, server_.worker_url(), {"--threads", "1"});
  const pid_t solver = solver_of(worker);
  wait_until_welcomed(worker);
  worker.send(SIGKILL);
  EXPECT_EQ(worker.wait(), -SIGKILL);
  wait_until("the process that solves is gone", [&] { return !is_running(solver); });
  wait_until("the server notices it",
             [&] { return server_.process().err().find(" leaves") != std::string::npos; });
}

TEST_F(SolverProcessTest, AWorkerStopsWhileItsSolverIsStartedAgainAndAgain) {
  Worker worker(folder_, "tcp://127.0.0.1:1", {"--threads", "1"});
  for (int kills = 0; kills < 6; ++kills) {
    kill_solver(worker, SIGABRT);
  }
  kill(solver_of(worker), SIGKILL);  // a pause of 0.8 s follows
  wait_until("the process was killed", [&] { return times(kEnded, worker.err()) == 7; });
  expect_stops(worker);
}

TEST_F(SolverProcessTest, ASignalToTheProcessThatSolvesStopsTheWorker) {
  Worker worker(folder_, server_.worker_url(), {"--threads", "1"});
  wait_until_welcomed(worker);
  kill(solver_of(worker), SIGTERM);
  EXPECT_EQ(worker.wait(), 0) << worker.err();
}

TEST_F(SolverProcessTest, AWorkerStopsWhileItsServerIsHalted) {
  Worker worker(folder_, server_.worker_url(), {"--threads", "1"});
  submit(many_points("some", {"submit", "--server", server_.client_url()}));
  wait_until("rows", [&] { return database_.rows() > 0; });
  server_.process().send(SIGSTOP);
  expect_stops(worker);
  server_.process().send(SIGCONT);
}

TEST_F(SolverProcessTest, OutOfMemoryEndsTheProcessThatSolvesFirst) {
  const auto score = [](pid_t process) {
    int adjustment = 0;
    std::ifstream("/proc/" + std::to_string(process) + "/oom_score_adj") >> adjustment;
    return adjustment;
  };
  Worker worker(folder_, server_.worker_url(), {"--threads", "1"});
  const pid_t solver = solver_of(worker);
  wait_until("the process is marked", [&] { return score(solver) >= 100; });
  EXPECT_LE(score(worker.pid()), score(solver));
}

}  // namespace
}  // namespace oblique::test
