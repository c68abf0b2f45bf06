// Questions to a database file, by the program itself.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/store/store.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"
#include "tests/support/stored_study.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Compares for hours without a look at the clock.
constexpr const char* kDeaf = "SELECT instr(zeroblob(60000000), zeroblob(29999999) || x'01')";

/// A folder with oblique.db, which has four results of the study `a`.
class DatabaseQuery : public testing::Test {
 protected:
  DatabaseQuery() {
    server::Store store((folder_.path() / "oblique.db").string());
    test::add_study(store, "a", 4, 4);
  }
  test::Outcome ask(const std::vector<std::string>& arguments) {
    return test::run_oblique(folder_, arguments);
  }

  test::TemporaryFolder folder_;
};

TEST_F(DatabaseQuery, AStatementHasItsTimeWhateverItDoes) {
  for (const char* sql :
       {kDeaf,
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT max(i) FROM n"}) {
    const auto outcome = ask({"sql", sql, "--timeout", "0.2"});
    EXPECT_EQ(outcome.exit_code, 1) << sql;
    EXPECT_EQ(outcome.out, "") << sql;
    EXPECT_THAT(outcome.err, HasSubstr("took too long (more than 0.2 s)")) << sql;
    EXPECT_TRUE(outcome.err.starts_with("oblique")) << outcome.err;
  }
}

TEST_F(DatabaseQuery, ASignalEndsAStatementThatNeverLooksAtTheClock) {
  test::Process program(folder_, test::client_program(), {"sql", kDeaf});
  const auto threads = "/proc/" + std::to_string(program.pid()) + "/task";
  test::wait_until("the thread that watches the time of the statement", [&] {
    return std::distance(std::filesystem::directory_iterator(threads), {}) > 1;
  });
  kill(program.pid(), SIGINT);
  EXPECT_THAT(program.outcome().exit_code, testing::AnyOf(-SIGINT, 130));
}

TEST_F(DatabaseQuery, AStatementThatNeedsMuchMemoryFailsAndSaysSo) {
  EXPECT_THAT(ask({"sql", "SELECT hex(zeroblob(450000000))"}).err,
              HasSubstr("more than the 64 MiB allowed"));
  const auto outcome =
      ask({"sql",
           "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 5000) "
           "SELECT b FROM (SELECT hex(zeroblob(500000)) || i AS b FROM n) ORDER BY b"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("more memory than the 1024 MiB allowed"));
}

TEST_F(DatabaseQuery, ANameInTheWrongCaseIsRefusedWithTheRightOne) {
  const auto outcome = ask({"query", "a", "--where", "E > 1e10"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("write e, or E_Pa"));
  EXPECT_EQ(ask({"query", "a", "--where", "E_Pa > 1e10"}).exit_code, 0);
  EXPECT_EQ(ask({"query", "a", "--select", "max(mu) AS MU", "--order", "MU"}).exit_code, 0);
  EXPECT_EQ(ask({"query", "a", "--select", "Mu"}).exit_code, 2);
  EXPECT_EQ(ask({"query", "a", "--order", "POINT DESC"}).exit_code, 2);
}

TEST_F(DatabaseQuery, AModeThatNoPointHasIsSaid) {
  const auto unknown = ask({"query", "a", "--where", "mu < 2 AND major_mode = 'SC SR SR'"});
  EXPECT_EQ(unknown.exit_code, 0) << unknown.err;
  EXPECT_THAT(unknown.err, testing::AllOf(HasSubstr("no point of a has major_mode = 'SC SR SR'"),
                                          HasSubstr("'SC SR sR sC sR'")));
  const auto known = ask({"sql", "SELECT mode FROM runs LIMIT 1", "--format", "csv"}).out;
  const auto mode = known.substr(5, known.find('\n', 5) - 5);
  EXPECT_EQ(ask({"query", "a", "--where", "mode == '" + mode + "'", "--format", "csv"}).err, "");
}

TEST_F(DatabaseQuery, ATableWithModesSaysWhatTheirLettersMean) {
  const std::string letters = "\n(S stick, s slip; C compression, R restitution)\n";
  EXPECT_THAT(ask({"query", "a"}).out, testing::EndsWith(letters));
  EXPECT_THAT(ask({"sql", "SELECT mode FROM runs"}).out, testing::EndsWith(letters));
  EXPECT_THAT(ask({"query", "a", "--select", "mu"}).out, Not(HasSubstr("S stick")));
  EXPECT_THAT(ask({"query", "a", "--format", "csv"}).out, Not(HasSubstr("S stick")));
}

TEST_F(DatabaseQuery, SqlSaysThatItOnlyReads) {
  for (const char* change :
       {"DELETE FROM runs", "UPDATE studies SET name = 'b'", "DROP TABLE models"}) {
    const auto outcome = ask({"sql", change});
    EXPECT_EQ(outcome.exit_code, 2) << change;
    EXPECT_THAT(outcome.err, HasSubstr("this only reads")) << change;
  }
}

TEST_F(DatabaseQuery, CheckTakesItsFileWithTheFlagAndWithoutIt) {
  EXPECT_THAT(ask({"check", "oblique.db"}).err, HasSubstr("oblique.db is sound"));
  EXPECT_EQ(ask({"check", "oblique.db"}).err, ask({"check", "--db", "oblique.db"}).err);
  EXPECT_THAT(ask({"check", "other.db"}).err, HasSubstr("other.db"));
}

TEST_F(DatabaseQuery, AConditionCannotCutOffOrderAndLimit) {
  const auto outcome = ask({"query", "a", "--where", "point >= 0 --", "--limit", "1"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("it has a comment (--)"));
  EXPECT_EQ(ask({"query", "a", "--where", "point = 1 OR 1", "--select", "point", "--order",
                 "point DESC", "--limit", "2", "--format", "csv"})
                .out,
            "point\n3\n2\n");
}

TEST_F(DatabaseQuery, AParameterHasNoValueAndIsRefused) {
  for (const char* sql : {"SELECT ?", "SELECT :mu", "SELECT * FROM runs WHERE mu > @mu"}) {
    const auto outcome = ask({"sql", sql});
    EXPECT_NE(outcome.exit_code, 0) << sql;
    EXPECT_THAT(outcome.err, HasSubstr("parameter")) << sql;
  }
}

TEST_F(DatabaseQuery, AFileIsOfTheFormatThatItsNameSays) {
  EXPECT_EQ(ask({"query", "a", "--select", "point", "--limit", "1", "--out", "x.csv"}).exit_code,
            0);
  std::ifstream file(folder_.path() / "x.csv");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "point\n0\n");
  for (const char* verb : {"query", "sql"}) {
    const auto wrong = ask({verb, "a", "--out", "x.json", "--format", "csv"});
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_THAT(wrong.err, HasSubstr("contradict each other"));
    EXPECT_THAT(ask({verb, "a", "--out", "x.txt"}).err, HasSubstr("end its name in .csv"));
  }
  EXPECT_THAT(ask({"query", "a", "--select", "point", "--out", "/dev/stdout"}).out,
              testing::StartsWith("point\n"));
}

TEST_F(DatabaseQuery, ColumnsOfOneNameHaveKeysOfTheirOwnInJson) {
  EXPECT_EQ(ask({"sql", "SELECT 1 AS a, 2 AS a", "--format", "json"}).out,
            "[\n{\"a\":1,\"a_2\":2}\n]\n");
}

}  // namespace
}  // namespace oblique::client
