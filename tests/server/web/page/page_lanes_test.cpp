// Who waits for whom in the pool that makes answers of the database.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "proto/wire/chunk_writer.h"
#include "server/web/answers/answer_pool.h"
#include "server/web/page/page.h"
#include "tests/server/web/page/page_study.h"

namespace oblique::server {
namespace {

/// A pool whose jobs end when the test says so, and are not ended by the clock.
class PageLanesTest : public PageStudyTest {
 public:
  using Lane = AnswerPool::Lane;
  ~PageLanesTest() override { may_end_ = true; }

  static void pause() { std::this_thread::sleep_for(std::chrono::milliseconds(1)); }
  HttpAnswer take(std::uint64_t number) {
    std::optional<HttpAnswer> answer;
    while (!(answer = pool_.take(number))) {
      pause();
    }
    return *answer;
  }
  AnswerPool::Job blocking() {
    return [this](const AnswerDesk&) {
      ++begun_;
      while (!may_end_) {
        pause();
      }
      return HttpAnswer{};
    };
  }
  void until_begun(int count) const {
    while (begun_ < count) {
      pause();
    }
  }
  static AnswerPool::Job quick() {
    return [](const AnswerDesk&) { return HttpAnswer{204, {}, {}}; };
  }

  static PageSettings open_to_all() {
    PageSettings settings;
    settings.shows_without_token = true;
    return settings;
  }
  /// Without the token.
  static HttpQuestion asked(std::uint64_t number, const std::string& path) {
    HttpQuestion question{};
    question.number = number;
    question.method = "GET";
    question.path = path;
    question.host = "localhost:1";
    return question;
  }
  static HttpQuestion with_token(HttpQuestion question, const Page& page) {
    const std::string cookie = page.key().cookie_for(question.host);
    question.cookies = {cookie.substr(0, cookie.find(';'))};
    return question;
  }

  std::atomic<int> begun_ = 0;
  std::atomic<bool> may_end_ = false;
  AnswerPool pool_{page_.database(), [] {}, std::chrono::hours(1)};
};

TEST_F(PageLanesTest, StrangersFillNoPlacesOfThoseWhoHaveTheToken) {
  std::uint64_t number = 1;
  while (pool_.submit(number, blocking(), Lane::kStrangers)) {
    ++number;
  }
  EXPECT_GE(number, 64U);
  ASSERT_TRUE(pool_.submit(1001, quick(), Lane::kSlow));
  ASSERT_TRUE(pool_.submit(1002, quick(), Lane::kAny));
  EXPECT_EQ(take(1001).status, 204U);
  EXPECT_EQ(take(1002).status, 204U);
  may_end_ = true;
}

TEST_F(PageLanesTest, AColumnThatNobodyWaitsForMakesWay) {
  submit_grid();
  solve(24);
  const auto mu = *column_source("mu");
  const auto hold = [this, mu](const AnswerDesk& desk) {
    sqlite3_progress_handler(
        desk.database, 1,
        [](void* self) {
          auto& test = *static_cast<PageLanesTest*>(self);
          test.begun_ = 1;
          while (!test.may_end_) {
            pause();
          }
          return 0;
        },
        this);
    desk.columns.read(desk.database, 1, mu, 24, [] { return false; });
    sqlite3_progress_handler(desk.database, 0, nullptr, nullptr);
    return HttpAnswer{};
  };
  ASSERT_TRUE(pool_.submit(1, hold));
  until_begun(1);
  ASSERT_TRUE(pool_.submit(2, [mu](const AnswerDesk& desk) {
    EXPECT_FALSE(desk.columns.find(desk.database, 1, mu, 24)) << "another reads it";
    return HttpAnswer{};
  }));
  take(2);
  ASSERT_TRUE(pool_.submit(4, [](const AnswerDesk& desk) {
    while (desk.columns.has_wishes()) {  // until it is being filled, in vain for the present
      pause();
    }
    return HttpAnswer{};
  }));
  take(4);
  ASSERT_TRUE(pool_.submit(3, quick(), Lane::kSlow));
  EXPECT_EQ(take(3).status, 204U);
  may_end_ = true;
  take(1);
}

TEST_F(PageLanesTest, TheSecondStepOfAStrangerIsInTheLaneOfTheFirst) {
  submit_grid();
  solve(24);
  ServiceLine line;
  LiveText live([] { return std::nullopt; }, 0);
  Page page(open_to_all(), {line, pool_, pool_, live});
  HttpQuestion question = asked(7, "/api/studies/1/bins");
  question.fields = {{"x", "mu"}, {"where", "1"}};
  const auto answered = [&](ClientReply reply) {
    while (line.take().empty()) {
      EXPECT_FALSE(page.answer(question));
      pause();
    }
    reply.set_request_id(7);
    line.put(protocol::encode(reply));
  };
  ClientReply study;
  study.mutable_status()->add_studies()->set_name("grid");
  answered(study);
  ASSERT_TRUE(pool_.submit(101, blocking(), Lane::kStrangers));
  ASSERT_TRUE(pool_.submit(102, blocking()));
  until_begun(2);  // one thread is left, which takes what it may in turn
  protocol::ChunkWriter rows({"point"});
  ClientReply none;
  *none.mutable_query() = rows.take();
  none.mutable_query()->set_ends(true);
  answered(none);
  EXPECT_FALSE(page.answer(question));
  ASSERT_TRUE(pool_.submit(103, quick()));
  take(103);
  EXPECT_FALSE(page.answer(question)) << "it went before the stranger in front of it";
  may_end_ = true;
  std::optional<HttpAnswer> answer;
  while (!(answer = page.answer(question))) {
    pause();
  }
  EXPECT_EQ(answer->status, 200U);
}

TEST_F(PageLanesTest, WhatStrangersAskOfTheServiceIsOfAClientOfTheirOwn) {
  ServiceLine line;
  LiveText live([] { return std::nullopt; }, 0);
  Page page(open_to_all(), {line, pool_, pool_, live});
  const std::string trace = "/api/studies/1/points/0/trace";
  const auto clients = [&] {
    std::vector<std::string> names;
    for (const auto& [client, frame] : line.take()) {
      names.emplace_back(client);
    }
    return names;
  };
  const std::vector<std::string> stranger{ServiceLine::kStrangers};
  const std::vector<std::string> known{ServiceLine::kIdentity};
  ClientReply study;
  study.mutable_status()->add_studies()->set_name("grid");
  std::uint64_t number = 0;
  for (const bool has_token : {false, true}) {
    const HttpQuestion question =
        has_token ? with_token(asked(++number, trace), page) : asked(++number, trace);
    EXPECT_FALSE(page.answer(question));
    EXPECT_EQ(clients(), has_token ? known : stranger);
    study.set_request_id(number);
    line.put(protocol::encode(study));
    EXPECT_FALSE(page.answer(question));
    EXPECT_EQ(clients(), has_token ? known : stranger) << "what follows";
    page.gone(number);
    EXPECT_EQ(clients(), has_token ? known : stranger) << "its end";
  }
}

TEST_F(PageLanesTest, ConditionsOfStrangersThatTakeLongLeaveRoomForTheOthers) {
  submit_grid();
  ServiceLine line;
  LiveText live([] { return std::nullopt; }, 0);
  Page page(open_to_all(), {line, pool_, pool_, live});
  const auto after_long = [&](HttpQuestion question) {
    question.fields = {{"x", "mu"}, {"where", "1"}};
    while (line.take().empty()) {
      EXPECT_FALSE(page.answer(question));
      pause();
    }
    question.waited = std::chrono::seconds(3);
    const auto answer = page.answer(question);
    return answer ? answer->status : 0;
  };
  const std::string bins = "/api/studies/1/bins";
  std::uint64_t number = 0;
  while (after_long(asked(++number, bins)) == 202) {
    ASSERT_LT(number, 100U);
  }
  EXPECT_EQ(after_long(with_token(asked(++number, bins), page)), 202U);
}

TEST_F(PageLanesTest, TabsOfStrangersLeaveRoomForTheOthers) {
  ServiceLine line;
  LiveText live([] { return std::nullopt; }, 0);
  Page page(open_to_all(), {line, pool_, pool_, live});
  std::vector<HttpAnswer> tabs;
  const auto open = [&] { return *page.answer(asked(tabs.size(), "/api/events")); };
  for (HttpAnswer tab = open(); tab.status == 200; tab = open()) {
    tabs.push_back(std::move(tab));
    ASSERT_LT(tabs.size(), HttpLimits().streams);
  }
  EXPECT_EQ(tabs.size(), HttpLimits().streams / 2);
  EXPECT_EQ(open().status, 503U);
  EXPECT_EQ(page.answer(with_token(asked(100, "/api/events"), page))->status, 200U);
  tabs.pop_back();
  EXPECT_EQ(open().status, 200U);
}

TEST_F(PageLanesTest, ASampleOfTheSameResultsIsReadOnce) {
  submit_grid();
  solve(24);
  const std::vector<ColumnSource> sources{*column_source("mu")};
  SampleBook::Shared first;
  ASSERT_TRUE(pool_.submit(1, [&](const AnswerDesk& desk) {
    first = desk.samples.sample(desk, 1, sources);
    EXPECT_EQ(desk.samples.sample(desk, 1, sources), first);
    const std::vector<ColumnSource> others{*column_source("H")};
    EXPECT_NE(desk.samples.sample(desk, 1, others), first);
    return HttpAnswer{};
  }));
  take(1);
  EXPECT_EQ(first->points.size(), 24U);
}

}  // namespace
}  // namespace oblique::server
