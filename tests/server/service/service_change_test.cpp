// Tests of changes (pause, resume, retry, grow, rename, delete) and of the rights of keys.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST_F(ServiceTest, APausedStudyIsNotLeasedUntilItIsResumed) {
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

TEST_F(ServiceTest, ChangesWithoutEffectAreAnsweredAtOnce) {
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

TEST_F(ServiceTest, RetriedPointsAreLeasedWhenTheirRowsAreDeleted) {
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

TEST_F(ServiceTest, WhenTheDatabaseIsGoneNothingIsAcknowledgedAndAllPeersAreNotified) {
  submit("a");
  hello_and_credit();
  ASSERT_TRUE(last_message().has_batch());
  request(submit_request("b"));
  ports_.worker_messages.clear();
  service_->written({WriteReport::Kind::kGone, 0, "the file was deleted"}, now_);
  EXPECT_TRUE(service_->storage_is_gone());
  EXPECT_THAT(last_error(), HasSubstr("the file was deleted")) << "the waiting client is notified";
  ASSERT_EQ(ports_.worker_messages.size(), 2U);
  EXPECT_EQ(ports_.worker_messages[0].notice().text(), "the file was deleted");
  EXPECT_TRUE(ports_.worker_messages[1].has_stopping());

  ports_.jobs.clear();
  ports_.worker_messages.clear();
  worker_sends(results_of({0}));
  credit(1);
  service_->tick(now_);
  EXPECT_TRUE(ports_.jobs.empty());
  EXPECT_TRUE(ports_.worker_messages.empty()) << "results were acknowledged without a database";
  for (const auto& late_request :
       {submit_request("c"), change_request("a", protocol::STUDY_CHANGE_PAUSE)}) {
    request(late_request);
    EXPECT_THAT(last_error(), HasSubstr("the file was deleted"));
  }
  EXPECT_EQ(status_of("a").waits_for(), "the file was deleted");
}

TEST_F(ServiceTest, EachChangeWaitsForThePreviousOne) {
  submit("a");
  for (const bool is_first_stored : {true, false}) {
    ports_.replies.clear();
    request(change_request("a", protocol::STUDY_CHANGE_PAUSE));
    request(change_request("a", protocol::STUDY_CHANGE_CANCEL));
    // The client repeats its request.
    request(change_request("a", protocol::STUDY_CHANGE_CANCEL));
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
  ASSERT_EQ(ports_.jobs.size(), 1U) << "expected a change to `done`";
  ports_.jobs.insert(ports_.jobs.begin(), pause.front());
  write_all();
  EXPECT_EQ(status_of("a").state(), "done")
      << "results of points leased before the pause are still stored";
}

TEST_F(ServiceTest, ARefusedChangeHasNoEffectAndTheStateIsStoredAgain) {
  submit("a");
  for (const auto change : {protocol::STUDY_CHANGE_PAUSE, protocol::STUDY_CHANGE_CANCEL}) {
    request(change_request("a", change));
    write_all("disk full");
    EXPECT_THAT(last_error(), HasSubstr("disk full"));
    EXPECT_EQ(status_of("a").state(), "running");
  }
  // A change whose write failed may be on the disk and reappear after a crash. So the state is
  // stored again, although it has not changed.
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  EXPECT_EQ(ports_.jobs.size(), 1U);
  write_all();
  EXPECT_EQ(last_reply().change().study().state(), "running");
  request(change_request("a", protocol::STUDY_CHANGE_RESUME));
  EXPECT_TRUE(ports_.jobs.empty());
  hello_and_credit();
  EXPECT_TRUE(last_message().has_batch());
}

// ---- Growth, names, deletion ----

/// Returns a recipe of `points` points, followed by a block of `further` points.
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
  /// Lets one worker solve all points of study 1.
  void solve_everything() {
    hello();
    for (int batch = 0; batch < 100 && service_->scheduler().study(1).open() > 0; ++batch) {
      credit(1);
      answer_batch(UINT64_MAX);
    }
    write_all();
  }
};

TEST_F(ServiceGrowthTest, FurtherBlocksAreAppendedWhenTheyAreDurable) {
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
  EXPECT_EQ(ports_.replies[1].submit().appended(), 0U) << "the second request appends no points";
  for (const ClientReply& reply : ports_.replies) {
    EXPECT_EQ(reply.submit().points(), 15U);
    EXPECT_EQ(reply.submit().study_id(), 1U);
    EXPECT_FALSE(reply.submit().created());
  }
  EXPECT_EQ(service_->scheduler().study(1).points, 15U);
}

TEST_F(ServiceGrowthTest, ADoneStudyThatGrowsRunsAgain) {
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
    EXPECT_TRUE(ports_.jobs.empty()) << "a growing study must not become done";
    ports_.jobs = std::move(growth);
    write_all(error);
    EXPECT_EQ(last_error().empty(), error.empty());
    EXPECT_EQ(ports_.jobs.size(), error.empty() ? 0U : 1U) << "expected a change to `done`";
    EXPECT_EQ(status_of("a").state(), error.empty() ? "running" : "done");
    EXPECT_EQ(status_of("a").points(), error.empty() ? 2U : 1U);
    ports_.jobs.clear();
  }
}

TEST_F(ServiceGrowthTest, AnotherRecipeIsRefusedWithTheDifference) {
  submit("a", 10);
  request(submit_request("a", 12));
  EXPECT_THAT(last_error(), HasSubstr("block 1 differs"));
  grow("a", 10, 5);
  write_all();
  request(submit_request("a", 10));
  EXPECT_THAT(last_error(), HasSubstr("stored 2 blocks, given 1"));
  EXPECT_TRUE(ports_.jobs.empty());
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
  EXPECT_EQ(last_reply().status().studies(0).name(), "b")
      << "a watching client finds the study by its number";
  submit("a", 3);
  EXPECT_TRUE(last_reply().submit().created()) << "the old name is free";
}

TEST_F(ServiceGrowthTest, ANameInUseIsRefusedEvenWhileItIsBeingWritten) {
  submit("a");
  submit("b");
  rename("a", "b");
  EXPECT_THAT(last_error(), HasSubstr("there is already a study called \"b\""));
  rename("a", "c");
  ports_.replies.clear();
  request(submit_request("c", 3));
  rename("b", "c");
  write_all();
  ASSERT_EQ(ports_.replies.size(), 3U);
  EXPECT_EQ(ports_.replies[0].change().study().name(), "c");
  EXPECT_THAT(ports_.replies[1].error().message(), HasSubstr("there is a study called \"c\""));
  EXPECT_THAT(ports_.replies[2].error().message(), HasSubstr("already a study called \"c\""));
  rename("c", "");
  EXPECT_TRUE(last_reply().has_error());
  rename("c", "c");
  EXPECT_EQ(last_reply().change().study().name(), "c");
}

TEST_F(ServiceGrowthTest, ARefusedRenamingOrDeletionHasNoEffect) {
  submit("a");
  rename("a", "b");
  write_all("the disk is full");
  EXPECT_THAT(last_error(), HasSubstr("the disk is full"));
  remove("a");
  write_all("the disk is full");
  EXPECT_THAT(last_error(), HasSubstr("the disk is full"));
  EXPECT_EQ(status_of("a").state(), "running");
  submit("b", 4);
  EXPECT_TRUE(last_reply().submit().created()) << "the name is free";
}

TEST_F(ServiceGrowthTest, ADeletedStudyIsGoneAndItsNameIsFree) {
  submit("a", 10);
  hello_and_credit();
  const WorkerMessage solved_before = results_of({0}, 1, last_message().batch().lease_id());
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
  worker_sends(solved_before);
  ASSERT_EQ(ports_.jobs.size(), 1U);
  EXPECT_TRUE(std::get<AddResults>(ports_.jobs[0].change).results.empty());
  write_all();
  EXPECT_EQ(last_message().results_stored().sequence(), sequence_);
  EXPECT_EQ(service_->scheduler().study(2).completed, 0U);
  remove("a", 1);
  EXPECT_EQ(last_reply().change().study().state(), "deleted") << "the study is already deleted";
  EXPECT_TRUE(ports_.jobs.empty()) << "the new study of that name was deleted";
  remove("a", 77);
  EXPECT_THAT(last_error(), HasSubstr("study name \"a\" and study number do not match"));
}

TEST_F(ServiceGrowthTest, DescribeReturnsTheRecipeOfAStudy) {
  submit("friction", 10);
  ClientRequest describe = client_request(7);
  describe.mutable_describe()->set_study("friction");
  request(describe);
  EXPECT_EQ(last_reply().request_id(), 7U);
  EXPECT_EQ(last_reply().describe().recipe().SerializeAsString(),
            table_of(10)->recipe().SerializeAsString());
  describe.mutable_describe()->set_study("fricton");
  request(describe);
  EXPECT_THAT(last_error(), HasSubstr("did you mean `friction`?"));
}

// ---- Rights of keys, and limits ----

std::shared_ptr<const KeyIdentity> holder_of(const std::string& name,
                                             protocol::Role role = protocol::Role::kClient) {
  return std::make_shared<const KeyIdentity>(KeyIdentity{name, role});
}

class ServiceKeysTest : public ServiceTest {
 protected:
  ServiceKeysTest() {
    ServiceSettings settings;
    settings.bounds = {.studies = 5, .points = 1000};
    start(settings);
  }

  std::string error_of(const ClientRequest& message,
                       const std::shared_ptr<const KeyIdentity>& holder = nullptr) {
    request(message, holder);
    run_checks();
    write_all();
    return last_error();
  }

  std::shared_ptr<const KeyIdentity> alice_ = holder_of("alice");
  std::shared_ptr<const KeyIdentity> bob_ = holder_of("bob");
  std::shared_ptr<const KeyIdentity> reader_ = holder_of("onlooker", protocol::Role::kReader);
};

TEST_F(ServiceKeysTest, AReaderMayReadButNotChange) {
  EXPECT_EQ(error_of(submit_request("a"), alice_), "");
  std::vector<ClientRequest> refused{submit_request("b"), long_submission("long", kLongRequest)};
  for (const auto change : {protocol::STUDY_CHANGE_CANCEL, protocol::STUDY_CHANGE_PAUSE,
                            protocol::STUDY_CHANGE_RESUME, protocol::STUDY_CHANGE_RETRY,
                            protocol::STUDY_CHANGE_RENAME, protocol::STUDY_CHANGE_DELETE}) {
    refused.push_back(change_request("a", change));
  }
  for (const ClientRequest& message : refused) {
    EXPECT_THAT(error_of(message, reader_),
                AllOf(HasSubstr("\"onlooker\" has the role reader"), HasSubstr("change nothing")));
  }
  EXPECT_EQ(status_of("a").state(), "running");
  ClientRequest query = client_request();
  query.mutable_query()->set_sql("SELECT 1");
  request(query, reader_);
  EXPECT_EQ(ports_.queries.size(), 1U);
}

TEST_F(ServiceKeysTest, AStudyHasTheNameOfTheKeyThatFirstSubmittedIt) {
  error_of(submit_request("a"), alice_);
  error_of(submit_request("a"), bob_);
  error_of(submit_request("b"));
  EXPECT_EQ(status_of("a").submitted_by(), "alice");
  EXPECT_EQ(status_of("b").submitted_by(), "");
}

TEST_F(ServiceKeysTest, OpenStudiesAndTheirPointsAreLimited) {
  EXPECT_THAT(error_of(submit_request("a", 1001)),
              HasSubstr("0 points are open, and at most 1000 are allowed "
                        "(--limits-open-points)"));
  EXPECT_EQ(error_of(submit_request("a", 600)), "");
  EXPECT_THAT(error_of(submit_request("b", 401)), HasSubstr("open-points"));
  for (const char* name : {"b", "c", "d", "e"}) {
    EXPECT_EQ(error_of(submit_request(name, 1)), "") << name;
  }
  EXPECT_THAT(error_of(submit_request("f", 1)),
              HasSubstr("5 studies are open, and at most 5 are allowed:"));
  EXPECT_EQ(error_of(submit_request("a", 600)), "") << "the study is already open";
}

TEST_F(ServiceKeysTest, ACancelledStudyMakesRoomAndIsNotResumedBeyondTheLimits) {
  submit("a", 1000);
  EXPECT_EQ(error_of(cancel_request("a")), "");
  EXPECT_EQ(error_of(submit_request("b", 1000)), "");
  EXPECT_EQ(error_of(change_request("b", protocol::STUDY_CHANGE_PAUSE)), "");
  EXPECT_THAT(error_of(change_request("a", protocol::STUDY_CHANGE_RESUME)),
              HasSubstr("open-points"));
  EXPECT_THAT(error_of(submit_request("a", 1000)), HasSubstr("open-points"));
  EXPECT_EQ(status_of("a").state(), "cancelled");
}

TEST_F(ServiceKeysTest, AllConnectionsOfAKeyCountAsOneClient) {
  ClientRequest query = client_request();
  query.mutable_query()->set_sql("SELECT 1");
  send(query, "one", alice_);
  send(query, "two", alice_);
  ASSERT_EQ(ports_.queries.size(), 2U);
  EXPECT_EQ(ports_.queries[0].client, ports_.queries[1].client);
}

}  // namespace
}  // namespace oblique::server
