#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/study/study_file.h"
#include "server/query/reader.h"
#include "server/store/store.h"
#include "tests/client/study/fake_reach.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"
#include "tests/support/stored_study.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;

// Writes a study that runs long enough for a signal to arrive before it ends.
void write_study(const test::TemporaryFolder& folder, int points) {
  std::ofstream(folder.path() / "study.toml")
      << "name = 'many'\n[model]\npreset = 'paper'\n[[block]]\nH = 1\nmu = { from = 0.1, to = 2, "
         "count = "
      << points << " }\ne = 0.9\n";
}

// Waits until `condition` holds; the test's time limit ends an endless wait.
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
    return 0;  // not created yet
  }
}

// Waits for the first results, and expects three child processes of the program.
void wait_until_at_work(const test::TemporaryFolder& folder, const test::Process& program) {
  wait_for([&] { return solved(folder) > 0; });
  ASSERT_EQ(test::children_of(program.pid()).size(), 3U);
}

void expect_gone(const std::vector<pid_t>& processes) {
  for (const pid_t pid : processes) {
    EXPECT_EQ(kill(pid, 0), -1) << pid << " is still running";
  }
}

std::vector<std::string> run_arguments() {
  return {"run", "study.toml", "--workers", "2"};
}

TEST(Run, SolvesAStudyWhoseResultsEveryCommandCanRead) {
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
  EXPECT_NE(compared.out.find("63 reliable published numbers: rms"), std::string::npos);
}

TEST(Run, EstimatesErrorsOfAllPointsOrNone) {
  const test::TemporaryFolder folder;
  const auto run = [&folder](const std::vector<std::string>& more) {
    std::vector<std::string> words{"run", "--preset", "paper", "--elements-per-link",
                                   "2",   "--H",      "0.9,1", "--mu",
                                   "0.4", "--e",      "1"};
    words.insert(words.end(), more.begin(), more.end());
    return test::run_oblique(folder, words);
  };
  EXPECT_EQ(run({"--name", "without"}).exit_code, 0);
  EXPECT_EQ(run({"--name", "with", "--errors"}).exit_code, 0);
  const auto sql = test::run_oblique(
      folder, {"sql",
               "SELECT study, count(*), count(mode_same), count(fn_peak_error), count(v_out_error)"
               " FROM runs GROUP BY study ORDER BY study",
               "--format", "csv"});
  EXPECT_THAT(sql.out, HasSubstr("with,2,2,2,2\nwithout,2,0,0,0\n"));
  // A stored study has the same name but another definition.
  const auto refused = run({"--name", "with"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("errors: stored true, given false"));
}

TEST(Run, IfAnotherClientPausesTheStudyNamesTheRemedyAndExitsWithOne) {
  const test::TemporaryFolder folder;
  write_study(folder, 10'000'000);
  auto arguments = run_arguments();
  arguments.push_back("--verbose");
  test::Process program(folder, test::client_program(), arguments);
  wait_until_at_work(folder, program);
  // The log contains the server's address for clients and the folder of the keys.
  const auto output = program.err();
  const auto word_after = [&output](const std::string& words) {
    const auto rest = output.substr(output.find(words) + words.size());
    return rest.substr(0, rest.find_first_of(",;\n"));
  };
  const std::filesystem::path keys = word_after("admits the 3 keys of ");
  const std::vector<std::string> pause{"pause", "many", "--server", word_after("clients at ")};
  EXPECT_EQ(test::run_oblique(folder, pause).exit_code, 1) << "a client without a key was accepted";
  auto with_key = pause;
  with_key.insert(with_key.end(), {"--keys", (keys.parent_path() / "client.key").string()});
  const auto paused = test::run_oblique(folder, with_key);
  EXPECT_EQ(paused.exit_code, 0) << paused.err;
  const auto outcome = program.outcome();
  EXPECT_FALSE(std::filesystem::exists(keys.parent_path()))
      << "the keys were not deleted at the end of the run";
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(
      outcome.err,
      HasSubstr("\"many\" was paused by another command: run this command again to continue"));
  const auto before = solved(folder);
  test::Process again(folder, test::client_program(), run_arguments());
  wait_for([&] { return solved(folder) > before; });
}

TEST(Run, SolvesOnlyItsStudyAndDoesNotChangeOthers) {
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
  EXPECT_NE(test::run_oblique(folder, {"status", "many"}).out.find("running"), std::string::npos)
      << "an interrupted run leaves its study running in the database";
}

TEST(Run, ContinuesWithRemainingWorkersAndEndsWithoutWorkersOrServer) {
  for (const bool ends_server : {false, true}) {
    const test::TemporaryFolder folder;
    write_study(folder, 10'000'000);
    test::Process program(folder, test::client_program(), run_arguments());
    wait_until_at_work(folder, program);
    const auto processes = test::children_of(program.pid());
    kill(processes.at(1), SIGKILL);
    wait_for([&] { return program.err().find("a worker (process ") != std::string::npos; });
    EXPECT_EQ(kill(program.pid(), 0), 0);
    kill(processes.at(ends_server ? 0 : 2), SIGKILL);
    const auto outcome = program.outcome();
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_THAT(outcome.err,
                HasSubstr(ends_server ? "the server was killed by signal 9" : "no worker is left"));
    expect_gone(processes);
  }
}

TEST(Run, PrintsTheOutputOfAServerThatDoesNotStart) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "oblique.db") << "this is no database, but some text in a file\n";
  const auto outcome = test::run_oblique(
      folder, {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("the server did not start"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("oblique.db"), std::string::npos) << outcome.err;
}

TEST(Run, WaitsWhileAnotherProgramHasLockedTheDatabaseAndSaysSo) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("oblique.db");
  { const server::Store store(file); }
  const auto other = server::open_database(file, SQLITE_OPEN_READWRITE);
  server::execute(other.get(), "BEGIN IMMEDIATE");
  test::Process run(folder, test::client_program(),
                    {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1"});
  wait_for([&] {
    return run.err().find("another program has locked the database") != std::string::npos;
  });
  server::execute(other.get(), "COMMIT");
  EXPECT_EQ(run.wait(), 0) << run.err();
}

TEST(Run, OfADatabaseThatSqliteFindsDamagedEndsWithTheRemedyAlsoWhenQuiet) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("oblique.db");
  {
    server::Store store(file);
    test::add_study(store, "a", 1000, 1000);
    const server::Change deletion = server::DeleteStudy{1};
    store.commit({&deletion, 1});
    while (store.clear_away(1000) != server::ClearedAway::kAll) {
    }
  }
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary)
      .seekp(35)
      .put('\x01');  // the first free page is page 1 now
  std::ofstream(folder.path() / "study.toml")
      << "name = 'many'\n[model]\npreset = 'paper'\n[[block]]\nH = 1\nmu = { from = 0.1, to = 2, "
         "count = 200 }\ne = 0.9\n";
  const auto outcome = test::run_oblique(folder, {"run", "study.toml", "--quiet"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, testing::AllOf(HasSubstr("malformed"), HasSubstr("--salvage")));
}

constexpr const char* kBegun = R"(name = "begun"
[model]
elements_per_link = 1
[[block]]
H = 0.9
mu = [0.2, 0.4, 0.6]
e = 0.8
)";

TEST(Run, IfTheStudyHasResultsOfAnotherSolverNamesTheRemedies) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "begun.toml") << kBegun;
  {
    const Study study = parse_study(kBegun, "begun.toml", fake_reach());
    const auto table = std::make_shared<const protocol::PointTable>(study.recipe);
    constexpr const char* kThen = "2024-01-01T00:00:00.000Z";
    server::Store((folder.path() / "oblique.db").string())
        .commit(std::vector<server::Change>{
            server::AddStudy{1, study.name, table, kThen},
            server::AddWorker{1, "ann", 1, "0.1", "avx2", kThen},
            server::AddResults{1, table, 1, "0.1", "avx2", 1, kThen, {server::solved_point(0)}}});
  }
  const auto outcome = test::run_oblique(folder, {"run", "begun.toml"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("are of solver 0.1, but the workers here have solver "));
  EXPECT_THAT(outcome.err, HasSubstr("its other 2 points"));
  EXPECT_THAT(outcome.err, HasSubstr("--name begun-"));
  EXPECT_THAT(test::run_oblique(folder, {"status"}).out, HasSubstr("0.1\n"))
      << "`status` shows the solver version of the results";
}

}  // namespace
}  // namespace oblique::client
