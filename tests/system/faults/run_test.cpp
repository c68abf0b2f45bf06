#include <algorithm>
#include <csignal>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/many_points.h"

namespace oblique::test {
namespace {

/// `oblique run` of a study that takes long enough to be stopped in its middle.
class RunTest : public ::testing::Test {
 protected:
  std::vector<std::string> arguments() const {
    std::vector<std::string> words{"run", "--workers", "2", "--db", folder_.file("some.db")};
    const auto points = many_points("some");
    words.insert(words.end(), points.begin(), points.end());
    return words;
  }
  static constexpr double kPoints = kManyPoints;

  /// The server and the workers of a run, once all are there and at work.
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
  kill(-run.pid(), SIGINT);  // as a terminal does: to the whole group
  EXPECT_EQ(run.wait(), 128 + SIGINT);
  EXPECT_NE(run.err().find("the same command again"), std::string::npos) << run.err();
  EXPECT_EQ(run.out(), "");
  for (const pid_t child : children) {
    EXPECT_FALSE(is_running(child));
  }
  const double rows = database_.rows();
  ASSERT_LT(rows, kPoints) << "stopped too late to be a test";
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
  ASSERT_LT(database_.rows(), kPoints) << "killed too late to be a test";
  const Outcome again = run_oblique(folder_, arguments());
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), kPoints);
}

TEST(WorkerOfARunTest, EndsWhenTheRunWasKilledBeforeTheWorkerBegan) {
  const TemporaryFolder folder;
  Process parent(folder, client_program(), {"--help"});
  parent.wait();
  Process worker(
      folder, worker_program(),
      {"--server", "tcp://127.0.0.1:1", "--stop-with-parent", std::to_string(parent.pid())});
  EXPECT_EQ(worker.wait(), 0);
  EXPECT_NE(worker.err().find("parent process was gone"), std::string::npos) << worker.err();
}

TEST_F(RunTest, ARunGoesOnWhenOneOfItsWorkersIsKilled) {
  Process run(folder_, client_program(), arguments());
  const auto children = started_by(run);
  const pid_t worker = *std::max_element(children.begin(), children.end());  // started last
  kill(worker, SIGKILL);
  EXPECT_EQ(run.wait(), 0) << run.err();
  EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), kPoints);
}

TEST_F(RunTest, ASecondRunOnADatabaseInUseIsRefusedAndTheFirstGoesOn) {
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
