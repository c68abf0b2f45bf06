#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/query/reader.h"
#include "tests/support/programs.h"

namespace oblique::client {
namespace {

// So long that a signal meets it at work.
void write_study(const test::TemporaryFolder& folder, int points) {
  std::ofstream(folder.path() / "study.toml")
      << "name = 'many'\n[model]\npreset = 'paper'\n[[block]]\nH = 1\nmu = { from = 0.1, to = 2, "
         "count = "
      << points << " }\ne = 0.9\n";
}

// Waits for something that must come; the test's own time limit is what ends a wait in vain.
void wait_for(const std::function<bool()>& condition) {
  while (!condition()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

std::uint64_t solved(const test::TemporaryFolder& folder) {
  try {
    server::Reader reader((folder.path() / "oblique.db").string());
    const auto studies = reader.study_status();
    return studies.empty() ? 0 : studies.front().solved();
  } catch (const std::exception&) {
    return 0;  // not made yet
  }
}

// Started, with results coming in.
void wait_until_at_work(const test::TemporaryFolder& folder, const test::Process& program) {
  wait_for([&] { return solved(folder) > 0; });
  ASSERT_EQ(test::children_of(program.pid()).size(), 3U);
}

void expect_gone(const std::vector<pid_t>& processes) {
  for (const pid_t pid : processes) {
    EXPECT_EQ(kill(pid, 0), -1) << pid << " is still there";
  }
}

std::vector<std::string> run_arguments() {
  return {"run", "study.toml", "--workers", "2"};
}

TEST(Run, SolvesAStudyAndItsResultsAreThereForEveryVerbThatReads) {
  const test::TemporaryFolder folder;
  const auto paper = std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/paper.toml";
  const auto run = test::run_oblique(folder, {"run", paper});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("5057.6"), std::string::npos) << run.out;
  EXPECT_NE(run.err.find("10 of 10 points"), std::string::npos) << run.err;

  const auto query =
      test::run_oblique(folder, {"query", "paper", "--where", "mu > 1", "--select", "mu,fn_peak_N",
                                 "--order", "mu DESC", "--format", "json"});
  ASSERT_EQ(query.exit_code, 0) << query.err;
  const auto rows = nlohmann::json::parse(query.out);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0]["mu"], 1.6);

  const auto sql =
      test::run_oblique(folder, {"sql", "SELECT count(*) AS n FROM peaks", "--format", "csv"});
  EXPECT_EQ(sql.exit_code, 0) << sql.err;
  EXPECT_TRUE(sql.out.starts_with("n\n")) << sql.out;

  const auto status = test::run_oblique(folder, {"status", "paper"});
  EXPECT_NE(status.out.find("done"), std::string::npos) << status.out << status.err;
  EXPECT_NE(test::run_oblique(folder, {"studies"}).out.find("paper"), std::string::npos);
  EXPECT_EQ(test::run_oblique(folder, {"watch", "paper"}).exit_code, 0);

  const auto compared = test::run_oblique(folder, {"paper", "--db", "oblique.db"});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_NE(compared.out.find("63 trustworthy published numbers: rms"), std::string::npos);
}

TEST(Run, WithErrorsGivesThemToEveryPointAndWithoutToNone) {
  const test::TemporaryFolder folder;
  std::vector<std::string> arguments{"run",  "--preset", "paper", "--H", "0.9,1",
                                     "--mu", "0.4",      "--e",   "1"};
  for (const char* one : {"--elements-per-link", "2", "--name", "without"}) {
    arguments.emplace_back(one);
  }
  EXPECT_EQ(test::run_oblique(folder, arguments).exit_code, 0);
  arguments.back() = "with";
  arguments.emplace_back("--errors");
  EXPECT_EQ(test::run_oblique(folder, arguments).exit_code, 0);
  const auto sql = test::run_oblique(
      folder, {"sql",
               "SELECT study, count(*), count(mode_same), count(fn_peak_error), count(v_out_error)"
               " FROM runs GROUP BY study ORDER BY study",
               "--format", "csv"});
  EXPECT_NE(sql.out.find("with,2,2,2,2\nwithout,2,0,0,0\n"), std::string::npos) << sql.out;
  EXPECT_EQ(test::run_oblique(folder, {"check"}).exit_code, 0);
  // The same name with another choice is another study.
  arguments.pop_back();
  const auto refused = test::run_oblique(folder, arguments);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("errors: stored true, given false"), std::string::npos) << refused.err;
}

TEST(Run, OfAStudyThatIsDoneShowsItsResultsAgain) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> arguments{"run",  "--preset", "paper", "--H", "1",
                                           "--mu", "0.4",      "--e",   "1"};
  const auto first = test::run_oblique(folder, arguments);
  const auto second = test::run_oblique(folder, arguments);
  EXPECT_EQ(second.exit_code, 0) << second.err;
  EXPECT_EQ(first.out, second.out);
  EXPECT_NE(second.err.find("1 of 1 points are done"), std::string::npos) << second.err;
}

TEST(Queries, ThatAreWrongSayWhatIsWrong) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(test::run_oblique(folder, {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e",
                                       "1", "--name", "one"})
                .exit_code,
            0);
  const auto column = test::run_oblique(folder, {"query", "one", "--where", "fn_peak > 1"});
  EXPECT_EQ(column.exit_code, 2);
  EXPECT_NE(column.err.find("did you mean `fn_peak_N`"), std::string::npos) << column.err;
  const auto study = test::run_oblique(folder, {"query", "two"});
  EXPECT_EQ(study.exit_code, 1);
  EXPECT_NE(study.err.find("two"), std::string::npos) << study.err;
  const auto writes = test::run_oblique(folder, {"sql", "DELETE FROM results"});
  EXPECT_EQ(writes.exit_code, 2);
  EXPECT_EQ(solved(folder), 1U);
}

TEST(Run, OfAnotherStudyUnderATakenNameIsRefused) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(test::run_oblique(folder, {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e",
                                       "1", "--name", "one"})
                .exit_code,
            0);
  const auto other = test::run_oblique(
      folder, {"run", "--preset", "paper", "--H", "1", "--mu", "0.5", "--e", "1", "--name", "one"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.err.find("one"), std::string::npos) << other.err;
}

TEST(Run, NoticesThatTheServerDied) {
  const test::TemporaryFolder folder;
  write_study(folder, 10'000'000);
  test::Process program(folder, test::client_program(), run_arguments());
  wait_until_at_work(folder, program);
  const auto processes = test::children_of(program.pid());
  kill(processes.front(), SIGKILL);
  const auto outcome = program.outcome();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("the server was killed by signal 9"), std::string::npos)
      << outcome.err;
  expect_gone(processes);
}

/// What a run of a long study says to which its user gives that order from another shell.
test::Outcome ordered_run(const test::TemporaryFolder& folder, const std::string& order) {
  write_study(folder, 10'000'000);
  auto arguments = run_arguments();
  arguments.push_back("--verbose");
  test::Process program(folder, test::client_program(), arguments);
  wait_until_at_work(folder, program);
  // The server's log says where it awaits clients, and where the keys of this run are.
  const auto said = program.err();
  const auto word_after = [&said](const std::string& words) {
    const auto rest = said.substr(said.find(words) + words.size());
    return rest.substr(0, rest.find_first_of(",;\n"));
  };
  const std::filesystem::path keys = word_after("admits the 3 keys of ");
  const std::string url = word_after("clients at ");
  EXPECT_EQ(test::run_oblique(folder, {order, "many", "--server", url}).exit_code, 1)
      << "others on this machine have no key";
  const auto ordered = test::run_oblique(folder, {order, "many", "--server", url, "--keys",
                                                  (keys.parent_path() / "client.key").string()});
  EXPECT_EQ(ordered.exit_code, 0) << ordered.err;
  auto outcome = program.outcome();
  EXPECT_FALSE(std::filesystem::exists(keys.parent_path())) << "the keys go with the run";
  return outcome;
}

TEST(Run, OfAStudyThatSomebodyCancelsSaysSoAndEndsWithOne) {
  const test::TemporaryFolder folder;
  const auto outcome = ordered_run(folder, "cancel");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_NE(outcome.err.find("The study is cancelled"), std::string::npos) << outcome.err;
}

TEST(Run, OfAStudyThatSomebodyPausesSaysHowToGoOnAndEndsWithOne) {
  const test::TemporaryFolder folder;
  const auto outcome = ordered_run(folder, "pause");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(
      outcome.err.find("somebody has paused \"many\": the same command again goes on with it"),
      std::string::npos)
      << outcome.err;
  EXPECT_NE(test::run_oblique(folder, {"status"}).out.find("paused"), std::string::npos);
  const auto before = solved(folder);
  test::Process again(folder, test::client_program(), run_arguments());
  wait_for([&] { return solved(folder) > before; });
}

TEST(Watch, OfAFileOnWhichNobodyWorksSaysSo) {
  const test::TemporaryFolder folder;
  write_study(folder, 10'000'000);
  {
    test::Process program(folder, test::client_program(), run_arguments());
    wait_until_at_work(folder, program);
    kill(program.pid(), SIGINT);
    EXPECT_EQ(program.outcome().exit_code, 128 + SIGINT);
  }
  const auto status = test::run_oblique(folder, {"status"});
  EXPECT_NE(status.out.find("nobody is at work on oblique.db"), std::string::npos) << status.out;
  test::Process watch(folder, test::client_program(), {"watch", "many"});
  wait_for([&] {
    return watch.err().find("waits for a server: nobody is at work on oblique.db") !=
           std::string::npos;
  });
  kill(watch.pid(), SIGINT);
  EXPECT_EQ(watch.outcome().exit_code, 128 + SIGINT);
}

TEST(Run, SolvesItsStudyAloneAndNamesTheOthersThatAreUnfinished) {
  const test::TemporaryFolder folder;
  write_study(folder, 10'000'000);
  {
    test::Process program(folder, test::client_program(), run_arguments());
    wait_until_at_work(folder, program);
    kill(program.pid(), SIGINT);
    EXPECT_EQ(program.outcome().exit_code, 128 + SIGINT);
  }
  const auto before = solved(folder);
  const auto other = test::run_oblique(
      folder, {"run", "--H", "1", "--mu", "0.1:2:200", "--e", "0.9", "--name", "other"});
  EXPECT_EQ(other.exit_code, 0) << other.err;
  EXPECT_EQ(solved(folder), before);
  EXPECT_NE(other.err.find("Also unfinished in oblique.db: many (9,9"), std::string::npos)
      << other.err;
  EXPECT_NE(test::run_oblique(folder, {"status", "many"}).out.find("running"), std::string::npos)
      << "nothing is paused in the database";
}

TEST(Run, GoesOnWithTheWorkersThatAreLeftAndStopsWhenNoneIs) {
  const test::TemporaryFolder folder;
  write_study(folder, 10'000'000);
  test::Process program(folder, test::client_program(), run_arguments());
  wait_until_at_work(folder, program);
  const auto processes = test::children_of(program.pid());
  kill(processes.at(1), SIGKILL);
  wait_for([&] { return program.err().find("a worker (process ") != std::string::npos; });
  EXPECT_EQ(kill(program.pid(), 0), 0);
  kill(processes.at(2), SIGKILL);
  const auto outcome = program.outcome();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("no worker is left"), std::string::npos) << outcome.err;
  expect_gone(processes);
}

TEST(Run, SharesTheMemoryForFallsAmongItsWorkers) {
  const test::TemporaryFolder folder;
  write_study(folder, 10'000'000);
  auto arguments = run_arguments();
  arguments.insert(arguments.end(), {"--fall-memory", "100000000"});
  test::Process program(folder, test::client_program(), arguments);
  wait_until_at_work(folder, program);
  const pid_t worker = test::children_of(program.pid()).at(1);
  std::ifstream words("/proc/" + std::to_string(worker) + "/cmdline");
  for (std::string word; word != "--fall-memory";) {
    ASSERT_TRUE(std::getline(words, word, '\0'));
  }
  std::string bytes;
  std::getline(words, bytes, '\0');
  EXPECT_EQ(bytes, "50000000");
  kill(program.pid(), SIGINT);
  program.outcome();
}

TEST(Run, SaysWhatTheServerSaidWhenItDoesNotStart) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "oblique.db") << "this is no database, but some text in a file\n";
  const auto outcome = test::run_oblique(
      folder, {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("the server did not start"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("oblique.db"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace oblique::client
