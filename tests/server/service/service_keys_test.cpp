// What the key of a peer allows: its role, and how much it may have open.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using protocol::Role;
using testing::AllOf;
using testing::HasSubstr;

std::shared_ptr<const KeyHolder> holder_of(const std::string& name, Role role = Role::kClient) {
  return std::make_shared<const KeyHolder>(KeyHolder{name, role});
}

class ServiceKeysTest : public ServiceTest {
 protected:
  ServiceKeysTest() { restart_with({}); }

  void restart_with(std::vector<StoredStudy> studies) {
    ServiceSettings settings;
    settings.solver_version = "1.0";
    settings.database_id = "db";
    settings.last_study_id = studies.size();
    settings.bounds = {.studies = 5, .points = 1000, .studies_of_key = 2, .points_of_key = 100};
    service_.emplace(settings, outbox_, std::move(studies), now_);
  }
  std::string submit(const std::string& name, std::uint64_t points,
                     const std::shared_ptr<const KeyHolder>& holder) {
    request(submit_request(name, points), holder);
    write_all();
    return last_reply().error().message();
  }
  std::string change(const std::string& name, protocol::StudyChange what,
                     const std::shared_ptr<const KeyHolder>& holder) {
    request(change_request(name, what), holder);
    write_all();
    return last_reply().error().message();
  }
  protocol::WorkersReply workers() {
    ClientRequest message;
    message.set_protocol_version(protocol::kProtocolVersion);
    message.mutable_workers();
    request(message, alice_);
    return last_reply().workers();
  }

  std::shared_ptr<const KeyHolder> alice_ = holder_of("alice");
  std::shared_ptr<const KeyHolder> bob_ = holder_of("bob");
  std::shared_ptr<const KeyHolder> reader_ = holder_of("onlooker", Role::kReader);
};

TEST_F(ServiceKeysTest, AReaderMayAskAndChangesNothing) {
  EXPECT_EQ(submit("a", 10, alice_), "");
  EXPECT_THAT(submit("b", 10, reader_), AllOf(HasSubstr("\"onlooker\""), HasSubstr("reader")));
  for (const auto what : {protocol::STUDY_CHANGE_CANCEL, protocol::STUDY_CHANGE_PAUSE,
                          protocol::STUDY_CHANGE_RESUME, protocol::STUDY_CHANGE_RETRY}) {
    EXPECT_THAT(change("a", what, reader_), HasSubstr("change nothing"));
  }
  EXPECT_EQ(status_of("a").state(), "running");
  ClientRequest query;
  query.set_protocol_version(protocol::kProtocolVersion);
  query.mutable_query()->set_sql("SELECT 1");
  request(query, reader_);
  EXPECT_EQ(outbox_.queries.size(), 1U);
}

TEST_F(ServiceKeysTest, ALongRequestOfAReaderIsRefusedToo) {
  ClientRequest message = submit_request("long", 10);
  auto& axis = *message.mutable_submit()->mutable_recipe()->mutable_blocks(0)->mutable_axes(0);
  axis.clear_count();
  for (int i = 0; i < 10'000; ++i) {
    axis.add_values(0.1 + 1e-5 * i);
  }
  request(message, reader_);
  ASSERT_EQ(outbox_.reads.size(), 1U);
  read_all();
  EXPECT_THAT(last_reply().error().message(), HasSubstr("change nothing"));
}

TEST_F(ServiceKeysTest, AStudyKnowsWhoSubmittedIt) {
  submit("a", 10, alice_);
  submit("a", 10, bob_);
  submit("b", 10, nullptr);
  EXPECT_EQ(status_of("a").submitted_by(), "alice");
  EXPECT_EQ(status_of("b").submitted_by(), "");
}

TEST_F(ServiceKeysTest, AKeyHasNoMoreStudiesAndPointsOpenThanItsBounds) {
  EXPECT_THAT(submit("a", 101, alice_), HasSubstr("open-points-of-key"));
  EXPECT_EQ(submit("a", 60, alice_), "");
  EXPECT_THAT(submit("b", 60, alice_), HasSubstr("open-points-of-key"));
  EXPECT_EQ(submit("b", 40, alice_), "");
  EXPECT_THAT(submit("c", 1, alice_), HasSubstr("open-studies-of-key"));
  EXPECT_EQ(submit("c", 100, bob_), "") << "another key has its own share";
  EXPECT_EQ(submit("a", 60, alice_), "") << "it is there already";
}

TEST_F(ServiceKeysTest, WithoutKeysOnlyTheSumsAreBounded) {
  for (const char* name : {"a", "b", "c", "d", "e"}) {
    EXPECT_EQ(submit(name, 150, nullptr), "") << name;
  }
  EXPECT_THAT(submit("f", 1, nullptr), HasSubstr("open-studies "));
}

TEST_F(ServiceKeysTest, WhatIsCancelledMakesRoomAndIsNotResumedBeyondTheBounds) {
  submit("a", 100, alice_);
  EXPECT_EQ(change("a", protocol::STUDY_CHANGE_CANCEL, alice_), "");
  EXPECT_EQ(submit("b", 100, alice_), "");
  EXPECT_THAT(change("a", protocol::STUDY_CHANGE_RESUME, alice_), HasSubstr("open-points-of-key"));
  EXPECT_THAT(change("a", protocol::STUDY_CHANGE_RESUME, bob_), HasSubstr("\"alice\""));
  EXPECT_THAT(submit("a", 100, alice_), HasSubstr("open-points-of-key"));
  EXPECT_EQ(status_of("a").state(), "cancelled");
  EXPECT_EQ(change("b", protocol::STUDY_CHANGE_PAUSE, alice_), "");
  EXPECT_THAT(change("a", protocol::STUDY_CHANGE_RESUME, alice_), HasSubstr("open-points-of-key"))
      << "what is paused is open";
}

TEST_F(ServiceKeysTest, WhatIsSolvedMakesRoom) {
  submit("a", 10, alice_);
  hello();
  credit(1);
  answer_batch(10);
  const auto shares = workers().keys();
  const std::uint64_t left = shares.empty() ? 0 : shares.at(0).open_points();
  EXPECT_LT(left, 10U);
}

TEST_F(ServiceKeysTest, AStudyThatTheDiskRefusesTakesNoRoom) {
  for (int i = 0; i < 3; ++i) {
    request(submit_request("a", 100), alice_);
    write_all("the disk is full");
  }
  EXPECT_EQ(submit("a", 100, alice_), "");
}

TEST_F(ServiceKeysTest, BoundsHoldAfterARestart) {
  std::vector<StoredStudy> stored;
  for (std::uint64_t id = 1; id <= 2; ++id) {
    StoredStudy study{};
    study.study_id = id;
    study.name = "old " + std::to_string(id);
    study.table = StudyTable(table_of(10));
    study.state = StudyState::kRunning;
    study.submitted_by = "alice";
    stored.push_back(std::move(study));
  }
  restart_with(std::move(stored));
  EXPECT_THAT(submit("new", 1, alice_), HasSubstr("open-studies-of-key"));
  EXPECT_EQ(submit("new", 1, bob_), "");
}

TEST_F(ServiceKeysTest, QueriesAreCountedByKeyAndNotByConnection) {
  ClientRequest query;
  query.set_protocol_version(protocol::kProtocolVersion);
  query.mutable_query()->set_sql("SELECT 1");
  service_->client_frame("one", protocol::encode(query), now_, alice_);
  service_->client_frame("two", protocol::encode(query), now_, alice_);
  ASSERT_EQ(outbox_.queries.size(), 2U);
  EXPECT_EQ(outbox_.queries[0].client, outbox_.queries[1].client);
}

TEST_F(ServiceKeysTest, WhatKeysHaveAndWereRefusedIsShown) {
  submit("a", 60, alice_);
  submit("b", 60, alice_);
  const auto keys = workers().keys();
  ASSERT_EQ(keys.size(), 1);
  EXPECT_EQ(keys.at(0).name(), "alice");
  EXPECT_EQ(keys.at(0).open_studies(), 1U);
  EXPECT_EQ(keys.at(0).open_points(), 60U);
  EXPECT_EQ(keys.at(0).refused(), 1U);
}

}  // namespace
}  // namespace oblique::server
