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

TEST(StudyCheck, SaysPointsBlocksModelsFallsTimeAndSize) {
  const auto outcome =
      test::run_oblique({"study", "check", kExampleStudies + "sticking.toml", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
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
  EXPECT_GT(block["first"]["mu"], 0.25) << "the first that is left in";
  EXPECT_GT(json["time_s"], 0.0);
  EXPECT_GT(json["solved_points"], 0);
  EXPECT_GT(json["bytes"], 0.0);
}

TEST(StudyCheck, ShowsTheFirstAndTheLastPointThatItsFilterLeavesIn) {
  const auto outcome =
      test::run_oblique({"study", "check", "--json", "--no-rate", "--H", "0.9", "--mu", "0.1:1:10",
                         "--e", "1", "--where", "(mu - 0.45)^2 < 0.03"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto block = nlohmann::json::parse(outcome.out)["blocks"][0];
  EXPECT_EQ(block["points"], 4);
  EXPECT_EQ(block["first"]["point"], 2);
  EXPECT_DOUBLE_EQ(block["first"]["mu"], 0.3);
  EXPECT_EQ(block["last"]["point"], 5);
  EXPECT_DOUBLE_EQ(block["last"]["mu"], 0.6);
}

// 3 lengths x 5 areas are 15 fingers that fall alike for two values of mu.
TEST(StudyCheck, CountsModelsAndTheFallsThatTheyShare) {
  const auto check = [](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"study", "check", "--json", "--no-rate",
                                       "--H",   "0.9",   "--e",    "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto outcome = test::run_oblique(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const auto fingers = check(
      {"--mu", "0.4,1.2", "--A", "4e-4:6e-4:5", "--length3", "0.35,0.4,0.45", "--I", "A^2/(4*pi)"});
  EXPECT_EQ(fingers["points"], 30);
  EXPECT_EQ(fingers["models"], 15);
  EXPECT_EQ(fingers["falls"], 15);
  EXPECT_FALSE(fingers.contains("time_s"));
  EXPECT_EQ(check({"--mu", "0.4", "--k", "1e7:4e7:4"})["falls"], 1) << "k acts in contact alone";
}

// A study in which each point has its model takes 600 bytes more for each.
TEST(StudyCheck, KnowsFallsAndSizeOfManyModels) {
  const auto check = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"study", "check", "--json", "--no-rate"});
    arguments.insert(arguments.end(), {"--H", "0.9", "--mu", "0.4", "--e", "1"});
    const auto outcome = test::run_oblique(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const auto stiff = check({"--sample", "sobol:40000:1", "--k", "1e7:1e8", "--eta2", "1:2"});
  EXPECT_EQ(stiff["models"], 40000);
  EXPECT_EQ(stiff["falls"], 1) << "k and eta2 act in contact alone";
  EXPECT_EQ(stiff["falls_estimated"], false);
  EXPECT_EQ(stiff["bytes"], 40000 * (970 + 600));
  const auto thick = check({"--sample", "sobol:40000:1", "--k", "1e7:1e8", "--A", "4e-4:6e-4"});
  EXPECT_EQ(thick["falls"], 40000) << "every area falls in its own way";
  EXPECT_EQ(thick["falls_estimated"], false);
  const auto some =
      check({"--sample", "random:40000:1", "--k", "1e7:1e8", "--A", "4e-4,5e-4,6e-4"});
  EXPECT_EQ(some["falls"], 3);
  const auto product =
      check({"--k", "1e7:1e8:30000", "--A", "4e-4:6e-4:5", "--tolerance", "1e-5,1e-4"});
  EXPECT_EQ(product["falls"], 5);
  EXPECT_EQ(product["falls_estimated"], false);
  const auto many = check({"--sample", "sobol:400000:1", "--A", "4e-4:6e-4"});
  EXPECT_EQ(many["falls"], 400000) << "no more than points";
  EXPECT_EQ(many["falls_estimated"], true);
}

TEST(StudyCheck, ShowsTheValuesOfTheAxesAlsoWhereOneOverridesAnother) {
  const auto outcome =
      test::run_oblique({"study", "check", "--json", "--no-rate", "--length", "0.4,0.5",
                         "--length1", "0.3", "--H", "0.9", "--mu", "1", "--e", "0.9"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto block = nlohmann::json::parse(outcome.out)["blocks"][0];
  EXPECT_EQ(block["first"]["length"], 0.4);
  EXPECT_EQ(block["last"]["length"], 0.5);
  EXPECT_EQ(block["last"]["length1"], 0.3);
  EXPECT_EQ(block["last"]["H"], 0.9);
}

TEST(StudyCheck, TimesFallsOfTheStudysOwnMeshAndForErrorsOfHalfOfIt) {
  const auto timed = [](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"study", "check", "--json",     "--preset", "paper",
                                       "--H",   "1",     "--mu",       "0.4",      "--e",
                                       "1",     "--E",   "6e10:8e10:3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto outcome = test::run_oblique(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const auto plain = timed({});
  EXPECT_EQ(plain["solved_falls"], 3);
  EXPECT_GT(plain["time_s"], 0.0);
  EXPECT_EQ(timed({"--errors"})["solved_falls"], 6);
}

TEST(StudyCheck, NotesUnitsAndListsThatAreNotWhatWasMeant) {
  const auto outcome =
      test::run_oblique({"study", "check", "--no-rate", "--sample", "lhs:10:1", "--E", "70", "--H",
                         "0.9", "--mu", "0.1:1:5", "--e", "1"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("Note: E = 70 Pa is softer than rubber; 7e10?\n"));
  EXPECT_THAT(outcome.err, HasSubstr("Note: mu: 5 values; 0.1:1 draws between them.\n"));
  const test::TemporaryFolder folder;
  for (const std::string verb : {"solve", "run"}) {
    const auto solved = test::run_oblique(
        folder, {verb, "--preset", "paper", "--rho", "2.7", "--H", "0.9", "--mu", "1", "--e", "1"});
    EXPECT_EQ(solved.exit_code, 0) << solved.err;
    EXPECT_THAT(solved.err, HasSubstr("Note: rho = 2.7 kg/m^3 is lighter than cork; 2700?\n"));
  }
}

TEST(StudyCheck, OfAThousandMillionPointsCostsNoMoreThanOfAFew) {
  const auto outcome =
      test::run_oblique({"study", "check", "--no-rate", "--sample", "sobol:1000000000:1", "--H",
                         "0.3:1.1", "--mu", "normal(0.4,0.05,0,)", "--e", "0.9"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("points  1,000,000,000\n"));
  EXPECT_THAT(outcome.out, HasSubstr("sobol sample of H, mu, e"));
  EXPECT_THAT(outcome.out, HasSubstr("size    about 970 GB"));
}

TEST(StudyCheck, EndsWithTwoAndThePlaceForWhatIsWrong) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "wrong.toml")
      << "[[block]]\nH = 1\nmu = 0.4\ne = 1\nwhere = \"mu > f\"\n";
  const auto file = test::run_oblique(folder, {"study", "check", "wrong.toml"});
  EXPECT_EQ(file.exit_code, 2);
  EXPECT_THAT(file.err, HasSubstr("wrong.toml:5:9: where = \"mu > f\": unknown key `f`"));
  const auto flags = test::run_oblique(
      {"study", "check", "--H", "1", "--mu", "0.4", "--e", "1", "--where", "mu > 1"});
  EXPECT_EQ(flags.exit_code, 2);
  EXPECT_THAT(flags.err, HasSubstr("leaves no point in"));
  EXPECT_THAT(flags.err, HasSubstr("--where mu > 1: it leaves no point in"));
  EXPECT_THAT(test::run_oblique({"study"}).err,
              HasSubstr("a command is required; there are check"));
  // The same mistake is wrong usage for every verb.
  for (const auto& verb : std::vector<std::vector<std::string>>{{"study", "check"}, {"run"}}) {
    auto arguments = verb;
    arguments.insert(arguments.end(), {"--H", "0.5+mu", "--mu", "0.4,0.6,0.8", "--e", "1"});
    const auto outcome = test::run_oblique(folder, arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("--H 0.5+mu: point 2: H = "));
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "oblique.db"));
  EXPECT_EQ(test::run_oblique({"study"}).exit_code, 2);
  EXPECT_EQ(test::run_oblique({"study", "chekc"}).exit_code, 2);
}

}  // namespace
}  // namespace oblique::client
