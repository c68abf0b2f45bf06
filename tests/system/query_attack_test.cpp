// Statements that would fill the memory or the disk, or run for hours, asked of a real server.
#include <csignal>
#include <deque>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::test {
namespace {

/// Compares for hours without a look at the clock.
constexpr const char* kDeaf = "SELECT instr(zeroblob(16000000), zeroblob(7999999) || x'01')";

const std::vector<std::string> kHungry{
    "SELECT zeroblob(1000000000)", "SELECT hex(zeroblob(450000000))",
    "SELECT printf('%.*c', 900000000, 'x')",
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 5000) "
    "SELECT b FROM (SELECT hex(zeroblob(500000)) || i AS b FROM n) ORDER BY b"};

/// The most memory that a process ever had [KiB].
long peak_memory_KiB(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  std::string word;
  while (status >> word && word != "VmHWM:") {
  }
  long peak = 0;
  status >> peak;
  return peak;
}

class QueryAttackTest : public testing::Test {
 protected:
  QueryAttackTest() { std::filesystem::create_directory(folder_.file("temporary")); }

  std::vector<std::string> asking(const std::string& sql, const std::string& time_s = "600") const {
    return {"sql", sql, "--server", server_.client_url(), "--timeout", time_s, "--format", "csv"};
  }
  void attack(const std::string& sql, const std::string& time_s = "600") {
    attackers_.emplace_back(folder_, client_program(), asking(sql, time_s));
  }
  void expect_answers() {
    for (int i = 0; i < 3; ++i) {
      const Outcome asked = run_oblique(folder_, asking("SELECT 1 AS one"));
      EXPECT_EQ(asked.exit_code, 0) << asked.err;
      EXPECT_EQ(asked.out, "one\n1\n");
      EXPECT_EQ(run_oblique(folder_, {"status", "--server", server_.client_url()}).exit_code, 0);
    }
  }
  void wait_for_readers(std::size_t count) {
    wait_until("queries run", [&] { return children_of(server_.process().pid()).size() >= count; });
  }

  TemporaryFolder folder_;
  Server server_{folder_, folder_.file("a.db"), {{"SQLITE_TMPDIR", folder_.file("temporary")}}};
  std::deque<Process> attackers_;
};

TEST_F(QueryAttackTest, AnswersOfGigabytesFailAndTheServerLivesOnWithLittleMemory) {
  for (int i = 0; i < 10; ++i) {
    attack(kHungry[static_cast<std::size_t>(i) % kHungry.size()]);
  }
  expect_answers();
  for (std::size_t i = 0; i < 10; ++i) {
    const int exit_code = attackers_[i].wait();
    // To SQLite's printf a text over the limit is NULL.
    if (i % kHungry.size() == 2) {
      EXPECT_EQ(exit_code, 0) << attackers_[i].err();
    } else {
      EXPECT_EQ(exit_code, 1);
      EXPECT_NE(attackers_[i].err().find("MiB allowed"), std::string::npos) << attackers_[i].err();
    }
  }
  // A single one of these answers had more than three times that.
  EXPECT_LT(peak_memory_KiB(server_.process().pid()), 256 * 1024);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.file("temporary")));
}

TEST_F(QueryAttackTest, QuickQuestionsWaitForMoreSlowOnesThanThereAreReadersUntilTheirDeadline) {
  for (int i = 0; i < 6; ++i) {
    attack(kDeaf, "2");
  }
  wait_for_readers(4);
  expect_answers();
  for (Process& attacker : attackers_) {
    EXPECT_EQ(attacker.wait(), 1);
    EXPECT_NE(attacker.err().find("2 s"), std::string::npos) << attacker.err();
  }
}

TEST_F(QueryAttackTest, AStoppedServerLeavesNoReaderBehind) {
  for (int i = 0; i < 3; ++i) {
    attack(kDeaf);
  }
  wait_for_readers(3);
  const auto readers = children_of(server_.process().pid());
  server_.process().send(SIGTERM);
  EXPECT_EQ(server_.process().wait(), 0);
  for (const pid_t reader : readers) {
    EXPECT_FALSE(is_running(reader));
  }
  for (Process& attacker : attackers_) {
    EXPECT_EQ(attacker.wait(), 1);
    EXPECT_NE(attacker.err().find("stopping"), std::string::npos) << attacker.err();
  }
}

TEST_F(QueryAttackTest, AKilledServerTakesItsReadersAlong) {
  attack(kDeaf);
  wait_for_readers(1);
  const auto readers = children_of(server_.process().pid());
  server_.process().send(SIGKILL);
  server_.process().wait();
  for (const pid_t reader : readers) {
    wait_until("the end of a reader", [&] { return !is_running(reader); });
  }
}

TEST_F(QueryAttackTest, AClientThatIsKilledTakesItsQueryAlong) {
  attack(kDeaf);
  wait_for_readers(1);
  const pid_t reader = children_of(server_.process().pid()).at(0);
  attackers_[0].send(SIGKILL);
  wait_until("the end of the query", [&] { return !is_running(reader); });
}

}  // namespace
}  // namespace oblique::test
