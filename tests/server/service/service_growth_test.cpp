// Studies that grow, get another name, are deleted and described.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

/// `points` points, and behind them a block of `further`.
protocol::Recipe grown_recipe(std::uint64_t points, std::uint64_t further) {
  protocol::Recipe recipe = table_of(points)->recipe();
  *recipe.add_blocks() = table_of(further)->recipe().blocks(0);
  return recipe;
}

class ServiceGrowthTest : public ServiceTest {
 protected:
  void grow(const std::string& name, std::uint64_t points, std::uint64_t further) {
    ClientRequest message = submit_request(name);
    *message.mutable_submit()->mutable_recipe() = grown_recipe(points, further);
    request(message);
  }
  void rename(const std::string& name, const std::string& new_name) {
    ClientRequest message = change_request(name, protocol::STUDY_CHANGE_RENAME);
    message.mutable_change()->set_new_name(new_name);
    request(message);
  }
  void remove(const std::string& name, std::uint64_t id = 0) {
    ClientRequest message = change_request(name, protocol::STUDY_CHANGE_DELETE);
    message.mutable_change()->set_study_id(id);
    request(message);
  }
  /// One worker solves all points of study 1.
  void solve_everything() {
    hello();
    for (int batch = 0; batch < 100 && service_->scheduler().study(1).open() > 0; ++batch) {
      credit(1);
      answer_batch(UINT64_MAX);
    }
    write_all();
  }
};

TEST_F(ServiceGrowthTest, FurtherBlocksAreAppendedOnceTheyAreDurable) {
  submit("a", 10);
  grow("a", 10, 5);
  grow("a", 10, 5);  // another client
  EXPECT_EQ(service_->scheduler().study(1).points, 10U) << "not durable yet";
  ASSERT_EQ(ports_.jobs.size(), 1U);
  ports_.replies.clear();
  write_all();
  ASSERT_EQ(ports_.replies.size(), 2U);
  EXPECT_EQ(ports_.replies[0].submit().appended(), 5U);
  EXPECT_EQ(ports_.replies[0].submit().was(), "running");
  EXPECT_EQ(ports_.replies[1].submit().appended(), 0U) << "the points are there already";
  for (const ClientReply& reply : ports_.replies) {
    EXPECT_EQ(reply.submit().points(), 15U);
    EXPECT_EQ(reply.submit().study_id(), 1U);
    EXPECT_FALSE(reply.submit().created());
  }
  EXPECT_EQ(service_->scheduler().study(1).points, 15U);
}

TEST_F(ServiceGrowthTest, ADoneStudyRunsAgainAndItsWorkersGetTheFurtherPoints) {
  submit("a", 3);
  solve_everything();
  ASSERT_EQ(status_of("a").state(), "done");
  grow("a", 3, 2);
  write_all();
  EXPECT_EQ(last_reply().submit().was(), "done");
  EXPECT_EQ(status_of("a").state(), "running");
  ports_.worker_messages.clear();
  credit(1);
  ASSERT_EQ(ports_.worker_messages.size(), 2U);
  EXPECT_EQ(ports_.worker_messages[0].study().recipe().blocks_size(), 2);
  EXPECT_EQ(points_of(last_message().batch()).front(), 3U);
  solve_everything();
  EXPECT_EQ(status_of("a").state(), "done");
}

TEST_F(ServiceGrowthTest, AStudyWhoseLastPointIsStoredWhileItGrowsIsDoneOnlyIfTheGrowthIsRefused) {
  for (const std::string error : {"", "the disk is full"}) {
    start({});
    submit("a", 1);
    hello_and_credit();
    ASSERT_TRUE(last_message().has_batch());
    grow("a", 1, 1);
    auto growth = std::exchange(ports_.jobs, {});
    answer_batch(UINT64_MAX);
    EXPECT_TRUE(ports_.jobs.empty()) << "it is not called done";
    ports_.jobs = std::move(growth);
    write_all(error);
    EXPECT_EQ(last_reply().error().message().empty(), error.empty());
    EXPECT_EQ(ports_.jobs.size(), error.empty() ? 0U : 1U) << "that it is done";
    EXPECT_EQ(status_of("a").state(), error.empty() ? "running" : "done");
    EXPECT_EQ(status_of("a").points(), error.empty() ? 2U : 1U);
    ports_.jobs.clear();
  }
}

TEST_F(ServiceGrowthTest, AnotherRecipeIsRefusedWithTheDifference) {
  submit("a", 10);
  request(submit_request("a", 12));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("block 1 differs"));
  grow("a", 10, 5);
  write_all();
  request(submit_request("a", 10));
  EXPECT_THAT(last_reply().error().message(), HasSubstr("stored 2 blocks, given 1"));
  EXPECT_TRUE(ports_.jobs.empty());
}

TEST_F(ServiceGrowthTest, RequestsForAStudyThatIsBeingWrittenWait) {
  request(submit_request("a", 10));
  grow("a", 10, 5);
  ports_.replies.clear();
  write_all();
  request(cancel_request("a"));
  request(submit_request("a", 10));
  ASSERT_EQ(ports_.jobs.size(), 1U);
  write_all();
  write_all();
  ASSERT_EQ(ports_.replies.size(), 4U);
  EXPECT_TRUE(ports_.replies[0].submit().created());
  EXPECT_EQ(ports_.replies[1].submit().appended(), 5U);
  EXPECT_EQ(ports_.replies[2].change().study().state(), "cancelled");
  EXPECT_THAT(ports_.replies[3].error().message(), HasSubstr("stored 2 blocks, given 1"));
}

TEST_F(ServiceGrowthTest, ARenamedStudyIsFoundByItsNewNameAndByItsNumber) {
  submit("a", 10);
  rename("a", "b");
  EXPECT_EQ(status_of("a").name(), "a") << "not durable yet";
  write_all();
  EXPECT_EQ(status_of("b").points(), 10U);
  ClientRequest by_number = client_request();
  by_number.mutable_status()->set_study("a");
  by_number.mutable_status()->set_study_id(1);
  request(by_number);
  EXPECT_EQ(last_reply().status().studies(0).name(), "b") << "a client that watches it goes on";
  submit("a", 3);
  EXPECT_TRUE(last_reply().submit().created()) << "the old name is free";
}

TEST_F(ServiceGrowthTest, AUsedNameIsRefusedAlsoWhileItIsBeingWritten) {
  submit("a");
  submit("b");
  rename("a", "b");
  EXPECT_THAT(last_reply().error().message(), HasSubstr("there is a study called \"b\" already"));
  rename("a", "c");
  ports_.replies.clear();
  request(submit_request("c", 3));
  rename("b", "c");
  write_all();
  ASSERT_EQ(ports_.replies.size(), 3U);
  EXPECT_EQ(ports_.replies[0].change().study().name(), "c");
  EXPECT_THAT(ports_.replies[1].error().message(), HasSubstr("there is a study called \"c\""));
  EXPECT_THAT(ports_.replies[2].error().message(), HasSubstr("there is a study called \"c\""));
  rename("c", "");
  EXPECT_TRUE(last_reply().has_error());
  rename("c", "c");
  EXPECT_EQ(last_reply().change().study().name(), "c");
}

TEST_F(ServiceGrowthTest, ARefusedRenamingOrDeletionLeavesTheStudyAsItWas) {
  submit("a");
  rename("a", "b");
  write_all("the disk is full");
  EXPECT_THAT(last_reply().error().message(), HasSubstr("the disk is full"));
  remove("a");
  write_all("the disk is full");
  EXPECT_THAT(last_reply().error().message(), HasSubstr("the disk is full"));
  EXPECT_EQ(status_of("a").state(), "running");
  submit("b", 4);
  EXPECT_TRUE(last_reply().submit().created()) << "the name is free";
}

TEST_F(ServiceGrowthTest, ADeletedStudyIsGoneAndItsNameIsFree) {
  submit("a", 10);
  hello_and_credit();
  const auto batch = last_message().batch();
  remove("a");
  EXPECT_EQ(status_of("a").state(), "running") << "not durable yet";
  request(submit_request("a", 4));
  ports_.worker_messages.clear();
  ports_.replies.clear();
  write_all();
  ASSERT_EQ(ports_.replies.size(), 1U);
  EXPECT_EQ(ports_.replies[0].change().study().state(), "deleted");
  EXPECT_EQ(ports_.replies[0].change().study().points(), 10U);
  ASSERT_FALSE(ports_.worker_messages.empty());
  EXPECT_EQ(ports_.worker_messages[0].withdraw().study_id(), 1U);
  write_all();
  EXPECT_TRUE(last_reply().submit().created());
  EXPECT_EQ(last_reply().submit().study_id(), 2U);
  // The worker had solved its batch already.
  WorkerMessage message;
  message.mutable_results()->set_study_id(1);
  message.mutable_results()->set_lease_id(batch.lease_id());
  message.mutable_results()->set_sequence(1);
  *message.mutable_results()->add_results() = solved_point(0);
  worker_says(message);
  ASSERT_EQ(ports_.jobs.size(), 1U);
  EXPECT_TRUE(std::get<AddResults>(ports_.jobs[0].change).results.empty());
  write_all();
  EXPECT_EQ(last_message().results_stored().sequence(), 1U);
  EXPECT_EQ(service_->scheduler().study(2).settled, 0U);
  remove("a", 1);
  EXPECT_EQ(last_reply().change().study().state(), "deleted") << "it is deleted already";
  EXPECT_TRUE(ports_.jobs.empty()) << "the new study of that name stays";
  remove("a", 77);
  EXPECT_TRUE(last_reply().has_error()) << "a number that no study ever had";
}

TEST_F(ServiceGrowthTest, ResultsThatAreWrittenBehindADeletionAreAcknowledged) {
  submit("a", 10);
  hello_and_credit();
  remove("a");
  answer_batch(5);  // some of them failed
  EXPECT_EQ(last_message().results_stored().sequence(), 1U);
  EXPECT_TRUE(service_->ledger().is_empty());
  service_->tick({now_.steady_ms + 1000, now_.utc_ms});
  EXPECT_EQ(service_->rates().points_per_s(now_.steady_ms + 1000), 0.0);
}

TEST_F(ServiceGrowthTest, TheRecipeOfAStudyIsDescribed) {
  submit("friction", 10);
  ClientRequest describe = client_request(7);
  describe.mutable_describe()->set_study("friction");
  request(describe);
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_EQ(last_reply().describe().recipe().SerializeAsString(),
            table_of(10)->recipe().SerializeAsString());
  describe.mutable_describe()->set_study("fricton");
  request(describe);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("did you mean `friction`?"));
}

}  // namespace
}  // namespace oblique::server
