// Answers in chunks from real reader processes, taken by clients that want more or do not.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "proto/wire/chunk_rows.h"
#include "server/queries/query_pool.h"
#include "server/store/store.h"
#include "tests/support/hang_limit.h"
#include "tests/support/points.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using Kind = QueryReport::Kind;
using testing::HasSubstr;

/// Some megabytes: more than is given ahead.
constexpr const char* kLong =
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 60000) "
    "SELECT i, hex(zeroblob(50)) FROM n";
constexpr const char* kSlow =
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n";

class QueryStreamTest : public testing::Test {
 protected:
  QueryStreamTest() {
    settings_.patience_ms = kLongestTimeLimit_ms;
    Store store(path_);
    const auto table = table_of(60);
    AddResults results{1, table, 0, "", "", 1, "now", {}};
    for (std::uint64_t point = 0; point < 60; ++point) {
      results.results.push_back(solved_point(point));
    }
    const std::vector<Change> changes{AddStudy{1, "a", table, "2024-01-01T00:00:00.000Z"},
                                      std::move(results)};
    store.commit(changes);
  }
  /// A question about 60 points in their order, with a chunk for every second of them.
  std::uint64_t ask_by_point(const std::string& client) {
    QueryJob job{++last_ticket_, client, {}};
    auto& question = *job.request.mutable_question();
    question.set_study("a");
    question.add_select("point, '" + std::string(150'000, 'x') + "'");
    job.request.set_in_chunks(true);
    job.request.set_time_limit_ms(kLongestTimeLimit_ms);
    EXPECT_TRUE(pool().submit(std::move(job)));
    return last_ticket_;
  }

  QueryPool& pool() {
    if (!pool_) {
      settings_.reader_program = OBLIQUE_SERVER_PROGRAM;
      pool_.emplace(path_, settings_, [this](QueryReport report) { take(std::move(report)); });
    }
    return *pool_;
  }
  std::uint64_t ask(const std::string& sql, const std::string& client = "") {
    QueryJob job{++last_ticket_, client.empty() ? std::to_string(last_ticket_) : client, {}};
    job.request.set_sql(sql);
    job.request.set_in_chunks(true);
    job.request.set_time_limit_ms(kLongestTimeLimit_ms);
    EXPECT_TRUE(pool().submit(std::move(job)));
    return last_ticket_;
  }
  /// What was given until now.
  struct Answer {
    std::uint64_t chunks = 0;
    std::uint64_t rows = 0;
    std::uint64_t largest = 0;  // bytes of a chunk
    bool in_order = true;
    bool ended = false;
    std::string error;
  };
  template <typename Condition>
  Answer wait_until(std::uint64_t ticket, const Condition& condition) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, test::kHangLimit, [&] { return condition(answers_[ticket]); })) {
      throw std::runtime_error("the pool gives nothing");
    }
    return answers_[ticket];
  }
  Answer wait_for_chunks(std::uint64_t ticket, std::uint64_t chunks) {
    return wait_until(ticket, [chunks](const Answer& answer) { return answer.chunks >= chunks; });
  }
  Answer wait_for_end(std::uint64_t ticket) {
    return wait_until(ticket, [](const Answer& answer) { return answer.ended; });
  }
  Answer take_all(std::uint64_t ticket) {
    std::uint64_t taken = 0;
    while (true) {
      const Answer answer = wait_until(
          ticket, [taken](const Answer& now) { return now.ended || now.chunks > taken; });
      if (answer.ended) {
        return answer;
      }
      taken = answer.chunks;
      pool().more(ticket, taken);
    }
  }

  /// From now on the pool's time stands still, but for `jump_ms`.
  void stop_clock() {
    settings_.clock_ms = [this] { return clock_ms_.load(); };
  }
  void jump_ms(std::int64_t time_ms) { clock_ms_ += time_ms; }

  QueryPoolSettings settings_;

 private:
  void take(QueryReport report) {
    const std::lock_guard lock(mutex_);
    Answer& answer = answers_[report.ticket];
    if (report.kind == Kind::kRows || report.kind == Kind::kAnswered) {
      protocol::ClientReply reply;
      EXPECT_TRUE(protocol::decode(report.reply, reply));
      answer.ended = report.kind == Kind::kAnswered;
      answer.error = reply.error().message();
      if (reply.has_query()) {
        ++answer.chunks;
        answer.in_order = answer.in_order && reply.query().chunk() == answer.chunks &&
                          protocol::is_sound(reply.query()) && reply.query().ends() == answer.ended;
        answer.rows += reply.query().chunk_rows();
        answer.largest = std::max<std::uint64_t>(answer.largest, report.reply.size());
      }
    }
    changed_.notify_all();
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::uint64_t, Answer> answers_;
  std::atomic<std::int64_t> clock_ms_ = 0;
  std::uint64_t last_ticket_ = 0;
  std::optional<QueryPool> pool_;  // last: it reports to the others
};

TEST_F(QueryStreamTest, ALongAnswerComesWholeInBoundedChunks) {
  const Answer answer = take_all(ask(kLong));
  EXPECT_EQ(answer.error, "");
  EXPECT_EQ(answer.rows, 60'000U);
  EXPECT_GT(answer.chunks, 10U);
  EXPECT_TRUE(answer.in_order);
  EXPECT_LT(answer.largest, (std::uint64_t{256} << 10U) + 4096);
}

TEST_F(QueryStreamTest, AShortAnswerIsOneChunkAndAnEmptyOneToo) {
  EXPECT_EQ(take_all(ask("SELECT 1")).chunks, 1U);
  const Answer empty = take_all(ask("SELECT 1 WHERE 0"));
  EXPECT_EQ(empty.chunks, 1U);
  EXPECT_EQ(empty.rows, 0U);
}

TEST_F(QueryStreamTest, FirstRowsDoNotWaitForManyMore) {
  const auto ticket =
      ask("WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 1000000000) "
          "SELECT i FROM n WHERE i % 1000000 = 1");
  EXPECT_GT(wait_for_chunks(ticket, 1).rows, 0U);
  pool().cancel(ticket);
}

TEST_F(QueryStreamTest, WhoTakesNothingIsGivenNoMoreThanAFewChunks) {
  const auto ticket = ask(kLong);
  wait_for_chunks(ticket, kChunksAhead);
  take_all(ask("SELECT 1"));
  EXPECT_EQ(wait_for_chunks(ticket, kChunksAhead).chunks, kChunksAhead);
  pool().more(ticket, 1);
  EXPECT_EQ(wait_for_chunks(ticket, kChunksAhead + 1).chunks, kChunksAhead + 1);
}

TEST_F(QueryStreamTest, AnErrorInTheMiddleEndsTheAnswer) {
  const Answer answer =
      take_all(ask("WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 60000) "
                   "SELECT i, hex(zeroblob(50)), CASE WHEN i = 59000 THEN json('{') END FROM n"));
  EXPECT_THAT(answer.error, HasSubstr("malformed JSON"));
  EXPECT_GT(answer.chunks, 5U);
  EXPECT_TRUE(answer.ended);
}

TEST_F(QueryStreamTest, ClientsThatTakeNothingLeaveAReaderToTheOthers) {
  for (int i = 0; i < 3; ++i) {
    wait_for_chunks(ask(kLong), kChunksAhead);
  }
  const auto fourth = ask(kLong);
  EXPECT_EQ(take_all(ask("SELECT 1")).rows, 1U);
  pool().cancel(1);
  EXPECT_EQ(take_all(fourth).rows, 60'000U);
}

TEST_F(QueryStreamTest, AnAnswerInTheOrderOfPointsMakesRoomAndGoesOnLater) {
  settings_.turns.most_running_each = 1;
  const auto idle = ask_by_point("a");
  wait_for_chunks(idle, kChunksAhead);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(take_all(ask("SELECT 1", "a")).rows, 1U) << "its client has one reader";
  }
  const Answer answer = take_all(idle);
  EXPECT_EQ(answer.error, "");
  EXPECT_EQ(answer.rows, 60U);
  EXPECT_TRUE(answer.in_order);
}

TEST_F(QueryStreamTest, AnAnswerThatRestsCanBeCancelled) {
  settings_.turns.most_running_each = 1;
  const auto idle = ask_by_point("a");
  wait_for_chunks(idle, kChunksAhead);
  EXPECT_EQ(take_all(ask("SELECT 1", "a")).rows, 1U);
  pool().cancel(idle);
  pool().more(idle, kChunksAhead);
  EXPECT_EQ(take_all(ask("SELECT 1", "a")).rows, 1U);
  EXPECT_EQ(wait_for_chunks(idle, kChunksAhead).chunks, kChunksAhead);
}

TEST_F(QueryStreamTest, WhoTakesNothingForLongLosesTheAnswerWhenOthersWait) {
  settings_.patience_ms = 300;
  settings_.turns.most_running_each = 1;
  const auto idle = ask(kLong, "a");
  wait_for_chunks(idle, kChunksAhead);
  EXPECT_EQ(take_all(ask("SELECT 1", "a")).rows, 1U);
  EXPECT_THAT(wait_for_end(idle).error, HasSubstr("others wait"));
}

TEST_F(QueryStreamTest, TimeInWhichAnAnswerWaitsForAReaderIsNotItsClients) {
  stop_clock();
  settings_.patience_ms = 1500;
  settings_.turns.most_running_each = 1;
  settings_.turns.quick_ms = 60'000;
  for (int i = 0; i < 3; ++i) {
    wait_for_chunks(ask(kLong), kChunksAhead);
  }
  const auto fourth = ask(kLong, "a");
  const auto behind_it = ask("SELECT 1", "a");
  jump_ms(settings_.patience_ms + 200);
  pool().cancel(1);
  wait_for_chunks(fourth, kChunksAhead);
  const Answer answer = take_all(fourth);
  EXPECT_EQ(answer.error, "");
  EXPECT_EQ(answer.rows, 60'000U);
  EXPECT_EQ(take_all(behind_it).rows, 1U);
}

TEST_F(QueryStreamTest, TimeInWhichNothingIsTakenDoesNotCount) {
  stop_clock();
  const auto ticket = ask(kLong);
  wait_for_chunks(ticket, kChunksAhead);
  jump_ms(2 * kLongestTimeLimit_ms);
  EXPECT_EQ(take_all(ticket).rows, 60'000U);
}

TEST_F(QueryStreamTest, ALongLogEndsWhatKeepsItFromBeingEmptied) {
  settings_.patience_ms = 100;
  settings_.long_log_bytes = 0;
  const auto idle = ask(kLong);
  EXPECT_THAT(wait_for_end(idle).error, HasSubstr("cannot empty its log"));
}

TEST_F(QueryStreamTest, TheReadersOfCancelledAnswersAreFree) {
  settings_.turns.most_running_each = 1;
  for (int i = 0; i < 10; ++i) {
    const auto ticket = ask(i % 2 == 0 ? kLong : kSlow, "a");
    if (i % 2 == 0) {
      wait_for_chunks(ticket, 2);
    }
    pool().cancel(ticket);
  }
  EXPECT_EQ(take_all(ask("SELECT 1", "a")).rows, 1U);
}

}  // namespace
}  // namespace oblique::server
