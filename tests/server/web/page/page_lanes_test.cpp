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
  PageSettings settings;
  settings.shows_without_token = true;
  Page page(settings, {line, pool_, pool_, live});
  HttpQuestion question{};
  question.number = 7;
  question.method = "GET";
  question.path = "/api/studies/1/bins";
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
