#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/system/many_points.h"

namespace oblique::test {
namespace {

constexpr double kCount = kManyPoints;

/// A server with a study of many points.
class KillTest : public ::testing::Test {
 protected:
  void submit() {
    std::vector<std::string> arguments{"submit", "--server", server_->client_url()};
    const auto points = many_points("many");
    arguments.insert(arguments.end(), points.begin(), points.end());
    const Outcome ran = run_oblique(folder_, arguments);
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
  }

  void start_worker() {
    workers_.push_back(std::make_unique<Worker>(folder_, server_->worker_url(),
                                                std::vector<std::string>{"--threads", "1"}));
  }

  void wait_for_rows(double rows) {
    wait_until("rows in the database", [&] { return database_.rows() >= rows; });
  }

  /// Every point has exactly one row, and that of its own values.
  void expect_complete() {
    wait_for_rows(kCount);
    EXPECT_EQ(database_.rows(), kCount);
    EXPECT_EQ(database_.number("SELECT count(*) FROM results WHERE status = 'solved'"), kCount);
    EXPECT_EQ(database_.number("SELECT count(DISTINCT point) FROM results"), kCount);
    EXPECT_EQ(database_.number("SELECT max(point) FROM results"), kCount - 1);
    EXPECT_EQ(database_.number("SELECT count(*) FROM (SELECT DISTINCT H, mu, e FROM results)"),
              kCount);
    wait_until("the study is done",
               [&] { return database_.texts("SELECT state FROM studies").at(0) == "done"; });
  }

  TemporaryFolder folder_;
  Database database_{folder_.file("many.db")};
  std::unique_ptr<Server> server_ = std::make_unique<Server>(folder_, folder_.file("many.db"));
  std::vector<std::unique_ptr<Worker>> workers_;
};

TEST_F(KillTest, AServerKilledInTheMiddleOfAStudyAndStartedAgainCompletesItWithTheSameWorkers) {
  submit();
  start_worker();
  start_worker();
  for (const double rows : {kCount / 40, 3 * kCount / 40, kCount / 8}) {
    wait_for_rows(rows);
    server_->process().send(SIGKILL);
    EXPECT_EQ(server_->process().wait(), -SIGKILL);
    ASSERT_LT(database_.rows(), kCount) << "killed too late to be a test";
    server_ = std::make_unique<Server>(folder_, folder_.file("many.db"), *server_);
  }
  expect_complete();
  for (const auto& worker : workers_) {
    worker->send(SIGTERM);
    EXPECT_EQ(worker->wait(), 0) << worker->err();
  }
}

TEST_F(KillTest, AServerToldToStopInTheMiddleOfAStudyAndStartedAgainCompletesIt) {
  submit();
  start_worker();
  wait_for_rows(kCount / 40);
  server_->process().send(SIGTERM);
  EXPECT_EQ(server_->process().wait(), 0) << server_->process().err();
  ASSERT_LT(database_.rows(), kCount) << "stopped too late to be a test";
  server_ = std::make_unique<Server>(folder_, folder_.file("many.db"), *server_);
  expect_complete();
}

TEST_F(KillTest, PointsOfAWorkerKilledInTheMiddleOfAStudyAreSolvedByTheOthers) {
  submit();
  start_worker();
  start_worker();
  wait_for_rows(kCount / 40);
  workers_.front()->send(SIGKILL);
  EXPECT_EQ(workers_.front()->wait(), -SIGKILL);
  ASSERT_LT(database_.rows(), kCount) << "killed too late to be a test";
  expect_complete();
  EXPECT_EQ(
      database_.number("SELECT count(*) FROM results WHERE worker_id IS NULL OR worker_id NOT IN"
                       " (SELECT worker_id FROM workers)"),
      0);
}

TEST_F(KillTest, AStudyWhoseOnlyWorkerWasKilledWaitsForTheNextOne) {
  submit();
  start_worker();
  wait_for_rows(kCount / 40);
  workers_.front()->send(SIGKILL);
  workers_.front()->wait();
  ASSERT_LT(database_.rows(), kCount) << "killed too late to be a test";
  start_worker();
  expect_complete();
}

TEST_F(KillTest, AWorkerThatWasHaltedAndGivenUpComesBackAndNothingIsStoredTwice) {
  submit();
  start_worker();
  start_worker();
  wait_for_rows(kCount / 40);
  workers_.front()->send(SIGSTOP);
  wait_until("the halted worker is given up",
             [&] { return server_->process().err().find("silent for") != std::string::npos; });
  workers_.front()->send(SIGCONT);
  expect_complete();
  workers_.front()->send(SIGTERM);
  EXPECT_EQ(workers_.front()->wait(), 0) << workers_.front()->err();
}

}  // namespace
}  // namespace oblique::test
