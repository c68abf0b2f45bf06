// Results that another study has are reused, in the whole server.
#include "server/event_loop/event_loop.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/query/reader.h"
#include "tests/server/event_loop/running_server.h"
#include "tests/support/recipes.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using protocol::listed;
using protocol::range;
using protocol::recipe_of;

protocol::Recipe grid(double first_mu, double last_mu, std::uint64_t count) {
  return recipe_of(
      {{listed("H", {0.9, 1.0}), range("mu", first_mu, last_mu, count), listed("e", {0.5, 1.0})}});
}

class ReuseTest : public testing::Test {
 protected:
  void start() {
    server_.reset();
    server_ = std::make_unique<RunningServer>(path_);
    client_ = std::make_unique<PretendedClient>(server_->client_endpoint());
  }
  void stop() {
    client_.reset();
    server_.reset();
  }
  protocol::SubmitReply submit(const std::string& name, const protocol::Recipe& recipe,
                               bool no_reuse = false) {
    ClientRequest request;
    request.mutable_submit()->set_name(name);
    *request.mutable_submit()->mutable_recipe() = recipe;
    request.mutable_submit()->set_no_reuse(no_reuse);
    const ClientReply reply = client_->ask(request);
    EXPECT_TRUE(reply.has_submit()) << reply.error().message();
    return reply.submit();
  }
  void work(std::uint64_t points) {
    PretendedWorker worker(server_->worker_endpoint());
    worker.hello();
    worker.work(points);
  }
  std::int64_t number(const std::string& sql) {
    return std::get<std::int64_t>(Reader(path_).query(sql, kNoLimits).rows.at(0).at(0));
  }
  void by_hand(const std::string& sql) {
    const DatabaseHandle database = open_database(path_, SQLITE_OPEN_READWRITE);
    execute(database.get(), sql);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  std::unique_ptr<RunningServer> server_;
  std::unique_ptr<PretendedClient> client_;
};

TEST_F(ReuseTest, TheSamePointsUnderAnotherNameAreCopiesOfTheRowsBitByBit) {
  start();
  submit("a", grid(0.0, 1.0, 5));
  work(20);
  const auto reply = submit("b", grid(0.0, 1.0, 5));
  EXPECT_EQ(reply.settled(), 20U);
  EXPECT_EQ(reply.taken().points(), 20U);
  ASSERT_EQ(reply.taken().from_size(), 1);
  EXPECT_EQ(reply.taken().from(0).study(), "a");
  EXPECT_EQ(reply.taken().from(0).points(), 20U);
  const auto status = client_->status("b");
  EXPECT_EQ(status.state(), "done");
  EXPECT_EQ(status.solved(), 20U);
  EXPECT_EQ(status.taken().points(), 20U);
  EXPECT_EQ(number("SELECT count(*) FROM runs AS a JOIN runs AS b USING (point, H, mu, e, status,"
                   " duration_s, fn_peak_N, ft_peak_N, mode, peaks, phases, stick_intervals,"
                   " reaction_peaks, worker_id, solver_version, attempt, solved_at, model_id)"
                   " WHERE a.study = 'a' AND b.study = 'b' AND a.reused_from IS NULL"
                   " AND b.reused_from = 'a/' || point"),
            20);
  stop();
  EXPECT_EQ(Reader(path_).study_status("b").at(0).taken().points(), 20U);
}

TEST_F(ReuseTest, OfAnOverlappingGridOnlyTheRestIsSolved) {
  start();
  submit("a", grid(0.0, 1.0, 11));
  work(44);
  const auto reply = submit("b", grid(0.5, 1.5, 11));  // mu 0.5 to 1.0 is known
  EXPECT_EQ(reply.taken().points(), 24U);
  EXPECT_EQ(client_->status("b").state(), "running");
  work(20);
  EXPECT_EQ(client_->status("b").state(), "done");
  EXPECT_EQ(number("SELECT count(*) FROM runs WHERE study = 'b' AND reused_from IS NULL"
                   " AND mu > 1.0"),
            20);
}

TEST_F(ReuseTest, PointsThatAFilterLeavesOutAreNotReused) {
  start();
  submit("a", grid(0.0, 1.0, 5));
  work(20);
  auto filtered = grid(0.0, 1.0, 5);
  filtered.mutable_blocks(0)->set_where("mu > 0.3");
  const auto reply = submit("b", filtered);
  EXPECT_EQ(reply.points(), 20U);
  EXPECT_EQ(reply.taken().points(), 12U);
  EXPECT_EQ(client_->status("b").state(), "running") << "until a worker has named the others";
  work(8);
  EXPECT_EQ(client_->status("b").state(), "done");
  EXPECT_EQ(client_->status("b").left_out(), 8U);
  EXPECT_EQ(number("SELECT count(*) FROM runs WHERE study = 'b' AND mu < 0.3"), 0);
}

TEST_F(ReuseTest, NoResultIsReusedUnlessItIsWantedAndOfTheSameSolverVersion) {
  start();
  submit("a", grid(0.0, 1.0, 5));
  work(20);
  EXPECT_EQ(submit("b", grid(0.0, 1.0, 5), true).settled(), 0U);
  stop();
  by_hand("UPDATE workers SET solver_version = '0.9'");
  start();
  EXPECT_EQ(submit("c", grid(0.0, 1.0, 5)).taken().points(), 0U);
  EXPECT_EQ(client_->status("c").state(), "running");
  EXPECT_EQ(number("SELECT count(*) FROM runs WHERE reused_from IS NOT NULL"), 0);
}

TEST_F(ReuseTest, ReusedRowsStayAndNameTheirSourceAsItWasCalledWhenItIsDeletedOrRenamed) {
  for (const bool is_deleted : {false, true}) {
    const std::string source = is_deleted ? "deleted" : "renamed";
    const std::string copy = source + " copy";
    start();
    const auto recipe = is_deleted ? grid(2.0, 3.0, 5) : grid(0.0, 1.0, 5);
    submit(source, recipe);
    work(20);
    submit(copy, recipe);
    const auto before = client_->status(copy).taken();
    ASSERT_EQ(before.from_size(), 1);
    EXPECT_EQ(before.from(0).study(), source);
    ClientRequest request;
    auto& change = *request.mutable_change();
    change.set_study(source);
    change.set_change(is_deleted ? protocol::STUDY_CHANGE_DELETE : protocol::STUDY_CHANGE_RENAME);
    change.set_new_name(is_deleted ? "" : "another");
    EXPECT_TRUE(client_->ask(request).has_change());
    EXPECT_EQ(client_->status(copy).taken().SerializeAsString(), before.SerializeAsString());
    stop();
    EXPECT_EQ(Reader(path_).study_status(copy).at(0).taken().SerializeAsString(),
              before.SerializeAsString());
  }
}

TEST_F(ReuseTest, AStudyThatGrowsReusesResultsForItsNewPoints) {
  start();
  submit("a", grid(0.0, 1.0, 5));
  work(20);
  auto growing = grid(2.0, 3.0, 5);
  submit("b", growing);
  work(20);
  *growing.add_blocks() = grid(0.5, 1.5, 5).blocks(0);
  const auto reply = submit("b", growing);
  EXPECT_EQ(reply.appended(), 20U);
  EXPECT_EQ(reply.taken().points(), 12U);
  work(8);
  EXPECT_EQ(client_->status("b").state(), "done");
}

TEST_F(ReuseTest, AServerThatWasKilledDuringALookupContinuesIt) {
  start();
  submit("a", grid(0.0, 1.0, 5));
  work(20);
  submit("b", grid(0.0, 1.0, 5));
  stop();
  // As if it had been killed after some rows.
  by_hand("DELETE FROM results WHERE study_id = 2 AND point > 3");
  by_hand("UPDATE studies SET state = 'running', reuses = 1 WHERE study_id = 2");
  by_hand("UPDATE reused_points SET points = 4");
  start();
  protocol::StudyStatus status;
  do {
    status = client_->status("b");
  } while (status.taken().under_way());
  EXPECT_EQ(status.state(), "done");
  EXPECT_EQ(status.taken().points(), 20U);
  EXPECT_EQ(number("SELECT count(*) FROM runs WHERE study = 'b' AND reused_from IS NOT NULL"), 20);
  EXPECT_EQ(number("SELECT count(*) FROM studies WHERE reuses"), 0);
}

}  // namespace
}  // namespace oblique::server
