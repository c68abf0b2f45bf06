// What the page says to the service when a browser waits no more.
#include "server/web/answers/service_line.h"

#include <cstdint>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "tests/support/hang_limit.h"

namespace oblique::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class ServiceLineTest : public testing::Test {
 protected:
  static protocol::ClientRequest trace_of(std::uint64_t point) {
    protocol::ClientRequest request;
    request.mutable_trace()->set_study("a");
    request.mutable_trace()->set_point(point);
    return request;
  }
  /// Numbers of the requests that the service is told to end, in order; others are passed over.
  std::vector<std::uint64_t> ended() {
    std::vector<std::uint64_t> numbers;
    for (const std::string& frame : line_.take()) {
      protocol::ClientRequest request;
      EXPECT_TRUE(protocol::decode(frame, request));
      if (request.has_end_query()) {
        numbers.push_back(request.end_query().request_id());
      }
    }
    return numbers;
  }

  ServiceLine line_;
};

TEST_F(ServiceLineTest, ATraceWhoseBrowserWentEnds) {
  line_.ask(1, trace_of(7));
  line_.forget(1);
  EXPECT_THAT(ended(), ElementsAre(1));
}

TEST_F(ServiceLineTest, ATraceThatCameNeedsNoEnd) {
  line_.ask(1, trace_of(7));
  protocol::ClientReply reply;
  reply.set_request_id(1);
  reply.mutable_trace()->set_worker("ann");
  line_.put(protocol::encode(reply));
  ASSERT_TRUE(line_.reply(1));
  line_.forget(1);
  EXPECT_THAT(ended(), IsEmpty());
}

TEST_F(ServiceLineTest, ATraceGoesOnUntilItIsAskedForAgainAndEndsWithTheLastWhoAsks) {
  line_.ask(1, trace_of(7));
  line_.leave(1);
  line_.ask(2, trace_of(8));
  EXPECT_THAT(ended(), IsEmpty());
  line_.ask(3, trace_of(7));
  EXPECT_THAT(ended(), ElementsAre(1));
  line_.forget(3);
  EXPECT_THAT(ended(), ElementsAre(3));
}

TEST_F(ServiceLineTest, ThreadsThatWaitAtOnceReceiveTheirRepliesInOrder) {
  constexpr std::uint64_t kReplies = 2000;
  std::vector<std::jthread> threads;
  for (const std::uint64_t number : {1U, 2U, 3U}) {
    protocol::ClientRequest request;
    request.mutable_status();
    line_.ask(number, request);
    threads.emplace_back([this, number] {
      for (std::uint64_t i = 0; i < kReplies; ++i) {
        const auto reply = line_.wait_for_reply(number, test::kHangLimit);
        ASSERT_TRUE(reply);
        ASSERT_EQ(reply->status().next_after(), i);
      }
    });
  }
  for (std::uint64_t i = 0; i < kReplies; ++i) {
    for (const std::uint64_t number : {1U, 2U, 3U}) {
      protocol::ClientReply reply;
      reply.set_request_id(number);
      reply.mutable_status()->set_next_after(i);
      line_.put(protocol::encode(reply));
    }
  }
}

TEST_F(ServiceLineTest, AQueryThatIsLeftEnds) {
  protocol::ClientRequest request;
  request.mutable_query()->set_sql("SELECT 1");
  line_.ask(1, request);
  line_.leave(1);
  EXPECT_THAT(ended(), ElementsAre(1));
}

}  // namespace
}  // namespace oblique::server
