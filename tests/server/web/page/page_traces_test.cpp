// Traces that a browser waits for, or no longer.
#include <chrono>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/web/page/page.h"
#include "tests/server/web/page/page_study.h"

namespace oblique::server {
namespace {

using PageTracesTest = PageStudyTest;

TEST_F(PageTracesTest, TheWorkerIsToldWhenTheBrowserHasGone) {
  submit_grid();
  PretendedWorker worker(page_.server().worker_endpoint());
  worker.hello();
  {
    RawHttp browser(page_.url());
    browser.send("GET /api/studies/1/points/3/trace HTTP/1.1\r\nHost: " + page_.host() + "\r\n" +
                 page_.cookie_header() + "\r\n");
    while (!worker.receive().has_trace_order()) {
      // It was welcomed before.
    }
  }
  while (!worker.receive().has_trace_cancel()) {
    // Nothing else is awaited.
  }
}

/// The page, with what the service says played by the test.
class PageTracesAloneTest : public testing::Test {
 protected:
  static PageSettings settings() {
    PageSettings settings;
    settings.shows_without_token = true;
    return settings;
  }
  static HttpQuestion question(std::uint64_t number, std::chrono::seconds waited) {
    HttpQuestion question{};
    question.number = number;
    question.method = "GET";
    question.path = "/api/studies/1/points/3/trace";
    question.waited = waited;
    return question;
  }
  void begin(std::uint64_t number) {
    EXPECT_FALSE(page_.answer(question(number, std::chrono::seconds(0))));
    ClientReply reply;
    reply.set_request_id(number);
    reply.mutable_status()->add_studies()->set_name("a");
    line_.put(protocol::encode(reply));
    EXPECT_FALSE(page_.answer(question(number, std::chrono::seconds(1))));
  }
  std::vector<std::uint64_t> ended() {
    std::vector<std::uint64_t> numbers;
    for (const std::string& frame : line_.take()) {
      ClientRequest request;
      EXPECT_TRUE(protocol::decode(frame, request));
      if (request.has_end_query()) {
        numbers.push_back(request.end_query().request_id());
      }
    }
    return numbers;
  }

  ServiceClient line_;
  LiveText live_{[] { return std::nullopt; }, 0};
  Page page_{settings(), Page::Neighbours{line_, live_}};
};

TEST_F(PageTracesAloneTest, OneThatTakesLongGoesOnUntilTheBrowserAsksAgainAndEndsWhenItGoes) {
  begin(1);
  const auto later = page_.answer(question(1, std::chrono::seconds(9)));
  ASSERT_TRUE(later);
  EXPECT_EQ(later->status, 202U);
  EXPECT_THAT(ended(), testing::IsEmpty()) << "what is solved so far would be lost";
  begin(2);
  EXPECT_THAT(ended(), testing::ElementsAre(1));
  page_.gone(2);
  EXPECT_THAT(ended(), testing::ElementsAre(2));
}

}  // namespace
}  // namespace oblique::server
