// Tests that run `oblique map`.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/amount.h"
#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;

std::vector<std::string> map_words(const std::vector<std::string>& more = {}) {
  std::vector<std::string> words{"map",      "--x",   "mu=0.05:2", "--y", "H=0.3:1.05", "--e", "1",
                                 "--preset", "paper", "--cells",   "8",   "--bracket",  "1e-4"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::string file_text(const std::string& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string solved_mode(const solver::Finger& finger, double mu, double H_m) {
  const solver::Point point{H_m, mu, 1.0};
  const auto outcome = solver::solve_points(finger, {&point, 1}).front();
  return outcome.result ? outcome.result->major_mode : "failed";
}

TEST(MapCommand, SaysThatThereIsNoBorderOrNoValueAndWhy) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> words{"map",     "--e", "1",         "--preset", "paper",
                                       "--cells", "2",   "--bracket", "0.1",      "--quiet"};
  const auto map = [&](std::vector<std::string> more) {
    more.insert(more.begin(), words.begin(), words.end());
    return test::run_oblique(folder, more);
  };
  const auto slips = map(
      {"--x", "mu=0.05:0.1", "--y", "H=0.9:1", "--of", "stick_total_s=0", "--over", "upper(mode)"});
  EXPECT_EQ(slips.exit_code, 0) << slips.err;
  EXPECT_THAT(slips.out, HasSubstr("No border was found: all points are in the region "));
  EXPECT_THAT(slips.out, HasSubstr("No point of the grid has a number of upper(mode)."));
  const auto failed = map({"--x", "mu=0.4:0.5", "--y", "H=1e-9:2e-9"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.err, HasSubstr("no point of the grid has a value of major_mode. Point 0"));
}

TEST(MapCommand, BothSidesOfEveryVertexSolvedAnewHaveTheNamedModes) {
  const auto ran = test::run_oblique(map_words({"--format", "json"}));
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const auto map = nlohmann::json::parse(ran.out);
  EXPECT_EQ(map["x"], "mu");
  EXPECT_EQ(map["y"], "H");
  ASSERT_GT(map["vertices"].size(), 50U);
  const auto model = solver::preset("paper");
  const solver::Finger finger(model);
  for (const auto& vertex : map["vertices"]) {
    const bool is_along_x = vertex["along"] == "x";
    const double width = vertex["width"];
    EXPECT_LE(width, 1e-4 * (is_along_x ? 1.95 : 0.75) * (1.0 + 1e-9));
    for (const double side : {-0.5, 0.5}) {
      const double mu = vertex["x"].get<double>() + (is_along_x ? side * width : 0.0);
      const double H_m = vertex["y"].get<double>() + (is_along_x ? 0.0 : side * width);
      ASSERT_EQ(vertex[side < 0.0 ? "from" : "to"], solved_mode(finger, mu, H_m)) << vertex;
    }
  }
}

TEST(MapCommand, JsonAndCsvHaveTheSameVerticesAndAPictureIsBesideTheTable) {
  const test::TemporaryFolder folder;
  const auto ran = test::run_oblique(folder, map_words({"--out", "map.gp", "--over", "fn_peak_N"}));
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  for (const auto& file : {"map.json", "map.csv"}) {
    ASSERT_EQ(
        test::run_oblique(folder, map_words({"--out", file, "--over", "fn_peak_N"})).exit_code, 0);
  }
  EXPECT_THAT(ran.out, HasSubstr("smaller than a cell, 0.244 in mu by 0.0938 in H, may be missed"));
  const auto map = nlohmann::json::parse(file_text(folder.file("map.json")));
  // The table lists the six regions with at least 0.25 % of the area.
  EXPECT_THAT(ran.out, HasSubstr(std::to_string(map["regions"].size() - 6) + " other regions"));
  const auto csv = file_text(folder.file("map.csv"));
  EXPECT_TRUE(csv.starts_with("x,y,from,to,width,along\n")) << csv.substr(0, 100);
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')),
            map["vertices"].size() + 1);
  EXPECT_THAT(file_text(folder.file("map.gp")), HasSubstr("borders of major"));
  double cells = 0.0;
  for (const auto& region : map["regions"]) {
    cells += region["cells"].get<double>();
  }
  EXPECT_NEAR(cells, 64.0, 1e-6);
  EXPECT_EQ(map["shifts"].size(), map["curves"].size());
}

TEST(MapCommand, EndedAtRandomInstantsItContinuesToTheSameMapToTheBit) {
  const test::TemporaryFolder whole;
  const auto undisturbed = test::run_oblique(whole, map_words({"--format", "json"}));
  ASSERT_EQ(undisturbed.exit_code, 0) << undisturbed.err;
  const double points = test::Database(whole.file("oblique.db")).rows();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> part;
  std::vector<double> kills(static_cast<std::size_t>(test::amount(2, 10)));
  std::generate(kills.begin(), kills.end(), [&] { return part(random) * points; });
  std::sort(kills.begin(), kills.end());
  const test::TemporaryFolder folder;
  const test::Database database(folder.file("oblique.db"));
  for (const double rows : kills) {
    test::Process map(folder, test::client_program(), map_words({"--format", "json"}));
    test::wait_until("the map has so many points",
                     [&] { return database.rows() >= rows || map.exit_code(); });
    const auto children = test::children_of(map.pid());
    map.send(SIGKILL);
    map.wait();
    test::wait_until("server and workers end", [&] {
      return std::none_of(children.begin(), children.end(), test::is_running);
    });
  }
  const auto continued = test::run_oblique(folder, map_words({"--format", "json"}));
  ASSERT_EQ(continued.exit_code, 0) << continued.err;
  EXPECT_EQ(continued.out, undisturbed.out);
  EXPECT_EQ(database.rows(), points);
}

TEST(MapCommand, TakesModelAndSingleValuesOfAStudyAndLevelsOfAnOutput) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(test::run_oblique(folder, {"run", "--H", "1", "--mu", "0.1,0.2", "--e", "0.8",
                                       "--preset", "paper", "--name", "base"})
                .exit_code,
            0);
  const std::vector<std::string> words{"map",     "base",    "--x",       "mu=0.1:2",
                                       "--y",     "e=0.5:1", "--of",      "stick_total_s=0",
                                       "--cells", "4",       "--bracket", "1e-2"};
  const auto ran = test::run_oblique(folder, words);
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("stick_total_s > 0"));
  EXPECT_THAT(ran.out, HasSubstr("stick_total_s <= 0"));
  const test::Database database(folder.file("oblique.db"));
  // The map also solves points on a finer mesh, which is the second model.
  EXPECT_EQ(database.numbers("SELECT count(DISTINCT model_id) FROM results").front(), 2.0);
  EXPECT_EQ(database.numbers("SELECT count(DISTINCT H) FROM results").front(), 1.0);
  const auto varying = test::run_oblique(folder, {"map", "base", "--x", "e=0.5:1", "--y", "H=0.5:1",
                                                  "--cells", "4", "--bracket", "1e-2"});
  EXPECT_EQ(varying.exit_code, 2);
  EXPECT_THAT(varying.err, HasSubstr("several values of mu: give one with --mu"));
}

TEST(MapCommand, ReportsWrongInputBeforeItSolvesAnything) {
  const test::TemporaryFolder folder;
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong{
      {{"--of", "colour"}, "--of: unknown output `colour`"},
      {{"--of", "major_modes=3"}, "unknown output `major_modes`"},
      {{"--of", "fn_peak_N"}, "COLUMN=LEVEL"},
      {{"--of", "fn_peak_N>=5000"},
       "--of fn_peak_N>=5000: write mode, major_mode, or COLUMN=LEVEL"},
      {{"--of", "fn_peak_N>=5000=1"}, "COLUMN=LEVEL"},
      {{"--of", "mode=SC"}, "COLUMN=LEVEL"},
      {{"--of", "fn_peek_N + 1 = 5"}, "did you mean `fn_peak_N`?"},
      {{"--over", "fn_peek_N / 2"}, "--over \"(fn_peek_N / 2)\" is not allowed"},
      {{"--over", "mode"}, "--over: the values of mode are texts"},
      {{"--over", "fn_peak_N,ft_peak_N"}, "a picture shows one output"},
      {{"--elements-per-link", "200"}, "--elements-per-link 200 is too many"},
      {{"--out", "map.doc"}, "map.doc"},
      {{"--mu", "0.4"}, "mu is an axis of the map"},
      {{"--k", "1e7,2e7"}, "--k has several values"}};
  for (const auto& [words, message] : wrong) {
    const auto ran = test::run_oblique(folder, map_words(words));
    EXPECT_EQ(ran.exit_code, 2) << ran.out;
    EXPECT_THAT(ran.err, HasSubstr(message));
  }
  for (const auto& [x, message] : std::vector<std::pair<std::string, std::string>>{
           {"mu", "must be KEY=FROM:TO"},
           {"mu=2:1", "mu"},
           {"wind=0:1", "wind"},
           {"mu=0:1:5", "must be KEY=FROM:TO"},
           {"mu=0.5:0.5", "the ends must differ by more"},
           {"mu=1:1.0000000001", "the ends must differ by more"},
           {"links=1:3", "links must be a whole number"},
           {"H=0.3:1", "--x and --y are both H"}}) {
    const auto ran = test::run_oblique(folder, {"map", "--x", x, "--y", "H=0.3:1", "--e", "1"});
    EXPECT_EQ(ran.exit_code, 2) << ran.out;
    EXPECT_THAT(ran.err, HasSubstr(message));
  }
  const auto large = test::run_oblique(folder, {"map", "--x", "mu=0:1", "--y", "H=0.3:1", "--e",
                                                "1", "--cells", "512", "--bracket", "1e-8"});
  EXPECT_EQ(large.exit_code, 2) << large.out;
  EXPECT_THAT(large.err, HasSubstr("--cells 512 --bracket 1e-08: a map may need 20 MiB"));
  EXPECT_FALSE(std::filesystem::exists(folder.file("oblique.db")));
}

}  // namespace
}  // namespace oblique::client
