// Queries in real reader processes, some of which do what no thread could be stopped at.
#include "server/queries/query_pool.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "server/queries/reader_program.h"
#include "server/store/store.h"
#include "tests/support/hang_limit.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using Kind = QueryReport::Kind;
using testing::AnyOf;
using testing::HasSubstr;

/// Looks at the clock once, before it begins, and then compares for hours.
constexpr const char* kDeaf = "SELECT instr(zeroblob(16000000), zeroblob(7999999) || x'01')";
constexpr const char* kEndless =
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n";

/// A pool, and a place for what it reports.
class QueryPoolTest : public testing::Test {
 protected:
  QueryPoolTest() { Store store(path_); }

  QueryPool& pool() {
    if (!pool_) {
      QueryPoolSettings settings;
      settings.reader_program = program_;
      settings.turns = turns_;
      pool_.emplace(path_, settings, [this](QueryReport report) { take(std::move(report)); });
    }
    return *pool_;
  }
  std::uint64_t ask(const std::string& sql, std::uint64_t time_limit_ms = kLongestTimeLimit_ms,
                    const std::string& client = "") {
    QueryJob job{++last_ticket_, client.empty() ? std::to_string(last_ticket_) : client, {}};
    job.request.set_sql(sql);
    job.request.set_time_limit_ms(time_limit_ms);
    EXPECT_TRUE(pool().submit(std::move(job)));
    return last_ticket_;
  }
  bool has(std::uint64_t ticket, Kind kind) {
    const std::lock_guard lock(mutex_);
    return replies_.contains({ticket, kind});
  }
  protocol::ClientReply wait_for(std::uint64_t ticket, Kind kind = Kind::kAnswered) {
    std::unique_lock lock(mutex_);
    const bool came = arrived_.wait_for(lock, test::kHangLimit, [&] {
      return replies_.contains({ticket, kind});
    });
    if (!came) {
      throw std::runtime_error("the pool does not answer");
    }
    return replies_.at({ticket, kind});
  }
  std::string error_of(const std::string& sql, std::uint64_t time_limit_ms = kLongestTimeLimit_ms) {
    return wait_for(ask(sql, time_limit_ms)).error().message();
  }
  std::int64_t number_of(const std::string& sql) { return number_in(wait_for(ask(sql))); }
  /// Of the first row; −1, and a failure, when the reply is an error.
  static std::int64_t number_in(const protocol::ClientReply& reply) {
    EXPECT_EQ(reply.query().rows_size(), 1) << reply.error().message();
    return reply.query().rows_size() == 1 ? reply.query().rows(0).values(0).integer() : -1;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
  std::string program_ = OBLIQUE_SERVER_PROGRAM;
  TurnSettings turns_;

 private:
  void take(QueryReport report) {
    const std::lock_guard lock(mutex_);
    protocol::ClientReply reply;
    EXPECT_TRUE(protocol::decode(report.reply, reply));
    replies_[{report.ticket, report.kind}] = std::move(reply);
    arrived_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::pair<std::uint64_t, Kind>, protocol::ClientReply> replies_;
  std::uint64_t last_ticket_ = 0;
  std::optional<QueryPool> pool_;  // last: it reports to the others
};

TEST_F(QueryPoolTest, AReaderWhoseServerWasKilledWhileItStartedBeginsNoQuery) {
  std::array<int, 2> ends{};
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), 0);
  protocol::QueryRequest request;
  request.set_sql(kDeaf);
  const std::string query = protocol::encode(request);
  const auto length = static_cast<FrameLength>(query.size());
  ASSERT_EQ(write(ends[0], &length, sizeof length), static_cast<ssize_t>(sizeof length));
  ASSERT_EQ(write(ends[0], query.data(), query.size()), static_cast<ssize_t>(query.size()));
  close(ends[0]);
  test::Process reader(folder_, program_, {kReadMode, path_}, {}, ends[1]);
  close(ends[1]);
  EXPECT_EQ(reader.wait(), 0);
}

TEST_F(QueryPoolTest, AQueryIsAnsweredByAnotherProcess) {
  const auto reply = wait_for(ask("SELECT 5 AS five, 'x'"));
  ASSERT_EQ(reply.query().rows_size(), 1) << reply.error().message();
  EXPECT_EQ(reply.query().columns(0), "five");
  EXPECT_EQ(reply.query().rows(0).values(0).integer(), 5);
  EXPECT_EQ(reply.query().rows(0).values(1).text(), "x");
  EXPECT_THAT(error_of("SELECT nothing"), HasSubstr("nothing"));
  EXPECT_THAT(error_of("SELECT count(*) FROM runs WHERE \"mux\" > 0.5"),
              HasSubstr("no such column: mux"));
}

TEST_F(QueryPoolTest, AQueryThatNeverLooksAtTheClockIsKilledAtItsTime) {
  EXPECT_THAT(error_of(kDeaf, 200), HasSubstr("took too long (more than 0.2 s)"));
  EXPECT_EQ(number_of("SELECT 1"), 1);
}

TEST_F(QueryPoolTest, AnEndlessQueryEndsAtItsTime) {
  EXPECT_THAT(error_of(kEndless, 100), HasSubstr("took too long (more than 0.1 s)"));
}

TEST_F(QueryPoolTest, QueriesThatNeedMuchMemoryFailAndSaySo) {
  for (const char* sql : {"SELECT zeroblob(1000000000)", "SELECT hex(zeroblob(450000000))",
                          "SELECT hex(zeroblob(16000000))",
                          "SELECT replace(hex(zeroblob(8000000)), '0', '0123456789')"}) {
    EXPECT_THAT(error_of(sql), HasSubstr("more than the 16 MiB allowed")) << sql;
  }
  // To SQLite's printf a text over the limit is NULL.
  EXPECT_EQ(number_of("SELECT printf('%.*c', 900000000, 'x') IS NULL"), 1);
  const std::string megabytes =
      "(WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 5000)"
      " SELECT hex(zeroblob(500000)) || i AS b FROM n)";
  for (const std::string& sql : {"SELECT b FROM " + megabytes + " ORDER BY substr(b, 900000)",
                                 "SELECT count(DISTINCT b) FROM " + megabytes,
                                 "SELECT length(json_group_array(b)) FROM " + megabytes}) {
    EXPECT_THAT(error_of(sql), AnyOf(HasSubstr("more memory than the 256 MiB allowed"),
                                     HasSubstr("more than the 16 MiB allowed")))
        << sql;
  }
  EXPECT_THAT(error_of("SELECT zeroblob(10000000)"), HasSubstr("one row alone has more than"));
  EXPECT_EQ(number_of("SELECT length(zeroblob(16000000))"), 16'000'000);
}

TEST_F(QueryPoolTest, OthersAreAnsweredWhileMoreDeafQueriesRunThanThereAreReaders) {
  for (int i = 0; i < 10; ++i) {
    ask(kDeaf);
  }
  EXPECT_EQ(number_of("SELECT 1"), 1);
  for (std::uint64_t ticket = 1; ticket <= 10; ++ticket) {
    EXPECT_FALSE(has(ticket, Kind::kAnswered));
  }
}

TEST_F(QueryPoolTest, ACancelledQueryGivesItsReaderBack) {
  turns_.most_running_each = 1;
  const auto running = ask(kDeaf, kLongestTimeLimit_ms, "one client");
  wait_for(running, Kind::kBegun);
  const auto next = ask("SELECT 2", kLongestTimeLimit_ms, "one client");
  EXPECT_FALSE(has(next, Kind::kBegun));
  pool().cancel(running);
  EXPECT_EQ(number_in(wait_for(next)), 2);
  EXPECT_FALSE(has(running, Kind::kAnswered));
}

TEST_F(QueryPoolTest, StoppingWaitsForNoQuery) {
  for (int i = 0; i < 4; ++i) {
    wait_for(ask(kDeaf), Kind::kBegun);
  }
  ask(kDeaf);
  pool().stop();
  QueryJob late{99, "late", {}};
  EXPECT_FALSE(pool().submit(std::move(late)));
}

TEST_F(QueryPoolTest, AReaderThatDiesIsReplaced) {
  std::ofstream(folder_.file("reader")) << "#!/bin/sh\nexit 3\n";
  std::filesystem::permissions(folder_.file("reader"), std::filesystem::perms::owner_all);
  program_ = folder_.file("reader");
  EXPECT_THAT(error_of("SELECT 1"), HasSubstr("ended with exit code 3"));
  std::filesystem::remove(program_);
  EXPECT_THAT(error_of("SELECT 1"), HasSubstr("no process can be started"));
  std::filesystem::create_symlink(OBLIQUE_SERVER_PROGRAM, program_);
  EXPECT_EQ(number_of("SELECT 1"), 1);
}

TEST_F(QueryPoolTest, AReaderTakesUpADatabaseThatCannotBeReadAtFirst) {
  std::filesystem::rename(path_, path_ + ".away");
  EXPECT_THAT(error_of("SELECT 1"), HasSubstr("there is no database"));
  std::filesystem::rename(path_ + ".away", path_);
  EXPECT_EQ(number_of("SELECT 1"), 1);
}

TEST_F(QueryPoolTest, AnAnswerOfManyRowsComesWhole) {
  const auto reply =
      wait_for(ask("WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 100000) "
                   "SELECT i, hex(randomblob(40)) FROM n"));
  ASSERT_EQ(reply.query().rows_size(), 100'000);
  EXPECT_FALSE(reply.query().truncated());
  EXPECT_EQ(reply.query().rows(99'999).values(0).integer(), 100'000);
}

TEST_F(QueryPoolTest, ALongStatementReachesTheReader) {
  EXPECT_EQ(number_of("SELECT 7 /*" + std::string(900'000, 'x') + "*/"), 7);
}

}  // namespace
}  // namespace oblique::server
