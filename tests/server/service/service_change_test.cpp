// Pause, resume, retry, and how studies share the workers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

TEST_F(ServiceTest, APausedStudyHandsOutNothingUntilItIsResumed) {
  submit("a");
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  EXPECT_FALSE(last_reply().has_change()) << "not durable yet";
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "paused");
  hello_and_credit();
  EXPECT_FALSE(last_message().has_batch());
  change("a", protocol::STUDY_CHANGE_RESUME);
  EXPECT_EQ(last_reply().change().study().state(), "running");
  EXPECT_TRUE(last_message().has_batch());
}

TEST_F(ServiceTest, ChangesThatAreThereAlreadyAreAnsweredAtOnce) {
  submit("a");
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  EXPECT_EQ(last_reply().change().study().state(), "running");
  change("a", protocol::STUDY_CHANGE_PAUSE);
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  EXPECT_EQ(last_reply().change().study().state(), "paused");
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  EXPECT_EQ(last_reply().change().retried(), 0U);
  EXPECT_TRUE(ports_.jobs.empty());
}

TEST_F(ServiceTest, RetriedPointsAreHandedOutAgainOnceTheirRowsAreGone) {
  submit("a", 1);
  hello_and_credit();
  answer_batch(0);
  write_all();
  EXPECT_EQ(service_->scheduler().study(1).failed, 1U);
  credit(1);
  ports_.worker_messages.clear();
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  EXPECT_TRUE(ports_.worker_messages.empty()) << "not durable yet";
  write_all();
  EXPECT_EQ(last_reply().change().retried(), 1U);
  EXPECT_EQ(last_reply().change().study().state(), "running");
  EXPECT_EQ(service_->scheduler().study(1).failed, 0U);
  ASSERT_TRUE(last_message().has_batch());
  answer_batch(1);
  write_all();
  EXPECT_EQ(service_->scheduler().study(1).solved(), 1U);
  request(change_request("a", protocol::STUDY_CHANGE_RETRY));
  EXPECT_EQ(last_reply().change().study().state(), "done");
}

TEST_F(ServiceTest, WhenTheDatabaseIsGoneNothingMoreIsAcknowledgedAndEverybodyIsTold) {
  submit("a");
  hello_and_credit();
  ASSERT_TRUE(last_message().has_batch());
  request(submit_request("b"));
  ports_.worker_messages.clear();
  service_->written({WriteReport::Kind::kGone, 0, "the file was deleted"}, now_);
  EXPECT_TRUE(service_->storage_is_gone());
  EXPECT_THAT(last_reply().error().message(), HasSubstr("the file was deleted")) << "who waited";
  ASSERT_EQ(ports_.worker_messages.size(), 2U);
  EXPECT_EQ(ports_.worker_messages[0].notice().text(), "the file was deleted");
  EXPECT_TRUE(ports_.worker_messages[1].has_stopping());

  ports_.jobs.clear();
  ports_.worker_messages.clear();
  WorkerMessage results;
  results.mutable_results()->set_study_id(1);
  results.mutable_results()->set_sequence(1);
  *results.mutable_results()->add_results() = solved_point(0);
  worker_says(results);
  credit(1);
  service_->tick(now_);
  EXPECT_TRUE(ports_.jobs.empty());
  EXPECT_TRUE(ports_.worker_messages.empty()) << "the worker keeps its results";
  for (const auto& asked :
       {submit_request("c"), change_request("a", protocol::STUDY_CHANGE_PAUSE)}) {
    request(asked);
    EXPECT_THAT(last_reply().error().message(), HasSubstr("the file was deleted"));
  }
  EXPECT_EQ(status_of("a").waits_for(), "the file was deleted");
}

TEST_F(ServiceTest, OfSeveralChangesEachWaitsForTheOutcomeOfTheOneBefore) {
  submit("a");
  for (const bool is_first_stored : {true, false}) {
    ports_.replies.clear();
    request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
    request(change_request("a", protocol::STUDY_CHANGE_CANCEL));
    request(change_request("a", protocol::STUDY_CHANGE_CANCEL));  // a client that asks again
    request(change_request("a", protocol::STUDY_CHANGE_RESUME));
    ASSERT_EQ(ports_.jobs.size(), 1U);
    write_all(is_first_stored ? "" : "disk full");
    for (int i = 0; i < 3 && !ports_.jobs.empty(); ++i) {
      write_all();
    }
    ASSERT_EQ(ports_.replies.size(), 4U);
    EXPECT_EQ(ports_.replies[0].has_error(), !is_first_stored);
    EXPECT_EQ(ports_.replies[1].change().study().state(), "cancelled");
    EXPECT_EQ(ports_.replies[2].change().study().state(), "cancelled");
    EXPECT_EQ(ports_.replies[3].change().study().state(), "running");
  }
}

TEST_F(ServiceTest, AStudyThatIsDoneWhileAPauseIsWrittenStaysDone) {
  submit("a", 1);
  hello_and_credit();
  request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
  auto pause = std::exchange(ports_.jobs, {});
  answer_batch(1);
  ASSERT_EQ(ports_.jobs.size(), 1U) << "that it is done";
  ports_.jobs.insert(ports_.jobs.begin(), pause.front());
  write_all();
  EXPECT_EQ(status_of("a").state(), "done") << "points handed out before are still stored";
}

TEST_F(ServiceTest, AFaultThatIsOverWhileTheServerStopsHandsOutNothing) {
  submit("a", 100);
  hello();
  service_->written({WriteReport::Kind::kFault, 0, "disk full"}, now_);
  credit(1);
  service_->stop(now_);
  ports_.worker_messages.clear();
  service_->written({WriteReport::Kind::kRecovered, 0, {}}, now_);
  credit(1);
  EXPECT_TRUE(ports_.worker_messages.empty());
}

TEST_F(ServiceTest, TheRateAfterARetryIsNotNegative) {
  submit("a", 1);
  hello_and_credit();
  answer_batch(0);
  write_all();
  service_->tick(now_);
  now_.steady_ms += 1000;
  change("a", protocol::STUDY_CHANGE_RETRY);
  EXPECT_EQ(last_reply().change().study().points_per_s(), 0.0);
  service_->tick(now_);
  now_.steady_ms += 1000;
  EXPECT_EQ(status_of("a").points_per_s(), 0.0);
}

TEST_F(ServiceTest, EveryChangeOfAStudyLeavesALineInTheLog) {
  submit("a", 1);
  hello();
  const auto line_after = [&](protocol::StudyChange change) {
    ports_.lines.clear();
    request(change_request("a", change));
    EXPECT_TRUE(ports_.lines.empty()) << "it is not durable yet";
    write_all();
    return ports_.lines.empty() ? std::string() : ports_.lines.front();
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

TEST_F(ServiceTest, ARefusedChangeLeavesTheStudyAsItWasAndInDoubt) {
  submit("a");
  for (const auto change : {protocol::STUDY_CHANGE_PAUSE, protocol::STUDY_CHANGE_CANCEL}) {
    request(change_request("a", change));
    write_all("disk full");
    EXPECT_THAT(last_reply().error().message(), HasSubstr("disk full"));
    EXPECT_EQ(status_of("a").state(), "running");
  }
  // What the disk took of the refused ones could count after a crash.
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  EXPECT_EQ(ports_.jobs.size(), 1U);
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "running");
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  EXPECT_TRUE(ports_.jobs.empty());
  hello_and_credit();
  EXPECT_TRUE(last_message().has_batch());
}

}  // namespace
}  // namespace oblique::server
