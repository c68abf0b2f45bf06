// SQL statements that would run for hours, sent to a real server.
#include <csignal>
#include <deque>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::test {
namespace {

/// A statement that compares bytes for hours, during which SQLite does not check for interrupts.
constexpr const char* kUninterruptible =
    "SELECT instr(zeroblob(16000000), zeroblob(7999999) || x'01')";

class QueryAttackTest : public testing::Test {
 protected:
  std::vector<std::string> asking(const std::string& sql, const std::string& time_s = "600") const {
    return {"sql", sql, "--server", server_.client_url(), "--timeout", time_s, "--format", "csv"};
  }
  void attack(const std::string& sql, const std::string& time_s = "600") {
    attackers_.emplace_back(folder_, client_program(), asking(sql, time_s));
  }
  void expect_answers() {
    for (int i = 0; i < 3; ++i) {
      const Outcome outcome = run_oblique(folder_, asking("SELECT 1 AS one"));
      EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_EQ(outcome.out, "one\n1\n");
      EXPECT_EQ(run_oblique(folder_, {"status", "--server", server_.client_url()}).exit_code, 0);
    }
  }
  void wait_for_readers(std::size_t count) {
    wait_until("queries run", [&] { return children_of(server_.process().pid()).size() >= count; });
  }

  TemporaryFolder folder_;
  Server server_{folder_, folder_.file("a.db")};
  std::deque<Process> attackers_;
};

TEST_F(QueryAttackTest, QuickQueriesWaitForSlowOnesUntilTheirDeadline) {
  for (int i = 0; i < 6; ++i) {
    attack(kUninterruptible, "2");
  }
  wait_for_readers(4);
  expect_answers();
  for (Process& attacker : attackers_) {
    EXPECT_EQ(attacker.wait(), 1);
    EXPECT_NE(attacker.err().find("2 s"), std::string::npos) << attacker.err();
  }
}

TEST_F(QueryAttackTest, ReadersEndWithAKilledServer) {
  attack(kUninterruptible);
  wait_for_readers(1);
  const auto readers = children_of(server_.process().pid());
  server_.process().send(SIGKILL);
  server_.process().wait();
  for (const pid_t reader : readers) {
    wait_until("the end of a reader", [&] { return !is_running(reader); });
  }
}

}  // namespace
}  // namespace oblique::test
