// Requests for traces that their client ends.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

class EndedTraces : public ServiceTest {
 protected:
  EndedTraces() {
    request(submit_request("a", 100));
    write_all();
    ports_.replies.clear();
    hello();
  }

  void say(ClientRequest message, const std::string& identity) {
    message.set_protocol_version(protocol::kProtocolVersion);
    service_->client_frame(identity, protocol::encode(message), now_);
  }
  void ask(std::uint64_t id, std::uint64_t point, const std::string& identity = "client") {
    ClientRequest message;
    message.set_request_id(id);
    message.mutable_trace()->set_study("a");
    message.mutable_trace()->set_point(point);
    say(message, identity);
  }
  void end(std::uint64_t id, const std::string& identity = "client") {
    ClientRequest message;
    message.mutable_end_query()->set_request_id(id);
    say(message, identity);
  }
  bool is_cancelled() const {
    return std::any_of(ports_.worker_messages.begin(), ports_.worker_messages.end(),
                       [](const ServerToWorker& message) { return message.has_trace_cancel(); });
  }
};

TEST_F(EndedTraces, LeaveTheirShareToOthersOfTheSameClient) {
  for (std::uint64_t i = 1; i <= 4; ++i) {
    ask(i, i);
  }
  end(2, "another");
  ask(5, 5);
  EXPECT_THAT(last_reply().error().message(), HasSubstr("too many traces"))
      << "nobody ends what another one asked for";
  const std::size_t replies = ports_.replies.size();
  end(2);
  ask(6, 6);
  EXPECT_EQ(ports_.replies.size(), replies) << "it waits";
}

TEST_F(EndedTraces, AreCancelledWhenNobodyElseWaits) {
  ask(1, 1);
  ask(1, 1, "another");
  end(1);
  EXPECT_FALSE(is_cancelled());
  end(1, "another");
  EXPECT_TRUE(is_cancelled());
}

}  // namespace
}  // namespace oblique::server
