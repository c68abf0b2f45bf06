// Tests queries in real reader processes, including statements that cannot be interrupted.
#include "server/query/query_pool.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "proto/system/descriptor.h"
#include "proto/wire/chunk.h"
#include "server/query/reader.h"
#include "server/store/store.h"
#include "tests/support/hang_limit.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using Kind = QueryReport::Kind;
using testing::AnyOf;
using testing::HasSubstr;

/// In this query SQLite compares bytes for hours without checking for an interrupt.
constexpr const char* kUninterruptible =
    "SELECT instr(zeroblob(16000000), zeroblob(7999999) || x'01')";

/// The result of this query has several megabytes. A reader sends less than that before the client
/// takes chunks.
constexpr const char* kLong =
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 60000) "
    "SELECT i, hex(zeroblob(50)) FROM n";

/// Provides a pool with a clock that only the tests advance.
class QueryPoolTest : public testing::Test {
 protected:
  QueryPoolTest() {
    Store store(path_);
    settings_.reader_program = OBLIQUE_TEST_READER;
  }

  QueryPool& pool() {
    if (!pool_) {
      settings_.now_ms = [this] { return now_ms_.load(); };
      pool_.emplace(path_, settings_, [this](QueryReport report) { take(report); });
    }
    return *pool_;
  }
  void advance_ms(std::int64_t time_ms) {
    now_ms_ += time_ms;
    // No query has this number. The call only makes the pool read its clock.
    pool().cancel(UINT64_MAX);
  }
  std::uint64_t submit(const std::string& sql, const std::string& client = "") {
    QueryJob job{++last_ticket_, client.empty() ? std::to_string(last_ticket_) : client, {}};
    job.request.set_sql(sql);
    job.request.set_time_limit_ms(kTimeLimit_ms);
    EXPECT_TRUE(pool().submit(std::move(job)));
    return last_ticket_;
  }

  /// Summary of the reports on one query.
  struct Answer {
    bool runs = false;
    bool ended = false;
    bool in_order = true;
    std::uint64_t chunks = 0;
    std::uint64_t rows = 0;
    std::uint64_t largest = 0;     // size of the largest chunk
    std::int64_t last_number = 0;  // first column of the last row
    std::string error;
  };
  Answer answer(std::uint64_t ticket) {
    const std::lock_guard lock(mutex_);
    return answers_[ticket];
  }
  template <typename Condition>
  Answer wait_until(std::uint64_t ticket, const Condition& condition) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, test::kHangLimit, [&] { return condition(answers_[ticket]); })) {
      throw std::runtime_error("the query pool reported nothing in time");
    }
    return answers_[ticket];
  }
  void wait_for_start(std::uint64_t ticket) {
    wait_until(ticket, [](const Answer& answer) { return answer.runs; });
  }
  void wait_for_chunks(std::uint64_t ticket, std::uint64_t chunks) {
    wait_until(ticket, [chunks](const Answer& answer) { return answer.chunks >= chunks; });
  }
  Answer wait_for_end(std::uint64_t ticket) {
    return wait_until(ticket, [](const Answer& answer) { return answer.ended; });
  }
  Answer take_all(std::uint64_t ticket) {
    Answer now;
    while (!now.ended) {
      const std::uint64_t taken = now.chunks;
      pool().more(ticket, taken);
      now = wait_until(
          ticket, [taken](const Answer& answer) { return answer.ended || answer.chunks > taken; });
    }
    return now;
  }
  /// Makes the pool run a shell script instead of the reader program. Returns its path.
  std::string use_script(const std::string& commands) {
    settings_.reader_program = folder_.file("reader");
    std::ofstream(settings_.reader_program) << "#!/bin/sh\n" << commands << '\n';
    std::filesystem::permissions(settings_.reader_program, std::filesystem::perms::owner_all);
    return settings_.reader_program;
  }
  std::string error_of(const std::string& sql) { return take_all(submit(sql)).error; }
  /// Returns the first value of the only row.
  std::int64_t number_of(const std::string& sql) {
    const Answer answer = take_all(submit(sql));
    EXPECT_EQ(answer.rows, 1U) << answer.error;
    return answer.last_number;
  }

  static constexpr std::int64_t kTimeLimit_ms = kLongestTimeLimit_ms;

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  QueryPoolSettings settings_;

 private:
  void take(const QueryReport& report) {
    const std::lock_guard lock(mutex_);
    Answer& answer = answers_[report.ticket];
    answer.runs = true;
    answer.ended = report.kind == Kind::kAnswered;
    protocol::ClientReply reply;
    EXPECT_TRUE(protocol::decode(report.reply, reply));
    answer.error = reply.error().message();
    if (reply.has_query()) {
      const protocol::QueryReply& chunk = reply.query();
      ++answer.chunks;
      answer.in_order = answer.in_order && chunk.chunk() == answer.chunks &&
                        protocol::is_sound(chunk) && chunk.ends() == answer.ended;
      answer.rows += chunk.chunk_rows();
      answer.largest = std::max<std::uint64_t>(answer.largest, report.reply.size());
      protocol::ChunkRows rows(chunk);
      while (rows.next()) {
        answer.last_number = rows.cell(0).integer;
      }
    }
    changed_.notify_all();
  }

  std::atomic<std::int64_t> now_ms_ = 1'000'000;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::uint64_t, Answer> answers_;
  std::uint64_t last_ticket_ = 0;
  std::optional<QueryPool> pool_;  // the last member, because it uses the others
};

TEST_F(QueryPoolTest, AReaderWhoseServerWasKilledDuringItsStartRunsNoQuery) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
  const protocol::Descriptor reader_end(ends[1]);
  close(ends[0]);
  const protocol::Descriptor request(memfd_create("query", MFD_CLOEXEC));
  protocol::QueryRequest query;
  query.set_sql(kUninterruptible);
  ASSERT_TRUE(query.SerializeToFileDescriptor(request.number()));
  ASSERT_EQ(lseek(request.number(), 0, SEEK_SET), 0);
  const pid_t pid =
      start_reader(settings_.reader_program, path_, request.number(), reader_end.number());
  int status = -1;
  EXPECT_EQ(waitpid(pid, &status, 0), pid);
  EXPECT_EQ(status, 0);
}

TEST_F(QueryPoolTest, AQueryIsAnsweredByAnotherProcess) {
  EXPECT_EQ(number_of("SELECT 5 AS five, 'x'"), 5);
  EXPECT_EQ(number_of("SELECT 7 /*" + std::string(900'000, 'x') + "*/"), 7);
  EXPECT_THAT(error_of("SELECT nothing"), HasSubstr("nothing"));
  const Answer empty = take_all(submit("SELECT 1 WHERE 0"));
  EXPECT_EQ(empty.chunks, 1U);
  EXPECT_EQ(empty.rows, 0U);
}

TEST_F(QueryPoolTest, AQueryIsKilledAtItsDeadline) {
  const auto uninterruptible = submit(kUninterruptible);
  wait_for_start(uninterruptible);
  advance_ms(kTimeLimit_ms - 1);
  EXPECT_EQ(number_of("SELECT 1"), 1);
  EXPECT_FALSE(answer(uninterruptible).ended);
  advance_ms(1);
  EXPECT_THAT(wait_for_end(uninterruptible).error, HasSubstr("took more than 600 s"));
  EXPECT_EQ(number_of("SELECT 1"), 1);
}

TEST_F(QueryPoolTest, QueriesThatNeedTooMuchMemoryFailWithThatReason) {
  EXPECT_THAT(error_of("SELECT hex(zeroblob(450000000))"), HasSubstr("exceeds the allowed 16 MiB"));
  // SQLite's printf returns NULL for a text that exceeds the limit.
  EXPECT_EQ(number_of("SELECT printf('%.*c', 900000000, 'x') IS NULL"), 1);
  const std::string megabytes =
      "(WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 5000)"
      " SELECT hex(zeroblob(500000)) || i AS b FROM n)";
  for (const std::string& sql : {"SELECT b FROM " + megabytes + " ORDER BY substr(b, 900000)",
                                 "SELECT length(json_group_array(b)) FROM " + megabytes}) {
    EXPECT_THAT(error_of(sql), AnyOf(HasSubstr("more memory than the 256 MiB allowed"),
                                     HasSubstr("exceeds the allowed 16 MiB")))
        << sql;
  }
  EXPECT_THAT(error_of("SELECT zeroblob(10000000)"), HasSubstr("one row has more than"));
  EXPECT_EQ(number_of("SELECT length(zeroblob(16000000))"), 16'000'000);
}

TEST_F(QueryPoolTest, AWaitingQueryStartsWhenACancelledOneEnds) {
  settings_.queue.most_running_each = 1;
  const auto running = submit(kUninterruptible, "one client");
  wait_for_start(running);
  const auto next = submit("SELECT 2", "one client");
  EXPECT_EQ(number_of("SELECT 1"), 1) << "a query of another client is not delayed";
  EXPECT_FALSE(answer(next).runs);
  pool().cancel(running);
  EXPECT_EQ(wait_for_end(next).last_number, 2);
  EXPECT_FALSE(answer(running).ended);
}

TEST_F(QueryPoolTest, StoppingWaitsForNoQuery) {
  for (int i = 0; i < 4; ++i) {
    wait_for_start(submit(kUninterruptible));
  }
  submit(kUninterruptible);
  pool().stop();
  EXPECT_FALSE(pool().submit({99, "late", {}}));
}

TEST_F(QueryPoolTest, AReaderThatDiesIsReplaced) {
  use_script("printf '\\377\\377\\377\\377\\0\\0\\0\\0'\nexec sleep 1000");
  EXPECT_THAT(error_of("SELECT 1"), HasSubstr("the process of the query ended"))
      << "the reader sent a too long frame";
  const std::string program = use_script("exit 3");
  EXPECT_THAT(error_of("SELECT 1"), HasSubstr("the process of the query ended"));
  std::filesystem::remove(program);
  EXPECT_THAT(error_of("SELECT 1"), HasSubstr("cannot start a process"));
  std::filesystem::create_symlink(OBLIQUE_TEST_READER, program);
  EXPECT_EQ(number_of("SELECT 1"), 1);
}

TEST_F(QueryPoolTest, ALongAnswerIsCompleteInLimitedChunks) {
  const Answer answer = take_all(submit(kLong));
  EXPECT_EQ(answer.error, "");
  EXPECT_EQ(answer.rows, 60'000U);
  EXPECT_EQ(answer.last_number, 60'000);
  EXPECT_GT(answer.chunks, 10U);
  EXPECT_TRUE(answer.in_order);
  EXPECT_LT(answer.largest, (std::uint64_t{256} << 10U) + 4096);
}

TEST_F(QueryPoolTest, WithoutConfirmationAClientGetsFourChunksAndItsAnswerEndsAfterTenSeconds) {
  const auto ticket = submit(kLong);
  wait_for_chunks(ticket, kChunksAhead);
  take_all(submit("SELECT 1"));
  EXPECT_EQ(answer(ticket).chunks, kChunksAhead);
  advance_ms(settings_.patience_ms - 1);
  pool().more(ticket, 1);
  wait_for_chunks(ticket, kChunksAhead + 1);
  advance_ms(settings_.patience_ms - 1);
  take_all(submit("SELECT 1"));
  EXPECT_EQ(answer(ticket).chunks, kChunksAhead + 1);
  EXPECT_FALSE(answer(ticket).ended);
  advance_ms(1);
  EXPECT_THAT(wait_for_end(ticket).error, HasSubstr("read no rows for 10 s"));
}

TEST_F(QueryPoolTest, AnAnswerEndsAtItsTimeLimit) {
  settings_.longest_answer_ms = 5000;
  const auto ticket = submit(kLong);
  wait_for_chunks(ticket, kChunksAhead);
  advance_ms(5000);
  EXPECT_THAT(wait_for_end(ticket).error, HasSubstr("took more than 5 s"));
}

class QueryQueueTest : public testing::Test {
 protected:
  bool add(const std::string& client, const std::string& sql = "SELECT 1") {
    QueryJob job{++last_ticket_, client, {}};
    job.request.set_sql(sql);
    return queue_.add(std::move(job));
  }
  /// Starts all queries that may run now. Returns them as "client:ticket".
  std::vector<std::string> start() {
    std::vector<std::string> started;
    while (const auto job = queue_.start_next()) {
      started.push_back(job->client + ":" + std::to_string(job->ticket));
    }
    return started;
  }

  using Names = std::vector<std::string>;

  QueryQueue queue_{QueueSettings{}};
  std::uint64_t last_ticket_ = 0;
};

TEST_F(QueryQueueTest, ClientsTakeTurnsAndEachIsServedInOrderOfArrival) {
  for (int i = 0; i < 6; ++i) {
    add("a");
  }
  for (const char* client : {"b", "b", "c", "c"}) {
    add(client);
  }
  EXPECT_EQ(start(), (Names{"a:1", "b:7", "c:9", "a:2"}));
  queue_.remove(1);
  EXPECT_EQ(start(), Names{"b:8"});
  queue_.remove(7);
  EXPECT_EQ(start(), Names{"c:10"});
  queue_.remove(9);
  EXPECT_EQ(start(), Names{"a:3"});
}

TEST_F(QueryQueueTest, TheNumberOfWaitingQueriesIsBoundedForEachClientAndForAll) {
  for (int i = 0; i < 16; ++i) {
    EXPECT_TRUE(add("a"));
  }
  EXPECT_FALSE(add("a"));
  for (int i = 0; i < 48; ++i) {
    EXPECT_TRUE(add("client " + std::to_string(i)));
  }
  EXPECT_FALSE(add("one more"));
  start();
  EXPECT_TRUE(add("one more"));
}

TEST_F(QueryQueueTest, ManyEmptyTextsCountWithTheirMemory) {
  QueryJob job{0, {}, {}};
  for (int i = 0; i < 100'000; ++i) {
    job.request.mutable_question()->add_select("");
  }
  int waiting = 0;
  while (waiting < 64 && queue_.add({++last_ticket_, std::to_string(waiting), job.request})) {
    ++waiting;
  }
  EXPECT_LE(waiting, 4);
}

TEST_F(QueryQueueTest, TheMemoryOfWaitingQueriesIsBounded) {
  const std::string half(QueueSettings{}.most_waiting_bytes / 2 - 1000, ' ');
  ASSERT_TRUE(add("a", half));
  ASSERT_TRUE(add("b", half));
  EXPECT_FALSE(add("c", std::string(4000, ' ')));
  queue_.remove(2);
  EXPECT_TRUE(add("c", half)) << "the removed query takes no room";
  EXPECT_FALSE(add("d", half));
  start();
  EXPECT_TRUE(add("d", half)) << "running queries do not count";
}

}  // namespace
}  // namespace oblique::server
