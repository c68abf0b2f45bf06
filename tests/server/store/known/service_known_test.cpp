// Points that other studies have solved, as the service sees them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class ServiceKnownTest : public ServiceTest {
 protected:
  ServiceKnownTest() { outbox_.seeker.can = true; }

  /// Study 1, "a", is solved in part.
  void solve_some() {
    request(submit_request("a"));
    write_all();
    hello();
    credit(1);
    answer_batch(1000);
  }
  void found(std::uint64_t study, std::vector<SharedRun> runs) {
    service_->known({study, 1, std::move(runs)});
  }
  void end_of(std::uint64_t study) { service_->known({study, 0, {}, true, false}); }
  /// The copies that wait to be written are of these points.
  void write_copies(const IntervalSet& points) {
    for (WriteJob& job : outbox_.jobs) {
      if (auto* take = std::get_if<TakeResults>(&job.change)) {
        *take->taken = {points, "a"};
      }
    }
    write_all();
  }
};

TEST_F(ServiceKnownTest, WithoutAnyResultNothingIsSought) {
  request(submit_request("a"));
  write_all();
  EXPECT_THAT(outbox_.seeker.questions, IsEmpty());
  EXPECT_TRUE(last_reply().has_submit());
}

TEST_F(ServiceKnownTest, AStudyWithResultsIsASourceOnce) {
  solve_some();
  credit(1);
  answer_batch(1000);
  EXPECT_THAT(outbox_.seeker.sources, ElementsAre(1));
}

TEST_F(ServiceKnownTest, WhileKnownPointsAreSoughtNothingIsHandedOutAndTheReplyWaits) {
  solve_some();
  request(submit_request("b"));
  const std::size_t replies = outbox_.replies.size();
  write_all();
  ASSERT_THAT(outbox_.seeker.questions, SizeIs(1));
  EXPECT_EQ(outbox_.seeker.questions[0].study_id, 2U);
  EXPECT_EQ(outbox_.replies.size(), replies);
  EXPECT_THAT(status_of("b").waits_for(), HasSubstr("known points to be taken over"));
  found(2, {{0, 0, 4}});
  write_copies(IntervalSet(0, 4));
  EXPECT_EQ(outbox_.seeker.done, 1);
  EXPECT_EQ(status_of("b").solved(), 4U);
  EXPECT_THAT(status_of("b").waits_for(), HasSubstr("4 so far"));
  end_of(2);
  write_all();
  const auto reply = last_reply().submit();
  EXPECT_EQ(reply.settled(), 4U);
  EXPECT_EQ(reply.taken().points(), 4U);
  EXPECT_EQ(reply.taken().from(0).study(), "a");
  EXPECT_FALSE(status_of("b").taken().under_way());
  EXPECT_EQ(status_of("b").waits_for(), "");
}

TEST_F(ServiceKnownTest, PointsAreSoughtWithThePriorityOfTheStudyAlsoWhenItChanges) {
  solve_some();
  auto urgent = submit_request("b");
  urgent.mutable_submit()->set_priority(7);
  request(urgent);
  write_all();
  ASSERT_THAT(outbox_.seeker.questions, SizeIs(1));
  EXPECT_EQ(outbox_.seeker.questions[0].priority, 7);
  urgent.mutable_submit()->set_priority(9);
  request(urgent);
  write_all();
  EXPECT_THAT(outbox_.seeker.priorities, ElementsAre(std::pair(2U, 9)));
}

TEST_F(ServiceKnownTest, TheReplyWaitsNotForEver) {
  solve_some();
  request(submit_request("b"));
  write_all();
  now_.steady_ms += 2000;
  service_->tick(now_);
  const auto reply = last_reply().submit();
  EXPECT_EQ(reply.study_id(), 2U);
  EXPECT_TRUE(reply.taken().under_way());
}

TEST_F(ServiceKnownTest, AFreshStudySeeksNothing) {
  solve_some();
  auto fresh = submit_request("b");
  fresh.mutable_submit()->set_fresh(true);
  request(fresh);
  write_all();
  EXPECT_THAT(outbox_.seeker.questions, IsEmpty());
  EXPECT_EQ(last_reply().submit().study_id(), 2U);
}

TEST_F(ServiceKnownTest, AStudyThatGrowsSeeksToo) {
  solve_some();
  request(submit_request("b", 7));
  write_all();
  end_of(2);
  write_all();
  auto longer = submit_request("b", 7);
  *longer.mutable_submit()->mutable_recipe()->add_blocks() = table_of(10)->recipe().blocks(0);
  request(longer);
  write_all();
  EXPECT_THAT(outbox_.seeker.questions, SizeIs(2));
  end_of(2);
  write_all();
  EXPECT_EQ(last_reply().submit().appended(), 10U);
}

TEST_F(ServiceKnownTest, ACancelledStudyStopsSeekingAndADeletedOneIsNoSource) {
  solve_some();
  request(submit_request("b"));
  write_all();
  request(cancel_request("b"));
  write_all();
  EXPECT_THAT(outbox_.seeker.stopped, ElementsAre(2));
  request(change_request("b", protocol::STUDY_CHANGE_DELETE));
  write_all();
  EXPECT_THAT(outbox_.seeker.dropped, ElementsAre(2));
  found(2, {{0, 0, 4}});
  EXPECT_EQ(outbox_.seeker.done, 1) << "what was on its way is dealt with";
  end_of(2);
  write_all();
  EXPECT_THAT(outbox_.jobs, IsEmpty());
}

TEST_F(ServiceKnownTest, AServerThatStartsGoesOnWithWhatWasNotAtItsEnd) {
  ServiceSettings settings;
  settings.solver_version = "1.0";
  StoredStudy source{1, "a", table_of(10), StudyState::kRunning, "then", {}, {}, {}, {}};
  source.settled = IntervalSet(0, 5);
  StoredStudy pending{2, "b", table_of(10), StudyState::kRunning, "then", {}, {}, {}, {}};
  pending.takes_over = true;
  pending.taken = {{"a", 3}};
  pending.settled = IntervalSet(0, 3);
  service_.reset();
  service_.emplace(settings, outbox_, std::vector<StoredStudy>{source, pending}, now_);
  EXPECT_THAT(outbox_.seeker.sources, ElementsAre(1, 2));
  ASSERT_THAT(outbox_.seeker.questions, SizeIs(1));
  EXPECT_EQ(outbox_.seeker.questions[0].study_id, 2U);
  EXPECT_EQ(status_of("b").taken().points(), 3U);
  EXPECT_TRUE(status_of("b").taken().under_way());
}

}  // namespace
}  // namespace oblique::server
