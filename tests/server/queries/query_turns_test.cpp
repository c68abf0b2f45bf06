#include "server/queries/query_turns.h"

#include <vector>

#include <gtest/gtest.h>

namespace oblique::server {
namespace {

/// Turns with a clock that tests set. Queries are called by the client and their ticket.
class QueryTurnsTest : public testing::Test {
 protected:
  bool ask(const std::string& client, const std::string& sql = "SELECT 1") {
    QueryJob job{++last_ticket_, client, {}};
    job.request.set_sql(sql);
    return turns_.add(std::move(job));
  }
  /// All that may begin now, as "client:ticket".
  std::vector<std::string> begin() {
    std::vector<std::string> begun;
    while (const auto job = turns_.begin(now_ms_)) {
      begun.push_back(job->client + ":" + std::to_string(job->ticket));
    }
    return begun;
  }

  using Names = std::vector<std::string>;

  std::int64_t now_ms_ = 1'000'000;
  QueryTurns turns_{TurnSettings{}};
  std::uint64_t last_ticket_ = 0;
};

TEST_F(QueryTurnsTest, OneClientNeverHoldsAllReaders) {
  for (int i = 0; i < 5; ++i) {
    ask("a");
  }
  EXPECT_EQ(begin(), (Names{"a:1", "a:2"}));
  ask("b");
  EXPECT_EQ(begin(), Names{"b:6"});
}

TEST_F(QueryTurnsTest, ClientsTakeTurnsHoweverManyQueriesEachHas) {
  for (int i = 0; i < 6; ++i) {
    ask("a");
  }
  for (const char* client : {"b", "b", "c", "c"}) {
    ask(client);
  }
  EXPECT_EQ(begin(), (Names{"a:1", "b:7", "c:9", "a:2"}));
  turns_.remove(1);
  EXPECT_EQ(begin(), Names{"b:8"});
  turns_.remove(7);
  EXPECT_EQ(begin(), Names{"c:10"});
  turns_.remove(9);
  EXPECT_EQ(begin(), Names{"a:3"});
}

TEST_F(QueryTurnsTest, BytesOfAQueryThatIsGivenUpOrRunsAreFreeForOthers) {
  constexpr std::size_t kHalf = TurnSettings{}.most_waiting_bytes / 2;
  const std::string half(kHalf, ' ');
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(ask("a", half)) << i;
    ASSERT_TRUE(ask("b", half)) << i;
    EXPECT_FALSE(ask("c")) << "all the bytes are taken";
    turns_.remove(last_ticket_ - 1);  // of b, which waits
    ASSERT_EQ(begin().size(), 1U);
    turns_.remove(last_ticket_ - 2);  // of a, which ran
  }
}

TEST_F(QueryTurnsTest, WhatWaitsIsBoundedForEachClientAndForAll) {
  for (int i = 0; i < 16; ++i) {
    EXPECT_TRUE(ask("a"));
  }
  EXPECT_FALSE(ask("a"));
  for (int i = 0; i < 48; ++i) {
    EXPECT_TRUE(ask("client " + std::to_string(i)));
  }
  EXPECT_FALSE(ask("one more"));
  EXPECT_EQ(turns_.waiting(), 64U);
  begin();
  EXPECT_TRUE(ask("one more"));
}

TEST_F(QueryTurnsTest, TheStatementsThatWaitAreBoundedInBytes) {
  const std::string million(1'000'000, ' ');
  int taken = 0;
  while (taken < 64 && ask("client " + std::to_string(taken), million)) {
    ++taken;
  }
  EXPECT_EQ(taken, 16);
  begin();
  EXPECT_TRUE(ask("one more", million));
}

TEST_F(QueryTurnsTest, AQuickQueryWaitsForNoSlowOne) {
  for (const char* client : {"a", "b", "c", "d", "e"}) {
    ask(client);
  }
  EXPECT_EQ(begin(), (Names{"a:1", "b:2", "c:3", "d:4"}));
  EXPECT_FALSE(turns_.put_back(now_ms_).has_value());
  EXPECT_EQ(turns_.next_change_ms(now_ms_), now_ms_ + 500);
  now_ms_ += 500;
  EXPECT_EQ(turns_.put_back(now_ms_), 4U);
  EXPECT_EQ(begin(), Names{"e:5"});
  EXPECT_FALSE(turns_.put_back(now_ms_).has_value());
}

TEST_F(QueryTurnsTest, SlowQueriesRunOnWhileNobodyElseWaits) {
  for (const char* client : {"a", "b", "c", "d"}) {
    ask(client);
  }
  begin();
  now_ms_ += 60'000;
  EXPECT_FALSE(turns_.put_back(now_ms_).has_value());
  EXPECT_FALSE(turns_.next_change_ms(now_ms_).has_value());
}

TEST_F(QueryTurnsTest, AQueryPutBackRunsAgainOnceASlowOneHasEnded) {
  for (const char* client : {"a", "b", "c", "d", "e"}) {
    ask(client);
  }
  begin();
  now_ms_ += 500;
  ASSERT_EQ(turns_.put_back(now_ms_), 4U);
  begin();
  turns_.remove(5);
  EXPECT_EQ(begin(), Names{}) << "the last reader is for those not known to be slow";
  turns_.remove(1);
  EXPECT_EQ(begin(), Names{"d:4"});
}

TEST_F(QueryTurnsTest, AStreamOfQuickQueriesDoesNotKeepASlowOneWaiting) {
  for (const char* client : {"a", "b", "c", "d", "e"}) {
    ask(client);
  }
  begin();
  now_ms_ += 500;
  turns_.put_back(now_ms_);
  begin();
  for (int i = 0; i < 20; ++i) {
    ask("quick " + std::to_string(i));
  }
  turns_.remove(1);
  turns_.remove(2);
  EXPECT_EQ(begin(), (Names{"d:4", "quick 0:6"}));
}

TEST_F(QueryTurnsTest, AQueryThatNobodyWantsIsGoneWhereverItIs) {
  for (const char* client : {"a", "b", "c", "d", "e"}) {
    ask(client);
  }
  begin();
  now_ms_ += 500;
  turns_.put_back(now_ms_);
  begin();
  ask("f");
  for (std::uint64_t ticket = 1; ticket <= last_ticket_; ++ticket) {
    turns_.remove(ticket);
  }
  EXPECT_EQ(turns_.running(), 0U);
  EXPECT_EQ(turns_.waiting(), 0U);
  EXPECT_EQ(begin(), Names{});
  turns_.remove(4711);
}

TEST_F(QueryTurnsTest, OneReaderIsAlwaysLeftToQueriesThatCanBeginAnew) {
  for (const char* client : {"a", "b", "c", "d"}) {
    ask(client);
  }
  begin();
  EXPECT_TRUE(turns_.bind(1));
  EXPECT_TRUE(turns_.bind(2));
  EXPECT_TRUE(turns_.bind(3));
  EXPECT_FALSE(turns_.bind(4));
  EXPECT_TRUE(turns_.bind(1)) << "it is bound already";
  now_ms_ += 1000;
  ask("e");
  EXPECT_EQ(turns_.put_back(now_ms_), 4U);
  EXPECT_EQ(begin(), Names{"e:5"});
  turns_.remove(1);
  EXPECT_TRUE(turns_.bind(5));
}

TEST_F(QueryTurnsTest, ABoundQueryIsNotPutBackThoughItBeganLast) {
  for (const char* client : {"a", "b", "c", "d"}) {
    ask(client);
  }
  begin();
  turns_.bind(4);
  now_ms_ += 1000;
  ask("e");
  EXPECT_EQ(turns_.put_back(now_ms_), 3U);
}

TEST_F(QueryTurnsTest, AQueryThatIsPutBackGoesOnFromWhatItGave) {
  for (const char* client : {"a", "b", "c", "d"}) {
    ask(client);
  }
  begin();
  protocol::GivenRows given;
  given.set_last_point(17);
  turns_.note_given(4, given);
  now_ms_ += 1000;
  ask("e");
  EXPECT_EQ(turns_.put_back(now_ms_), 4U);
  for (std::uint64_t ticket = 1; ticket <= 3; ++ticket) {
    turns_.remove(ticket);
  }
  EXPECT_EQ(turns_.begin(now_ms_)->ticket, 4U);
}

TEST_F(QueryTurnsTest, AParkedQueryLeavesItsReaderAndComesBackWithWhatItGave) {
  for (const char* client : {"a", "b", "c", "d", "e"}) {
    ask(client);
  }
  begin();
  protocol::GivenRows given;
  given.set_last_point(17);
  turns_.note_given(2, given);
  EXPECT_TRUE(turns_.is_in_the_way(2));
  EXPECT_TRUE(turns_.park(2));
  EXPECT_EQ(begin(), Names{"e:5"});
  EXPECT_EQ(turns_.waiting(), 0U);
  EXPECT_EQ(turns_.parked(), 1U);
  turns_.unpark(2);
  turns_.unpark(2);
  EXPECT_EQ(turns_.waiting(), 1U);
  turns_.remove(1);
  const auto back = turns_.begin(now_ms_);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->ticket, 2U);
  EXPECT_EQ(back->request.after().last_point(), 17);
}

TEST_F(QueryTurnsTest, AQueryIsInTheWayOnlyOfThoseWhoCouldRunInItsPlace) {
  ask("a");
  ask("a");
  ask("b");
  begin();
  EXPECT_FALSE(turns_.is_in_the_way(1));
  ask("a");
  EXPECT_TRUE(begin().empty()) << "one client has two readers at most";
  EXPECT_TRUE(turns_.is_in_the_way(1));
  EXPECT_FALSE(turns_.is_in_the_way(3)) << "the reader of b would help nobody";
}

TEST_F(QueryTurnsTest, ParkedQueriesAreBoundedAndCountAsTheirClients) {
  TurnSettings settings;
  settings.most_parked = 1;
  turns_ = QueryTurns(settings);
  ask("a");
  ask("b");
  begin();
  EXPECT_TRUE(turns_.park(1));
  EXPECT_FALSE(turns_.park(2));
  for (std::size_t i = 1; i < settings.most_waiting_each; ++i) {
    EXPECT_TRUE(ask("a"));
  }
  EXPECT_FALSE(ask("a"));
  turns_.remove(1);
  EXPECT_TRUE(turns_.park(2));
  EXPECT_TRUE(ask("a"));
}

}  // namespace
}  // namespace oblique::server
