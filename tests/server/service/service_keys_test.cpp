// What the key of a peer allows, and how much may be open.
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
    settings.bounds = {.studies = 2, .points = 100};
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

TEST_F(ServiceKeysTest, NoMoreStudiesAndPointsAreOpenThanTheBoundsAllow) {
  EXPECT_THAT(submit("a", 101, alice_), HasSubstr("open-points"));
  EXPECT_EQ(submit("a", 60, alice_), "");
  EXPECT_THAT(submit("b", 60, bob_), HasSubstr("open-points"));
  EXPECT_EQ(submit("b", 40, nullptr), "");
  EXPECT_THAT(submit("c", 1, alice_), HasSubstr("studies are open"));
  EXPECT_EQ(submit("a", 60, bob_), "") << "it is there already";
}

TEST_F(ServiceKeysTest, WhatIsCancelledMakesRoomAndIsNotResumedBeyondTheBounds) {
  submit("a", 100, alice_);
  EXPECT_EQ(change("a", protocol::STUDY_CHANGE_CANCEL, alice_), "");
  EXPECT_EQ(submit("b", 100, alice_), "");
  EXPECT_THAT(change("a", protocol::STUDY_CHANGE_RESUME, bob_), HasSubstr("open-points"));
  EXPECT_THAT(submit("a", 100, alice_), HasSubstr("open-points"));
  EXPECT_EQ(status_of("a").state(), "cancelled");
  EXPECT_EQ(change("b", protocol::STUDY_CHANGE_PAUSE, alice_), "");
  EXPECT_THAT(change("a", protocol::STUDY_CHANGE_RESUME, alice_), HasSubstr("open-points"))
      << "what is paused is open";
}

TEST_F(ServiceKeysTest, WhatIsSolvedMakesRoom) {
  submit("a", 100, alice_);
  EXPECT_THAT(submit("b", 1, alice_), HasSubstr("open-points"));
  hello();
  credit(1);
  answer_batch(100);
  EXPECT_EQ(submit("b", 1, alice_), "");
}

TEST_F(ServiceKeysTest, AStudyThatTheDiskRefusesTakesNoRoom) {
  for (int i = 0; i < 3; ++i) {
    request(submit_request("a", 100), alice_);
    write_all("the disk is full");
  }
  EXPECT_EQ(submit("a", 100, alice_), "");
}

TEST_F(ServiceKeysTest, BoundsHoldAfterARestart) {
  StoredStudy study{};
  study.study_id = 1;
  study.name = "old";
  study.table = StudyTable(table_of(90));
  study.state = StudyState::kRunning;
  study.submitted_by = "alice";
  std::vector<StoredStudy> stored;
  stored.push_back(std::move(study));
  restart_with(std::move(stored));
  EXPECT_THAT(submit("new", 11, bob_), HasSubstr("open-points"));
  EXPECT_EQ(submit("new", 10, bob_), "");
}

}  // namespace
}  // namespace oblique::server
