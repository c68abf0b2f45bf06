#include <cstddef>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/explore/written_file.h"
#include "tests/support/programs.h"
#include "tests/support/temporary_folder.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// Runs `oblique sensitivity` over mu and e in a folder, on the preset `paper`.
test::Outcome sensitivity(const test::TemporaryFolder& folder,
                          const std::vector<std::string>& flags) {
  std::vector<std::string> words{"sensitivity", "--H", "0.9",   "--mu",     "0.1:1.8", "--e",
                                 "0.5:1",       "--k", "2.7e7", "--preset", "paper"};
  words.insert(words.end(), flags.begin(), flags.end());
  return test::run_oblique(folder, words);
}

nlohmann::json json_of(const test::Outcome& outcome) {
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return nlohmann::json::parse(outcome.out, nullptr, false);
}

TEST(Sensitivity, GrowsUntilTheIntervalsAreNarrowEnough) {
  const test::TemporaryFolder folder;
  const auto json = json_of(sensitivity(
      folder, {"--rows", "32", "--interval", "0.15", "--of", "fn_peak_N", "--format", "json"}));
  EXPECT_EQ(json["method"], "sobol");
  EXPECT_EQ(json["inputs"], (std::vector<std::string>{"mu", "e"}));
  ASSERT_EQ(json["rows"].size(), 2U);
  for (const auto& row : json["rows"]) {
    EXPECT_EQ(row["output"], "fn_peak_N");
    EXPECT_GT(row["rows"], 32) << "one round of so few rows cannot be enough";
    EXPECT_EQ(json["points"], 4 * row["rows"].get<int>());
    EXPECT_EQ(row["dropped"], 0);
    for (const std::string measure : {"first", "total"}) {
      const double value = row[measure];
      const double from = row[measure + "_from"];
      const double to = row[measure + "_to"];
      EXPECT_LE(from, value);
      EXPECT_GE(to, value);
      EXPECT_LE(to - from, 0.3);
      EXPECT_GT(value, -0.2);
      EXPECT_LT(value, 1.2);
    }
  }
}

TEST(Sensitivity, ContinuesWhatIsStoredAndOtherOutputsCostNoPoint) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> flags{"--rows", "16", "--interval", "9", "--format", "csv"};
  const auto first = sensitivity(folder, flags);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, StartsWith("output,input,first,first_from,first_to,total,total_from,"
                                    "total_to,rows,dropped\nfn_peak_N,mu,"));
  const auto again = sensitivity(folder, flags);
  EXPECT_EQ(again.out, first.out) << "the same to the bit";
  auto other = flags;
  other.insert(other.end(),
               {"--of", "stick_total_s > 0,max(mu, e)", "--out", folder.file("stick.json")});
  const auto stick = sensitivity(folder, other);
  EXPECT_THAT(stick.out, HasSubstr("\nstick_total_s > 0,e,"));
  EXPECT_THAT(stick.err, HasSubstr("64 of 64 points are done"));
  EXPECT_EQ(nlohmann::json::parse(text_in_file(folder.file("stick.json")))["points"], 64);
}

TEST(Sensitivity, RowsWithFailedPointsAreLeftOutAndCounted) {
  const test::TemporaryFolder folder;
  // Some points fail, because the tip turns back after a fall of about 1.18 m.
  const auto outcome = test::run_oblique(
      folder,
      {"sensitivity", "--H",         "0.9:1.19", "--mu",       "0.4",        "--e",      "0.5:1",
       "--k",         "2.7e7:2.8e7", "--length", "0.3999,0.4", "--preset",   "paper",    "--rows",
       "64",          "--interval",  "9",        "--of",       "duration_s", "--format", "json"});
  const auto json = json_of(outcome);
  EXPECT_EQ(json["inputs"], (std::vector<std::string>{"length", "k", "H", "e"}));
  const auto& row = json["rows"][0];
  EXPECT_GT(row["dropped"], 0);
  EXPECT_EQ(row["rows"].get<int>() + row["dropped"].get<int>(), 64);
}

TEST(Sensitivity, NotesThatFallsTakeMostOfTheTime) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> flags{"--rows", "16", "--interval", "9", "--E"};
  auto drawn = flags;
  drawn.emplace_back("6e10:8e10");
  const auto falls = sensitivity(folder, drawn).err;
  EXPECT_THAT(falls, HasSubstr("falls take most of the time, 32 for the 80 points"));
  EXPECT_THAT(falls, HasSubstr("give other keys levels"));
  EXPECT_THAT(sensitivity(folder, {"--rows", "256", "--interval", "9", "--E", "6e10:8e10:4"}).err,
              testing::Not(HasSubstr("falls")));
}

TEST(Sensitivity, MorrisScreensInputsAndDrawsThem) {
  const test::TemporaryFolder folder;
  const auto outcome = sensitivity(
      folder, {"--method", "morris", "--rows", "8", "--out", folder.file("bars.gp"), "--quiet"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("output"));
  EXPECT_THAT(outcome.out, HasSubstr("mu: their mean"));
  const auto script = text_in_file(folder.file("bars.gp"));
  EXPECT_THAT(script, HasSubstr("mu_star"));
  EXPECT_THAT(script, HasSubstr("duration_s"));
  EXPECT_THAT(script, HasSubstr("with xerrorbars"));
}

TEST(Sensitivity, MorrisMeasuresALinearOutputAlikeOnARangeAndOnLevels) {
  const test::TemporaryFolder folder;
  for (const std::string H :
       {"0.8:1", "0.8,1", "1,0.8", "0.8,0.83,1", "0.8:1:4", "0.8:1:5", "0.8:1:11:log"}) {
    const auto json = json_of(test::run_oblique(
        folder, {"sensitivity", "--method", "morris", "--preset", "paper", "--H", H, "--mu",
                 "0.1:0.4", "--e", "1", "--of", "H", "--rows", "16", "--format", "json"}));
    EXPECT_NEAR(json["rows"][0]["mu_star"].get<double>(), 0.2, 1e-12) << H;
    EXPECT_NEAR(json["rows"][0]["sigma"].get<double>(), 0.0, 1e-12) << H;
    EXPECT_EQ(json["rows"][1]["mu_star"], 0.0) << H;
  }
}

TEST(Sensitivity, NotesOutputsThatShowNoEffectAndWhy) {
  const test::TemporaryFolder folder;
  for (const std::string method : {"sobol", "morris"}) {
    const auto noted = [&](const std::string& of) {
      std::vector<std::string> words{"sensitivity", "--preset", "paper",  "--H",      "1",
                                     "--mu",        "0.05:0.1", "--e",    "0.5:1",    "--rows",
                                     "4",           "--of",     of,       "--method", method,
                                     "--format",    "json",     "--quiet"};
      if (method == "sobol") {
        words.insert(words.end(), {"--interval", "9"});
      }
      const auto outcome = test::run_oblique(folder, words);
      EXPECT_EQ(outcome.exit_code, 0) << of << outcome.err;
      return nlohmann::json::parse(outcome.out)["notes"].dump();
    };
    EXPECT_THAT(noted("stick_total_s"), HasSubstr("stick_total_s is the same in all 4 rows."));
    EXPECT_THAT(noted("major_mode = 'nonsense'"), HasSubstr("is the same in all 4 rows."));
    EXPECT_THAT(noted("2.5 + 1e-16 * mu"), HasSubstr("is the same in all 4 rows."));
    EXPECT_THAT(noted("duration_s,upper(mode)"),
                HasSubstr("None of the 4 rows has a number of upper(mode)."));
  }
}

TEST(Sensitivity, TablesAndCsvHaveNotesToo) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> flags{"--rows", "4", "--interval", "9", "--of", "mu > 9"};
  EXPECT_THAT(sensitivity(folder, flags).out, HasSubstr("\n\nmu > 9 is the same in all 4 rows.\n"));
  auto csv = flags;
  csv.insert(csv.end(), {"--format", "csv"});
  EXPECT_THAT(sensitivity(folder, csv).err, HasSubstr("Note: mu > 9 is the same in all 4 rows."));
}

TEST(Sensitivity, FailsWithTheFirstErrorIfNoRowIsLeft) {
  const test::TemporaryFolder folder;
  const auto failed =
      test::run_oblique(folder, {"sensitivity", "--preset", "paper", "--H", "1e-9:2e-9", "--mu",
                                 "0.4:0.5", "--e", "1", "--rows", "4", "--quiet"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_EQ(failed.out, "");
  EXPECT_THAT(failed.err, HasSubstr("None of the 4 rows has a number of duration_s."));
  EXPECT_THAT(failed.err, HasSubstr(" Point 0 failed: "));
  const auto texts = sensitivity(folder, {"--rows", "4", "--of", "upper(mode)"});
  EXPECT_EQ(texts.exit_code, 1);
  EXPECT_THAT(texts.err, HasSubstr("A text needs a condition, such as mode = 'sC sR'."));
}

TEST(Sensitivity, NotesThatMostRowsAreDropped) {
  const test::TemporaryFolder folder;
  const auto json =
      json_of(sensitivity(folder, {"--rows", "32", "--interval", "9", "--of",
                                   "CASE WHEN mu < 1 THEN e END", "--format", "json"}));
  ASSERT_GT(json["rows"][0]["dropped"], json["rows"][0]["rows"]);
  EXPECT_THAT(json["notes"].dump(), HasSubstr("END has a value in only "));
}

TEST(Sensitivity, WrongFlagsAreRefusedBeforeAnythingIsSolved) {
  const test::TemporaryFolder folder;
  const auto objection = [&folder](const std::vector<std::string>& flags) {
    const auto outcome = sensitivity(folder, flags);
    EXPECT_EQ(outcome.exit_code, 2);
    return outcome.err;
  };
  EXPECT_THAT(objection({"--of", "fn_peek_N"}), HasSubstr("did you mean `fn_peak_N`?"));
  EXPECT_THAT(objection({"--of", "stick_totl_s > 0"}), HasSubstr("did you mean `stick_total_s`?"));
  EXPECT_THAT(objection({"--method", "sobel"}), HasSubstr("sobol"));
  EXPECT_THAT(objection({"--interval", "0"}), HasSubstr("--interval"));
  EXPECT_THAT(objection({"--method", "morris", "--interval", "0.1"}), HasSubstr("--interval"));
  EXPECT_THAT(objection({"--rows", "1000000000000"}), HasSubstr("--rows"));
  EXPECT_THAT(objection({"--out", "bars.xyz"}), HasSubstr("--out"));
  EXPECT_THAT(objection({"--where", "mu > 1"}), HasSubstr("--where"));
  const auto constant =
      test::run_oblique(folder, {"sensitivity", "--H", "1", "--mu", "0.4", "--e", "1"});
  EXPECT_THAT(constant.err, HasSubstr("no value is drawn"));
}

}  // namespace
}  // namespace oblique::client
