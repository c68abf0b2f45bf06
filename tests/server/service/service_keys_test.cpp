// What the role of a key allows, and how much may be open.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using protocol::Role;
using testing::AllOf;
using testing::HasSubstr;

std::shared_ptr<const KeyIdentity> holder_of(const std::string& name, Role role = Role::kClient) {
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
    return last_reply().error().message();
  }

  std::shared_ptr<const KeyIdentity> alice_ = holder_of("alice");
  std::shared_ptr<const KeyIdentity> bob_ = holder_of("bob");
  std::shared_ptr<const KeyIdentity> reader_ = holder_of("onlooker", Role::kReader);
};

TEST_F(ServiceKeysTest, AReaderMayAskAndChangesNothing) {
  EXPECT_EQ(error_of(submit_request("a"), alice_), "");
  ClientRequest long_request = submit_request("long");
  auto& axis = *long_request.mutable_submit()->mutable_recipe()->mutable_blocks(0)->mutable_axes(0);
  axis.clear_count();
  for (int i = 0; i < 10'000; ++i) {
    axis.add_values(0.1 + 1e-5 * i);
  }
  std::vector<ClientRequest> refused{submit_request("b"), long_request};
  for (const auto change : {protocol::STUDY_CHANGE_CANCEL, protocol::STUDY_CHANGE_PAUSE,
                            protocol::STUDY_CHANGE_RESUME, protocol::STUDY_CHANGE_RETRY,
                            protocol::STUDY_CHANGE_RENAME, protocol::STUDY_CHANGE_DELETE}) {
    refused.push_back(change_request("a", change));
  }
  for (const ClientRequest& message : refused) {
    EXPECT_THAT(error_of(message, reader_),
                AllOf(HasSubstr("\"onlooker\" is a reader's"), HasSubstr("change nothing")));
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

TEST_F(ServiceKeysTest, OpenStudiesAndTheirPointsAreBounded) {
  EXPECT_THAT(error_of(submit_request("a", 1001)),
              HasSubstr("0 points are open, and the server allows 1000 "
                        "(--limits-open-points)"));
  EXPECT_EQ(error_of(submit_request("a", 600)), "");
  EXPECT_THAT(error_of(submit_request("b", 401)), HasSubstr("open-points"));
  for (const char* name : {"b", "c", "d", "e"}) {
    EXPECT_EQ(error_of(submit_request(name, 1)), "") << name;
  }
  EXPECT_THAT(error_of(submit_request("f", 1)),
              HasSubstr("5 studies are open, and the server allows 5:"));
  EXPECT_EQ(error_of(submit_request("a", 600)), "") << "it is open already";
}

TEST_F(ServiceKeysTest, ACancelledStudyMakesRoomAndIsNotResumedBeyondTheBounds) {
  submit("a", 1000);
  EXPECT_EQ(error_of(cancel_request("a")), "");
  EXPECT_EQ(error_of(submit_request("b", 1000)), "");
  EXPECT_EQ(error_of(change_request("b", protocol::STUDY_CHANGE_PAUSE)), "");
  EXPECT_THAT(error_of(change_request("a", protocol::STUDY_CHANGE_RESUME)),
              HasSubstr("open-points"));
  EXPECT_THAT(error_of(submit_request("a", 1000)), HasSubstr("open-points"));
  EXPECT_EQ(status_of("a").state(), "cancelled");
}

TEST_F(ServiceKeysTest, QueriesOfAllConnectionsOfAKeyAreThoseOfOneClient) {
  ClientRequest query = client_request();
  query.mutable_query()->set_sql("SELECT 1");
  service_->client_frame("one", protocol::encode(query), now_, alice_);
  service_->client_frame("two", protocol::encode(query), now_, alice_);
  ASSERT_EQ(ports_.queries.size(), 2U);
  EXPECT_EQ(ports_.queries[0].client, ports_.queries[1].client);
}

}  // namespace
}  // namespace oblique::server
