// Pause, resume, retry, and how studies share the workers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

TEST_F(ServiceTest, APausedStudyHandsOutNothingUntilItIsResumed) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  EXPECT_FALSE(last_reply().has_change()) << "not durable yet";
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "paused");
  hello();
  credit(1);
  EXPECT_FALSE(last_message().has_batch());
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "running");
  EXPECT_TRUE(last_message().has_batch());
}

TEST_F(ServiceTest, PointsHandedOutBeforeAPauseAreStillTaken) {
  request(submit_request("a", 1));
  write_all();
  hello();
  credit(1);
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  write_all();
  answer_batch(1);
  EXPECT_EQ(service_->scheduler().study(1).solved, 1U);
}

TEST_F(ServiceTest, ChangesThatAreThereAlreadyAreAnsweredAtOnce) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  EXPECT_EQ(last_reply().change().study().state(), "running");
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  EXPECT_EQ(last_reply().change().study().state(), "paused");
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  EXPECT_EQ(last_reply().change().retried(), 0U);
  EXPECT_TRUE(outbox_.jobs.empty());
}

TEST_F(ServiceTest, RetriedPointsAreHandedOutAgainOnceTheirRowsAreGone) {
  request(submit_request("a", 1));
  write_all();
  hello();
  credit(1);
  answer_batch(0);
  write_all();
  EXPECT_EQ(service_->scheduler().study(1).failed, 1U);
  credit(1);
  outbox_.worker_messages.clear();
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  EXPECT_TRUE(outbox_.worker_messages.empty()) << "not durable yet";
  write_all();
  EXPECT_EQ(last_reply().change().retried(), 1U);
  EXPECT_EQ(last_reply().change().study().state(), "running");
  EXPECT_EQ(service_->scheduler().study(1).failed, 0U);
  ASSERT_TRUE(last_message().has_batch());
  answer_batch(1);
  write_all();
  EXPECT_EQ(service_->scheduler().study(1).solved, 1U);
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  EXPECT_EQ(last_reply().change().study().state(), "done");
}

TEST_F(ServiceTest, TheAttemptGoesOnCountingAfterARetryAlsoWhenTheServerStartedAgainBetween) {
  request(submit_request("a", 1));
  write_all();
  hello();
  credit(3);
  for (std::uint32_t attempt = 1; attempt <= 3; ++attempt) {
    ASSERT_TRUE(last_message().has_batch());
    EXPECT_EQ(last_message().batch().attempt(), attempt);
    answer_batch(0);
    request(change_request("a", protocol::STUDY_CHANGE_RETRY));
    write_all();
  }
  StoredStudy stored{};
  stored.study_id = 1;
  stored.name = "a";
  stored.table = table_of(2);
  stored.attempts.set({1, 2}, 4);
  ServiceSettings settings;
  settings.solver_version = "1.0";
  service_.emplace(settings, outbox_, std::vector<StoredStudy>{stored}, now_);
  hello();
  outbox_.worker_messages.clear();
  credit(2);
  std::map<std::uint64_t, std::uint32_t> attempts;
  for (const auto& message : outbox_.worker_messages) {
    if (message.has_batch()) {
      attempts[points_of(message.batch()).front()] = message.batch().attempt();
    }
  }
  EXPECT_EQ(attempts, (std::map<std::uint64_t, std::uint32_t>{{0, 1}, {1, 5}}));
}

TEST_F(ServiceTest, WhenTheDatabaseIsGoneNothingMoreIsAcknowledgedAndEverybodyIsTold) {
  request(submit_request("a"));
  write_all();
  hello();
  credit(1);
  ASSERT_TRUE(last_message().has_batch());
  request(submit_request("b"));
  outbox_.worker_messages.clear();
  service_->written({WriteReport::Kind::kGone, 0, "the file was deleted"}, now_);
  EXPECT_TRUE(service_->storage_is_gone());
  EXPECT_THAT(last_reply().error().message(), HasSubstr("the file was deleted")) << "who waited";
  ASSERT_EQ(outbox_.worker_messages.size(), 2U);
  EXPECT_EQ(outbox_.worker_messages[0].notice().text(), "the file was deleted");
  EXPECT_TRUE(outbox_.worker_messages[1].has_stopping());

  outbox_.jobs.clear();
  outbox_.worker_messages.clear();
  WorkerMessage results;
  results.mutable_results()->set_study_id(1);
  results.mutable_results()->set_sequence(1);
  *results.mutable_results()->add_results() = solved_point(0);
  worker_says(results);
  credit(1);
  service_->tick(now_);
  EXPECT_TRUE(outbox_.jobs.empty());
  EXPECT_TRUE(outbox_.worker_messages.empty()) << "the worker keeps its results";
  for (const auto& asked :
       {submit_request("c"), change_request("a", protocol::STUDY_CHANGE_PAUSE)}) {
    request(asked);
    EXPECT_THAT(last_reply().error().message(), HasSubstr("the file was deleted"));
  }
  ClientRequest status;
  status.set_protocol_version(protocol::kProtocolVersion);
  status.mutable_status();
  request(status);
  ASSERT_EQ(last_reply().status().studies_size(), 1);
  EXPECT_EQ(last_reply().status().studies(0).waits_for(), "the file was deleted");
}

TEST_F(ServiceTest, AChangeThatIsNotStoredLeavesTheStudyAsItWas) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  write_all("disk full");
  EXPECT_THAT(last_reply().error().message(), HasSubstr("disk full"));
  hello();
  credit(1);
  EXPECT_TRUE(last_message().has_batch());
}

TEST_F(ServiceTest, AChangeRefusedBeforeAnotherLeavesWhatTheOtherMakesOfIt) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_CANCEL));
  request(change_request("a", protocol::STUDY_CHANGE_CANCEL));  // a client that asks again
  service_->written({WriteReport::Kind::kRefused, outbox_.jobs.front().ticket, "full"}, now_);
  outbox_.jobs.erase(outbox_.jobs.begin());
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "cancelled");
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  ASSERT_EQ(outbox_.jobs.size(), 1U) << "cancelled, so there is something to do";
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "running");
}

TEST_F(ServiceTest, OfTwoChangesOnTheirWayTheSecondStandsWhenTheFirstIsRefused) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  request(change_request("a", protocol::STUDY_CHANGE_CANCEL));
  service_->written({WriteReport::Kind::kRefused, outbox_.jobs.front().ticket, "full"}, now_);
  outbox_.jobs.erase(outbox_.jobs.begin());
  EXPECT_EQ(status_of("a").state(), "cancelled");
  write_all();
  EXPECT_EQ(status_of("a").state(), "cancelled");
}

TEST_F(ServiceTest, OfTwoChangesThatAreBothRefusedNoneStands) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  request(change_request("a", protocol::STUDY_CHANGE_CANCEL));
  write_all("disk full");
  EXPECT_EQ(status_of("a").state(), "running");
}

TEST_F(ServiceTest, AFaultThatIsOverWhileTheServerStopsHandsOutNothing) {
  request(submit_request("a", 100));
  write_all();
  hello();
  service_->written({WriteReport::Kind::kFault, 0, "disk full"}, now_);
  credit(1);
  service_->stop(now_);
  outbox_.worker_messages.clear();
  service_->written({WriteReport::Kind::kRecovered, 0, {}}, now_);
  credit(1);
  EXPECT_TRUE(outbox_.worker_messages.empty());
}

TEST_F(ServiceTest, TheRateAfterARetryIsNotNegative) {
  request(submit_request("a", 1));
  write_all();
  hello();
  credit(1);
  answer_batch(0);
  write_all();
  service_->tick(now_);
  now_.steady_ms += 1000;
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  write_all();
  EXPECT_EQ(last_reply().change().study().points_per_s(), 0.0);
  service_->tick(now_);
  now_.steady_ms += 1000;
  EXPECT_EQ(status_of("a").points_per_s(), 0.0);
}

TEST_F(ServiceTest, TheRateForgetsWhatWasSettledBeforeARetry) {
  constexpr int kPoints = 8;
  request(submit_request("a", kPoints));
  write_all();
  hello();
  for (int i = 0; i < kPoints; ++i) {
    credit(1);
    answer_batch(0);
    write_all();
    service_->tick(now_);
    now_.steady_ms += 1000;
  }
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  write_all();
  EXPECT_EQ(last_reply().change().study().points_per_s(), 0.0);
  EXPECT_EQ(status_of("a").points_per_s(), 0.0);
}

TEST_F(ServiceTest, EveryChangeOfAStudyLeavesALineInTheLog) {
  request(submit_request("a", 1));
  write_all();
  hello();
  const auto line_after = [&](protocol::StudyChange change) {
    outbox_.log.clear();
    request(change_request("a", change));
    EXPECT_TRUE(outbox_.log.empty()) << "it is not durable yet";
    write_all();
    return outbox_.log.empty() ? std::string() : outbox_.log.front();
  };
  EXPECT_EQ(line_after(protocol::STUDY_CHANGE_PAUSE), "study a is paused");
  EXPECT_EQ(line_after(protocol::STUDY_CHANGE_RESUME), "study a goes on");
  EXPECT_EQ(line_after(protocol::STUDY_CHANGE_CANCEL), "study a is cancelled");
  EXPECT_EQ(line_after(protocol::STUDY_CHANGE_RESUME), "study a goes on");
  credit(1);
  answer_batch(0);
  write_all();
  EXPECT_EQ(line_after(protocol::STUDY_CHANGE_RETRY), "study a tries its failed points again: 1");
}

TEST_F(ServiceTest, SeveralChangesThatAreNotStoredLeaveTheStudyAsItWas) {
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_CANCEL));
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  write_all("disk full");
  request(change_request("a", protocol::STUDY_CHANGE_CANCEL));
  EXPECT_EQ(outbox_.jobs.size(), 1U) << "running, so there is something to do";
}

TEST_F(ServiceTest, APriorityOutOfRangeIsRefusedByName) {
  auto urgent = submit_request("a");
  urgent.mutable_submit()->set_priority(100'000);
  request(urgent);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("priority = 100000"));
}

TEST_F(ServiceTest, AfterARefusedChangeTheNextOneIsWrittenAlthoughNothingSeemsToChange) {
  // What the disk took of the refused one could count again after a crash.
  request(submit_request("a"));
  write_all();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  write_all("the disk is failing");
  EXPECT_TRUE(last_reply().has_error());
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  EXPECT_EQ(outbox_.jobs.size(), 1U);
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "running");
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  EXPECT_TRUE(outbox_.jobs.empty());
}

}  // namespace
}  // namespace oblique::server
