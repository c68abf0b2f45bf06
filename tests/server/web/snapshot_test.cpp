// What the numbers say while a pretended worker and client do things.
#include "server/web/snapshot.h"

#include <gtest/gtest.h>

#include "server/web/notice_board.h"
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
  Snapshot snapshot() {
    return take_snapshot({*service_, network_, writer_, 0, {}, 1, {}, 0}, now_.steady_ms);
  }
  void submit(const std::string& name, std::uint64_t points, std::int32_t priority = 0) {
    ClientRequest message = submit_request(name, points);
    message.mutable_submit()->set_priority(priority);
    request(message);
    write_all();
  }
  static std::uint64_t workers(const Snapshot& snapshot, CrewState state) {
    return snapshot.crews.at(static_cast<std::size_t>(state)).workers;
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
  EXPECT_EQ(workers(snapshot(), CrewState::kIdle), 1U);
  credit(1);
  const std::vector<std::uint64_t> points = points_of(last_message().batch());
  const std::uint64_t leased = points.size();
  EXPECT_EQ(snapshot().points_leased, leased);
  EXPECT_EQ(snapshot().batches_leased, 1U);
  EXPECT_EQ(workers(snapshot(), CrewState::kWorking), 1U);
  now_.steady_ms += 700;
  answer_batch(points.back());  // the last point failed
  const Snapshot after = snapshot();
  EXPECT_EQ(after.points_solved, leased - 1);
  EXPECT_EQ(after.points_failed, 1U);
  EXPECT_EQ(after.points_open, 100 - leased);
  ASSERT_EQ(after.listed.size(), 1U);
  EXPECT_EQ(after.listed[0].solved, leased - 1);
  EXPECT_EQ(after.listed[0].failed, 1U);
  EXPECT_DOUBLE_EQ(after.batch_s.sum(), 0.7);
  EXPECT_GT(after.points_per_s, 0.0);
}

TEST_F(SnapshotTest, CountsAWorkerOnce) {
  hello("one");
  hello("other");
  now_.steady_ms += 2500;
  credit(1, "one");
  EXPECT_EQ(workers(snapshot(), CrewState::kSilent), 1U);
  EXPECT_EQ(workers(snapshot(), CrewState::kIdle), 1U);
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
  EXPECT_EQ(now.studies.at(static_cast<std::size_t>(StudyState::kPaused)), 1U);
  EXPECT_EQ(now.studies.at(static_cast<std::size_t>(StudyState::kCancelled)), 1U);
  ASSERT_EQ(now.listed.size(), 2U);
  EXPECT_EQ(now.listed[1].name, "paused");
}

TEST_F(SnapshotTest, TellsWhatAKeyHasOpen) {
  const auto holder = std::make_shared<const KeyIdentity>(KeyIdentity{"lab", protocol::Role::kClient});
  service_->client_frame("client", protocol::encode(submit_request("a", 10)), now_, holder);
  write_all();
  submit("of nobody", 20);
  const auto open = snapshot().open_by_key;
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open.at("lab").studies, 1U);
  EXPECT_EQ(open.at("lab").points, 10U);
}

TEST_F(SnapshotTest, ListsTheFiftyStudiesOfTheHighestPriority) {
  for (int i = 0; i < 120; ++i) {
    submit("study " + std::to_string(i), 10, i == 100 ? 5 : 0);
  }
  const Snapshot now = snapshot();
  ASSERT_EQ(now.listed.size(), kListedStudies);
  EXPECT_EQ(now.unlisted, 70U);
  EXPECT_EQ(now.points_open, 1200U);
  EXPECT_EQ(now.listed.front().name, "study 100");
  EXPECT_EQ(now.listed[1].name, "study 0");
  EXPECT_EQ(now.listed.back().name, "study 48");
}

TEST_F(SnapshotTest, LeavesOutAStudyThatIsNotDurable) {
  request(submit_request("a", 10));
  EXPECT_TRUE(snapshot().listed.empty());
  EXPECT_EQ(snapshot().writer_jobs, 1U);
  write_all("disk full");
  EXPECT_EQ(snapshot().writer_jobs, 0U);
  EXPECT_EQ(snapshot().studies, (std::array<std::uint64_t, kStudyStates>{}));
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

TEST(NoticeBoard, AsksTheLoopOnlyWhenSomebodyWants) {
  NoticeBoard board(0);
  EXPECT_FALSE(board.is_due(10'000));
  EXPECT_EQ(board.latest(), nullptr);
  board.want();
  EXPECT_TRUE(board.is_due(10'000));
  Snapshot snapshot;
  snapshot.made_ms = 10'000;
  EXPECT_TRUE(board.put(snapshot));
  EXPECT_FALSE(board.is_due(20'000));
  ASSERT_NE(board.latest(), nullptr);
  EXPECT_EQ(board.latest()->made_ms, 10'000);
}

TEST(NoticeBoard, TakesTwoSnapshotsASecondAtMost) {
  NoticeBoard board(0);
  int made = 0;
  for (std::int64_t now_ms = 0; now_ms < 10'000; now_ms += 10) {
    board.want();
    if (board.is_due(now_ms)) {
      Snapshot snapshot;
      snapshot.made_ms = now_ms;
      made += board.put(snapshot) ? 1 : 0;
    }
  }
  EXPECT_EQ(made, 20);
}

}  // namespace
}  // namespace oblique::server
