#include "server/queries/query_queue.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace oblique::server {
namespace {

class QueryQueueTest : public testing::Test {
 protected:
  bool add(const std::string& client, const std::string& sql = "SELECT 1") {
    QueryJob job{++last_ticket_, client, {}};
    job.request.set_sql(sql);
    return queue_.add(std::move(job));
  }
  /// Starts all queries that may run now; returns them as "client:ticket".
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

TEST_F(QueryQueueTest, OneClientNeverHasAllReaders) {
  for (int i = 0; i < 5; ++i) {
    add("a");
  }
  EXPECT_EQ(start(), (Names{"a:1", "a:2"}));
  add("b");
  EXPECT_EQ(start(), Names{"b:6"});
}

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

TEST_F(QueryQueueTest, TheBytesOfWaitingStatementsAreBounded) {
  const std::string half(QueueSettings{}.most_waiting_bytes / 2 - 100, ' ');
  ASSERT_TRUE(add("a", half));
  ASSERT_TRUE(add("b", half));
  EXPECT_FALSE(add("c", std::string(1000, ' ')));
  queue_.remove(2);
  EXPECT_TRUE(add("c", half)) << "b's query no longer waits";
  EXPECT_FALSE(add("d", half));
  start();
  EXPECT_TRUE(add("d", half)) << "running queries do not count";
}

TEST_F(QueryQueueTest, ARemovedQueryIsNeverStarted) {
  add("a");
  add("a");
  add("b");
  queue_.remove(1);
  queue_.remove(3);
  queue_.remove(99);
  EXPECT_EQ(start(), Names{"a:2"});
}

}  // namespace
}  // namespace oblique::server
