// `oblique trace` solves a point again, in its own process or on a worker, and reports errors.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/study/study_file.h"
#include "server/database/sqlite.h"
#include "server/store/store.h"
#include "tests/client/study/fake_reach.h"
#include "tests/support/points.h"
#include "tests/support/programs.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// Two studies whose coarse meshes save time: `models` has two models and error estimates, `steps`
/// has fixed steps.
const std::map<std::string, const char*> kStudies{{"models", R"(name = "models"
errors = true
[model]
elements_per_link = 2
[[block]]
E = [6e10, 7e10]
H = [0.9, 1.0]
mu = [0.2, 2.0]
e = [0.8, 1.0]
)"},
                                                  {"steps", R"(name = "steps"
[model]
integrator = "generalized-alpha"
elements_per_link = 1
[[block]]
H = 0.9
mu = [0.4, 1.2]
e = 0.8
)"}};

class TraceCommand : public testing::Test {
 protected:
  test::Outcome run(const std::vector<std::string>& arguments) {
    return test::run_oblique(folder_, arguments);
  }
  /// Solves the study `name` and stores it in oblique.db.
  void solve_study(const std::string& name) {
    write_file(name);
    const auto outcome = run({"run", name + ".toml"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  /// Stores the study `name` in oblique.db without results.
  void store_study(const std::string& name) {
    write_file(name);
    const Study study = parse_study(kStudies.at(name), name + ".toml", fake_reach());
    const auto table = std::make_shared<const protocol::PointTable>(study.recipe);
    server::Store store((folder_.path() / "oblique.db").string());
    store.commit(std::vector<server::Change>{
        server::AddStudy{1, study.name, table, "2024-01-01T00:00:00.000Z"}});
  }
  std::string text_of(const char* name) {
    std::ifstream file(folder_.path() / name);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  test::TemporaryFolder folder_;

 private:
  void write_file(const std::string& name) {
    std::ofstream(folder_.path() / (name + ".toml")) << kStudies.at(name);
  }
};

TEST_F(TraceCommand, APointSolvedAgainEqualsTheStoredPoint) {
  solve_study("models");
  solve_study("steps");
  for (const auto& [study, point] : {std::pair{"models", "0"}, {"models", "15"}, {"steps", "1"}}) {
    const auto csv = run({"trace", study, point});
    EXPECT_EQ(csv.exit_code, 0) << csv.err;
    EXPECT_THAT(csv.out, StartsWith("t_s,fn_N,ft_N,"));
    EXPECT_THAT(csv.err, HasSubstr("solved here, same as stored.")) << study << ' ' << point;
  }
  const auto json = run({"trace", "models", "15", "--shape", "--out", "trace.json"});
  EXPECT_EQ(json.exit_code, 0) << json.err;
  EXPECT_EQ(json.out, "");
  const auto all = nlohmann::json::parse(std::ifstream(folder_.path() / "trace.json"));
  EXPECT_EQ(all["point"], 15);
  EXPECT_EQ(all["result"]["mu"], 2.0);
  EXPECT_EQ(all["trace"]["t_s"][0], 0.0);
  EXPECT_EQ(all["trace"]["node6y_m"].size(), all["trace"]["state"].size());
}

TEST_F(TraceCommand, UsesTheInputsOfTheStoredRow) {
  solve_study("steps");
  // A worker whose mathematics rounds differently has solved this mu.
  const double solved = std::nextafter(1.2, 2.0);
  const auto database =
      server::open_database((folder_.path() / "oblique.db").string(), SQLITE_OPEN_READWRITE);
  server::execute(database.get(),
                  fmt::format("UPDATE results SET mu = {:.17g} WHERE point = 1", solved));
  const auto json = run({"trace", "steps", "1", "--format", "json"});
  EXPECT_EQ(json.exit_code, 0) << json.err;
  EXPECT_EQ(nlohmann::json::parse(json.out)["result"]["mu"], solved);
}

TEST_F(TraceCommand, WritesTheSameRowsAsSolve) {
  store_study("models");
  const auto trace = run({"trace", "models", "15", "--shape", "--out", "trace.csv"});
  EXPECT_EQ(trace.exit_code, 0) << trace.err;
  EXPECT_THAT(trace.err, HasSubstr("not stored yet"));
  const auto solve = run({"solve", "--E", "7e10", "--H", "1", "--mu", "2", "--e", "1",
                          "--elements-per-link", "2", "--trace-shape", "--trace", "solve.csv"});
  EXPECT_EQ(solve.exit_code, 0) << solve.err;
  EXPECT_THAT(text_of("trace.csv"), StartsWith("t_s,"));
  EXPECT_EQ(text_of("trace.csv"), text_of("solve.csv"));
  EXPECT_EQ(run({"trace", "models", "15", "--shape", "--format", "csv"}).out, text_of("trace.csv"));
  const auto to_output = run({"solve", "--E", "7e10", "--H", "1", "--mu", "2", "--e", "1",
                              "--elements-per-link", "2", "--trace-shape", "--trace", "-"});
  EXPECT_EQ(to_output.out, text_of("trace.csv"));
  EXPECT_THAT(to_output.err, HasSubstr("contact ")) << "the summary is missing";
}

TEST_F(TraceCommand, MissingPointsAndUnwritableFilesAreNamed) {
  store_study("models");
  const auto expect_error = [&](std::vector<std::string> words, int exit_code,
                                const char* sentence) {
    words.insert(words.begin(), "trace");
    const auto outcome = run(words);
    EXPECT_EQ(outcome.exit_code, exit_code) << testing::PrintToString(words) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, HasSubstr(sentence));
  };
  expect_error({"model", "0"}, 1, "no study called \"model\"");
  expect_error({"models", "16"}, 1, "its points are 0 to 15");
  expect_error({"models", "-1"}, 2, "POINT");
  expect_error({"models", "first"}, 2, "POINT");
  expect_error({"models"}, 2, "POINT");
  expect_error({"models", "0", "--out", "/nowhere/x.csv"}, 2, "/nowhere/x.csv");
  expect_error({"models", "0", "--out", "x.jsn"}, 2, "end the name in .csv");
  expect_error({"models", "0", "--on-worker"}, 2, "--on-worker needs a server");
  expect_error({"models", "0", "--local", "--on-worker"}, 2, "--local");
  expect_error({"models", "0", "--every", "0"}, 2, "--every");
}

TEST_F(TraceCommand, ADifferentStoredRowIsReportedWithItsColumns) {
  {
    server::Store store((folder_.path() / "oblique.db").string());
    const auto table = server::table_of(2);
    const std::vector<server::Change> changes{
        server::AddStudy{1, "made-up", table, "2024-01-01T00:00:00.000Z"},
        server::AddWorker{1, "ann", 1, "0.1", "avx2", "2024-01-01T00:00:00.000Z"},
        server::AddResults{1,
                           table,
                           1,
                           "0.1",
                           "avx2",
                           1,
                           "2024-01-01T00:00:00.000Z",
                           {server::solved_point(0), protocol::failed_point(1, "it never ends")}}};
    store.commit(changes);
  }
  const auto outcome = run({"trace", "made-up", "0", "--out", "x.csv"});
  EXPECT_EQ(outcome.exit_code, 0) << "a different stored row is no failure";
  EXPECT_THAT(outcome.err, HasSubstr("differs from the stored row"));
  EXPECT_THAT(outcome.err, HasSubstr("fn_peak_N"));
  EXPECT_THAT(outcome.err, HasSubstr("stored by solver 0.1, now solved by "));

  const auto failed = run({"trace", "made-up", "1", "--out", "failed.csv"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.err, HasSubstr("point 1 of made-up failed and has no trace: it never ends"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "failed.csv"));
}

TEST_F(TraceCommand, AWorkerSolvesAPointOfAServer) {
  solve_study("models");
  const test::Server server(folder_, "oblique.db");
  const auto run_trace = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "trace");
    words.insert(words.end(), {"--server", server.client_url()});
    return run(words);
  };
  const auto nobody = run_trace({"models", "3"});
  EXPECT_EQ(nobody.exit_code, 1);
  EXPECT_THAT(nobody.err, HasSubstr("no worker is connected"));
  const auto here = run_trace({"models", "3", "--local", "--out", "here.csv"});
  EXPECT_EQ(here.exit_code, 0) << here.err;
  EXPECT_THAT(here.err, HasSubstr("solved here, same as stored."));

  const test::Worker worker(folder_, server.worker_url(), {"--threads", "1", "--name", "ann"});
  test::wait_until("the server has a worker", [&] {
    return run({"workers", "--server", server.client_url()}).out.find("ann") != std::string::npos;
  });
  const auto there = run_trace({"models", "3"});
  EXPECT_EQ(there.exit_code, 0) << there.err;
  EXPECT_THAT(there.err, HasSubstr("solved by worker ann ("));
  EXPECT_THAT(there.err, HasSubstr("same as stored."));
  EXPECT_EQ(there.out, text_of("here.csv"));
  for (const char* file : {"fall_here.csv", "fall_there.csv"}) {
    const bool is_here = file == std::string_view("fall_here.csv");
    run_trace(
        {"models", "3", "--shape", "--fall", is_here ? "--local" : "--on-worker", "--out", file});
  }
  EXPECT_THAT(text_of("fall_here.csv"), testing::AllOf(StartsWith("t_s,"), HasSubstr(",falling,")));
  EXPECT_EQ(text_of("fall_there.csv"), text_of("fall_here.csv"));
  // `--every 50` prints every 50th instant, the ends of phases and the last instant.
  const auto thinned = run_trace({"models", "3", "--every", "50"});
  EXPECT_EQ(thinned.out, run_trace({"models", "3", "--every", "50", "--local"}).out);
  const auto lines = [](const std::string& text) { return std::ranges::count(text, '\n'); };
  EXPECT_GT(lines(thinned.out), lines(there.out) / 50);
  EXPECT_LT(lines(thinned.out), lines(there.out) / 5);
  EXPECT_THAT(run_trace({"model", "3"}).err, HasSubstr("no study called \"model\""));
  EXPECT_THAT(run_trace({"models", "16"}).err, HasSubstr("its points are 0 to 15"));

  // A trace succeeds although its worker is killed, because another worker joins.
  std::ofstream(folder_.path() / "fine.toml") << R"(name = "fine"
[model]
elements_per_link = 12
[[block]]
H = 1.0
mu = [0.3, 0.5]
e = 0.9
)";
  run({"submit", "fine.toml", "--server", server.client_url(), "--priority", "-1000"});
  test::Process trace(folder_, test::client_program(),
                      {"trace", "fine", "0", "--server", server.client_url()});
  const test::Worker other(folder_, server.worker_url(), {"--threads", "1", "--name", "bob"});
  worker.send(SIGKILL);
  const auto outcome = trace.outcome();
  EXPECT_EQ(outcome.exit_code, 0) << "another worker should solve the trace: " << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("t_s,"));
}

}  // namespace
}  // namespace oblique::client
