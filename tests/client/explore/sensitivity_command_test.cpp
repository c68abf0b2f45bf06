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
      folder, {"--points", "32", "--interval", "0.15", "--of", "fn_peak_N", "--format", "json"}));
  EXPECT_EQ(json["method"], "sobol");
  EXPECT_EQ(json["inputs"], (std::vector<std::string>{"mu", "e"}));
  const auto rows = json["rows"].get<std::size_t>();
  EXPECT_GT(rows, 32U) << "one round of so few rows cannot be enough";
  EXPECT_EQ(json["points"], 4 * rows);
  EXPECT_EQ(json["failed"], 0);
  const auto& output = json["outputs"][0];
  EXPECT_EQ(output["name"], "fn_peak_N");
  EXPECT_EQ(output["rows"], rows);
  for (const char* measure : {"first", "total"}) {
    for (std::size_t input = 0; input < 2; ++input) {
      const double value = output[measure]["value"][input];
      const double from = output[measure]["from"][input];
      const double to = output[measure]["to"][input];
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
  const std::vector<std::string> flags{"--points", "16", "--interval", "9", "--format", "csv"};
  const auto first = sensitivity(folder, flags);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, StartsWith("output,input,first,first_from,first_to,total,total_from,"
                                    "total_to,rows,dropped\nfn_peak_N,mu,"));
  const auto again = sensitivity(folder, flags);
  EXPECT_EQ(again.out, first.out) << "the same to the bit";
  auto other = flags;
  other.insert(other.end(), {"--of", "stick_total_s > 0"});
  const auto stick = sensitivity(folder, other);
  EXPECT_THAT(stick.out, HasSubstr("\nstick_total_s > 0,e,"));
  EXPECT_THAT(stick.err, HasSubstr("64 of 64 points are done"));
}

TEST(Sensitivity, RowsWithFailedPointsAreLeftOutAndCounted) {
  const test::TemporaryFolder folder;
  // The tip turns back after a drop of about 1.18 m: some points fail.
  const auto outcome = test::run_oblique(
      folder,
      {"sensitivity", "--H",         "0.9:1.19", "--mu",       "0.4",        "--e",      "0.5:1",
       "--k",         "2.7e7:2.8e7", "--length", "0.3999,0.4", "--preset",   "paper",    "--points",
       "64",          "--interval",  "9",        "--of",       "duration_s", "--format", "json"});
  const auto json = json_of(outcome);
  EXPECT_EQ(json["inputs"], (std::vector<std::string>{"length", "k", "H", "e"}));
  EXPECT_GT(json["failed"], 0);
  const auto& output = json["outputs"][0];
  EXPECT_GT(output["dropped"], 0);
  EXPECT_EQ(output["rows"].get<int>() + output["dropped"].get<int>(), 64);
  EXPECT_THAT(outcome.err, testing::Not(HasSubstr("Note: 0 of")));
}

TEST(Sensitivity, InputsThatNeedAFallForEachValueAreNotedWithLevelsThatShareThem) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> flags{"--points", "16", "--interval", "9"};
  auto drawn = flags;
  drawn.insert(drawn.end(), {"--E", "6e10:8e10", "--rho", "normal(2700,20,2600,)"});
  const auto falls = sensitivity(folder, drawn).err;
  EXPECT_THAT(falls, HasSubstr("is 64 falls"));
  EXPECT_THAT(falls, HasSubstr("--E 6.0625e+10:7.9375e+10:16 --rho 2662"));
  auto levels = flags;
  levels.insert(levels.end(), {"--E", "6e10:8e10:4"});
  EXPECT_THAT(sensitivity(folder, levels).err, testing::Not(HasSubstr("falls")));
}

TEST(Sensitivity, MorrisScreensInputsAndDrawsThem) {
  const test::TemporaryFolder folder;
  const auto outcome = sensitivity(
      folder, {"--method", "morris", "--points", "8", "--out", folder.file("bars.gp"), "--quiet"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("fn_peak_N: 8 trajectories\n"));
  const auto script = text_in_file(folder.file("bars.gp"));
  EXPECT_THAT(script, HasSubstr("fn_peak_N: mean of magnitudes"));
  EXPECT_THAT(script, HasSubstr("duration_s: deviation"));
  EXPECT_THAT(script, HasSubstr("with xerrorbars"));
}

TEST(Sensitivity, WrongFlagsAreRefusedBeforeAnythingIsSolved) {
  const test::TemporaryFolder folder;
  const auto objection = [&folder](const std::vector<std::string>& flags) {
    const auto outcome = sensitivity(folder, flags);
    EXPECT_EQ(outcome.exit_code, 2);
    return outcome.err;
  };
  EXPECT_THAT(objection({"--points", "100"}), HasSubstr("take 64 or 128"));
  EXPECT_THAT(objection({"--of", "fn_peek_N"}), HasSubstr("did you mean `fn_peak_N`?"));
  EXPECT_THAT(objection({"--method", "sobel"}), HasSubstr("sobol"));
  EXPECT_THAT(objection({"--interval", "0"}), HasSubstr("--interval"));
  EXPECT_THAT(objection({"--out", "bars.xyz"}), HasSubstr("--out"));
  EXPECT_THAT(objection({"--where", "mu > 1"}), HasSubstr("--where"));
  EXPECT_THAT(objection({"--max-points", "100"}), HasSubstr("2,048"));
  const auto constant =
      test::run_oblique(folder, {"sensitivity", "--H", "1", "--mu", "0.4", "--e", "1"});
  EXPECT_THAT(constant.err, HasSubstr("no value is drawn"));
}

}  // namespace
}  // namespace oblique::client
