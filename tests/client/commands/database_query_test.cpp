// Runs `oblique query` on a database file.
#include <algorithm>
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

/// A folder whose oblique.db contains four results of the study `a`.
class DatabaseQuery : public testing::Test {
 protected:
  DatabaseQuery() {
    server::Store store((folder_.path() / "oblique.db").string());
    test::add_study(store, "a", 4, 4);
  }
  test::Outcome run_command(const std::vector<std::string>& arguments) {
    return test::run_oblique(folder_, arguments);
  }

  test::TemporaryFolder folder_;
};

TEST_F(DatabaseQuery, TheCommandOfAPagerMayBeginWithBlanksAndAssignments) {
  const auto lines_with = [this](const std::string& pager) {
    const std::string command =
        test::client_program() +
        " sql 'WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 100) "
        "SELECT i FROM n'";
    test::Process shown(folder_, "/usr/bin/script", {"-qec", command, "/dev/null"},
                        {{"PAGER", pager}, {"TERM", "xterm"}});
    EXPECT_EQ(shown.wait(), 0) << shown.err();
    const std::string out = shown.out();
    return std::count(out.begin(), out.end(), '\n');
  };
  for (const std::string pager : {" head -n 1 ", "LESS=-S head -n 1", "LESS='-R -S' head -n 1"}) {
    EXPECT_EQ(lines_with(pager), 1) << pager;
  }
  for (const std::string pager : {" ", "LESS=-S", "no-such-pager"}) {
    EXPECT_GT(lines_with(pager), 100) << pager;
  }
}

TEST_F(DatabaseQuery, AStatementHasATimeLimit) {
  const auto outcome = run_command(
      {"sql",
       "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT max(i) FROM n",
       "--timeout", "0.2"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("took more than 0.2 s"));
}

TEST_F(DatabaseQuery, TheTimeLimitAlsoEndsASingleFunctionThatTakesHours) {
  const std::string hours = "instr(hex(zeroblob(5000000)), hex(zeroblob(2500000)) || '1') > 5";
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"sql", "SELECT " + hours}, {"query", "a", "--where", hours}}) {
    auto arguments = words;
    arguments.insert(arguments.end(), {"--timeout", "0.2"});
    const auto outcome = run_command(arguments);
    EXPECT_EQ(outcome.exit_code, 1) << words[0];
    EXPECT_THAT(outcome.err, HasSubstr("took more than 0.2 s")) << words[0];
  }
}

TEST_F(DatabaseQuery, AStatementHasAMemoryLimit) {
  EXPECT_THAT(run_command({"sql", "SELECT hex(zeroblob(450000000))"}).err,
              HasSubstr("exceeds the allowed 64 MiB"));
  const auto outcome =
      run_command({"sql",
                   "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 5000) "
                   "SELECT b FROM (SELECT hex(zeroblob(500000)) || i AS b FROM n) ORDER BY b"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("more memory than the 1024 MiB allowed"));
}

TEST_F(DatabaseQuery, ABackupOfADamagedFileNamesTheFaultsAndExitsWith1) {
  EXPECT_EQ(run_command({"backup", "sound.db"}).exit_code, 0);
  const std::string file = (folder_.path() / "oblique.db").string();
  server::execute(server::open_database(file, SQLITE_OPEN_READWRITE).get(),
                  "UPDATE results SET mu = 2 WHERE point = 1; UPDATE models SET E = 1");
  const auto copied = run_command({"backup", "copy.db"});
  EXPECT_EQ(copied.exit_code, 1);
  EXPECT_THAT(copied.err, testing::AllOf(HasSubstr("point 1: its row was changed"),
                                         HasSubstr("and so is its copy")));
  const auto saved = run_command({"backup", "saved.db", "--salvage"});
  EXPECT_EQ(saved.exit_code, 1);
  EXPECT_THAT(saved.err, HasSubstr("called \"damaged study 1\" now"));
}

TEST_F(DatabaseQuery, AFileWhoseViewWasChangedIsRefusedByName) {
  const std::string file = (folder_.path() / "oblique.db").string();
  server::execute(server::open_database(file, SQLITE_OPEN_READWRITE).get(),
                  "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET"
                  " sql = replace(sql, 'm.E AS', 'm.A AS') WHERE name = 'runs'");
  for (const std::vector<std::string>& words : {std::vector<std::string>{"query", "a"},
                                                {"sql", "SELECT E_Pa FROM runs"},
                                                {"status"},
                                                {"check"},
                                                {"backup", "copy.db"},
                                                {"merge", "oblique.db", "--db", "all.db"},
                                                {"describe", "a"},
                                                {"doctor"}}) {
    const auto outcome = run_command(words);
    EXPECT_EQ(outcome.exit_code, 1) << words[0];
    EXPECT_THAT(outcome.out + outcome.err, HasSubstr("the view runs is missing or was changed"))
        << words[0];
  }
}

TEST_F(DatabaseQuery, AWrongStatementIsWrongUsage) {
  const struct {
    std::vector<std::string> words;
    const char* expected;
  } wrong[] = {
      {{"query", "a", "--where", "E > 1e10"}, "write e, or E_Pa"},
      {{"query", "a", "--where", "fn_peak > 1"}, "did you mean `fn_peak_N`"},
      {{"query", "a", "--where", "point >= 0 --", "--limit", "1"}, "it has a comment (--)"},
      {{"sql", "DELETE FROM runs"}, "only reading is allowed"},
      {{"sql", "SELECT * FROM runs WHERE mu > @mu"}, "parameter"},
  };
  for (const auto& [words, expected] : wrong) {
    const auto outcome = run_command(words);
    EXPECT_EQ(outcome.exit_code, 2) << expected;
    EXPECT_EQ(outcome.out, "") << expected;
    EXPECT_THAT(outcome.err, HasSubstr(expected));
  }
}

TEST_F(DatabaseQuery, AModeThatNoPointHasIsReported) {
  const auto unknown = run_command({"query", "a", "--where", "mu < 2 AND major_mode = 'SC SR SR'"});
  EXPECT_EQ(unknown.exit_code, 0) << unknown.err;
  EXPECT_THAT(unknown.err, testing::AllOf(HasSubstr("no point of a meets the condition"),
                                          HasSubstr("'SC SR sR sC sR'")));
  const auto known = run_command({"sql", "SELECT mode FROM runs LIMIT 1", "--format", "csv"}).out;
  const auto mode = known.substr(5, known.find('\n', 5) - 5);
  EXPECT_EQ(run_command({"query", "a", "--where", "mode == '" + mode + "'", "--format", "csv"}).err,
            "");
}

TEST_F(DatabaseQuery, TheFormatOfAnOutputFileFollowsFromItsExtension) {
  EXPECT_EQ(
      run_command({"query", "a", "--select", "point", "--limit", "1", "--out", "x.csv"}).exit_code,
      0);
  std::ifstream file(folder_.path() / "x.csv");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "point\n0\n");
  EXPECT_THAT(run_command({"sql", "SELECT 1", "--out", "x.txt"}).err,
              HasSubstr("end the name in .csv"));
  EXPECT_THAT(run_command({"query", "a", "--select", "point", "--out", "/dev/stdout"}).out,
              testing::StartsWith("point\n"));
}

}  // namespace
}  // namespace oblique::client
