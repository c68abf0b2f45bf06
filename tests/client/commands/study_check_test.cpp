#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/programs.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;

const std::string kExampleStudies = std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/";

/// Returns the output of `study check --json` with these arguments.
nlohmann::json checked(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"study", "check", "--json"});
  const auto outcome = test::run_oblique(arguments);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return nlohmann::json::parse(outcome.out, nullptr, false);
}

TEST(StudyCheck, PrintsPointsBlocksModelsFallsTimeAndSize) {
  const auto json = checked({kExampleStudies + "sticking.toml"});
  EXPECT_EQ(json["study"], "sticking");
  EXPECT_EQ(json["points"], 615);
  EXPECT_EQ(json["numbers"], 1650);
  EXPECT_EQ(json["models"], 1);
  EXPECT_EQ(json["falls"], 1);
  ASSERT_EQ(json["blocks"].size(), 1U);
  const auto& block = json["blocks"][0];
  EXPECT_EQ(block["points"], 615);
  EXPECT_EQ(block["last"]["point"], 1649);
  EXPECT_EQ(block["last"]["mu"], 2.0);
  EXPECT_GT(block["first"]["mu"], 0.25) << "`first` is the first point that the filter keeps";
  EXPECT_GT(json["time_s"], 0.0);
  EXPECT_GT(json["solved_points"], 0);
  EXPECT_GT(json["bytes"], 0.0);
}

TEST(StudyCheck, ShowsTheFirstAndTheLastPointThatTheFilterKeeps) {
  const auto json = checked({"--no-rate", "--H", "0.9", "--mu", "0.1:1:10", "--e", "1", "--where",
                             "(mu - 0.45)^2 < 0.03"});
  EXPECT_FALSE(json.contains("time_s"));
  const auto& block = json["blocks"][0];
  EXPECT_EQ(block["points"], 4);
  EXPECT_EQ(block["first"]["point"], 2);
  EXPECT_DOUBLE_EQ(block["first"]["mu"], 0.3);
  EXPECT_EQ(block["last"]["point"], 5);
  EXPECT_DOUBLE_EQ(block["last"]["mu"], 0.6);
}

TEST(StudyCheck, ShowsTheValuesOfAllAxesIfOneOverridesAnother) {
  const auto block = checked({"--no-rate", "--length", "0.4,0.5", "--length1", "0.3", "--H", "0.9",
                              "--mu", "1", "--e", "0.9"})["blocks"][0];
  EXPECT_EQ(block["first"]["length"], 0.4);
  EXPECT_EQ(block["last"]["length"], 0.5);
  EXPECT_EQ(block["last"]["length1"], 0.3);
  EXPECT_EQ(block["last"]["H"], 0.9);
}

TEST(StudyCheck, MeasuresFallsOnTheMeshOfTheStudyAndForErrorsAlsoOnHalfOfIt) {
  const std::vector<std::string> study{"--preset", "paper", "--H", "1",   "--mu",
                                       "0.4",      "--e",   "1",   "--E", "6e10:8e10:3"};
  const auto plain = checked(study);
  EXPECT_EQ(plain["solved_falls"], 3);
  EXPECT_GT(plain["time_s"], 0.0);
  auto with_errors = study;
  with_errors.emplace_back("--errors");
  EXPECT_EQ(checked(with_errors)["solved_falls"], 6);
}

TEST(StudyCheck, TakesNoLongerForABillionPoints) {
  const auto outcome =
      test::run_oblique({"study", "check", "--no-rate", "--sample", "sobol:1000000000:1", "--H",
                         "0.3:1.1", "--mu", "normal(0.4,0.05,0,)", "--e", "0.9"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("points  1,000,000,000\n"));
  EXPECT_THAT(outcome.out, HasSubstr("sobol sample of H, mu, e"));
  EXPECT_THAT(outcome.out, HasSubstr("size    about 970 GB"));
}

TEST(StudyCheck, ExitsWithTwoAndNamesThePlaceOfAnError) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "wrong.toml")
      << "[[block]]\nH = 1\nmu = 0.4\ne = 1\nwhere = \"mu > f\"\n";
  const auto file = test::run_oblique(folder, {"study", "check", "wrong.toml"});
  EXPECT_EQ(file.exit_code, 2);
  EXPECT_THAT(file.err, HasSubstr("wrong.toml:5:9: where = \"mu > f\": unknown key `f`"));
  const auto flags = test::run_oblique(
      {"study", "check", "--H", "1", "--mu", "0.4", "--e", "1", "--where", "mu > 1"});
  EXPECT_EQ(flags.exit_code, 2);
  EXPECT_THAT(flags.err, HasSubstr("--where mu > 1: it leaves out all points"));
  EXPECT_THAT(test::run_oblique({"study"}).err,
              HasSubstr("a command is required; the commands are check"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "oblique.db"));
  EXPECT_EQ(test::run_oblique({"study", "chekc"}).exit_code, 2);
}

}  // namespace
}  // namespace oblique::client
