// Snapshots while a pretended worker and client do things.
#include "server/web/status/snapshot.h"

#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

/// Takes everything.
class TakingStorage final : public Storage {
 public:
  void commit(std::span<const Change> /*changes*/) override {}
  void check() override {}
  bool merge_log() override { return true; }
};

class SnapshotTest : public ServiceTest {
 protected:
  Snapshot snapshot() { return take_snapshot({*service_, network_, writer_}, now_.steady_ms); }
  void submit(const std::string& name, std::uint64_t points, std::int32_t priority = 0) {
    ClientRequest message = submit_request(name, points);
    message.mutable_submit()->set_priority(priority);
    request(message);
    write_all();
  }
  static std::uint64_t workers(const Snapshot& snapshot, WorkerState state) {
    return snapshot.groups.at(static_cast<std::size_t>(state)).workers;
  }

  Network network_{NetworkLimits{}};
  TakingStorage storage_;
  Writer writer_{storage_, [](const auto&) {}};
};

TEST_F(SnapshotTest, FollowsPointsOnTheirWay) {
  submit("a", 100);
  EXPECT_EQ(snapshot().points_open, 100U);
  EXPECT_EQ(snapshot().points_leased, 0U);
  hello();
  EXPECT_EQ(workers(snapshot(), WorkerState::kIdle), 1U);
  credit(1);
  const std::vector<std::uint64_t> points = points_of(last_message().batch());
  const std::uint64_t leased = points.size();
  EXPECT_EQ(snapshot().points_leased, leased);
  EXPECT_EQ(workers(snapshot(), WorkerState::kWorking), 1U);
  now_.steady_ms += 700;
  answer_batch(points.back());  // the last point failed
  const Snapshot after = snapshot();
  EXPECT_EQ(after.points_solved, leased - 1);
  EXPECT_EQ(after.points_failed, 1U);
  EXPECT_EQ(after.points_open, 100 - leased);
  ASSERT_EQ(after.studies.size(), 1U);
  EXPECT_EQ(after.studies[0].solved(), leased - 1);
  EXPECT_EQ(after.studies[0].failed(), 1U);
  ASSERT_EQ(after.workers.size(), 1U);
  EXPECT_EQ(after.workers[0].solved_points(), leased - 1);
  EXPECT_GT(after.points_per_s, 0.0);
}

TEST_F(SnapshotTest, CountsAWorkerOnce) {
  hello("one");
  hello("other");
  now_.steady_ms += 2500;
  credit(1, "one");
  EXPECT_EQ(workers(snapshot(), WorkerState::kSilent), 1U);
  EXPECT_EQ(workers(snapshot(), WorkerState::kIdle), 1U);
}

TEST_F(SnapshotTest, CountsOnlyWhatRunsAsOpen) {
  submit("runs", 10);
  submit("paused", 20);
  submit("cancelled", 40);
  request(change_request("paused", protocol::STUDY_CHANGE_PAUSE));
  request(cancel_request("cancelled"));
  write_all();
  const Snapshot now = snapshot();
  EXPECT_EQ(now.points_open, 10U);
  EXPECT_EQ(now.studies_by_state.at(static_cast<std::size_t>(StudyState::kPaused)), 1U);
  EXPECT_EQ(now.studies_by_state.at(static_cast<std::size_t>(StudyState::kCancelled)), 1U);
  ASSERT_EQ(now.studies.size(), 2U);
  EXPECT_EQ(now.studies[1].name(), "paused");
}

TEST_F(SnapshotTest, ListsTheFiftyStudiesOfTheHighestPriority) {
  for (int i = 0; i < 120; ++i) {
    submit("study " + std::to_string(i), 10, i == 100 ? 5 : 0);
  }
  const Snapshot now = snapshot();
  ASSERT_EQ(now.studies.size(), kShownStudies);
  EXPECT_EQ(now.unlisted, 70U);
  EXPECT_EQ(now.points_open, 1200U);
  EXPECT_EQ(now.studies.front().name(), "study 100");
  EXPECT_EQ(now.studies[1].name(), "study 0");
  EXPECT_EQ(now.studies.back().name(), "study 48");
}

TEST_F(SnapshotTest, LeavesOutAStudyThatIsNotDurable) {
  request(submit_request("a", 10));
  EXPECT_TRUE(snapshot().studies.empty());
  write_all("disk full");
  EXPECT_EQ(snapshot().studies_by_state, (std::array<std::uint64_t, kStudyStates>{}));
}

TEST_F(SnapshotTest, SaysWhyNothingIsStored) {
  service_->written({WriteReport::Kind::kFault, 0, "disk full"}, now_);
  EXPECT_EQ(snapshot().database_fault, "disk full");
  service_->stop(now_);
  EXPECT_TRUE(snapshot().is_stopping);
}

TEST_F(SnapshotTest, TellsHowQueriesStand) {
  for (std::uint64_t id = 1; id <= 2; ++id) {
    ClientRequest message = client_request(id);
    message.mutable_query()->set_sql("SELECT 1");
    request(message);
  }
  service_->query_report({QueryReport::Kind::kBegun, ports_.queries.at(0).ticket, {}});
  EXPECT_EQ(snapshot().queries.waiting, 1U);
  EXPECT_EQ(snapshot().queries.running, 1U);
}

TEST(Snapshot, ThreadsAreWantedForOpenPointsOnly) {
  Snapshot snapshot;
  EXPECT_EQ(snapshot.threads_wanted(), 0U);
  snapshot.points_open = 1'000'000'000;
  EXPECT_EQ(snapshot.threads_wanted(), 1U);  // the time of a point is unknown
  snapshot.thread_s_per_point = 1e-9;
  EXPECT_EQ(snapshot.threads_wanted(), 1U);
  snapshot.thread_s_per_point = 6e-3;
  EXPECT_EQ(snapshot.threads_wanted(), 100'000U);
  snapshot.thread_s_per_point = 1e300;
  EXPECT_EQ(snapshot.threads_wanted(), 1'000'000'000U);
}

}  // namespace
}  // namespace oblique::server
