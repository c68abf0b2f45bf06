#include <map>
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

/// A folder with a study of 200 random points.
class Uncertainty : public ::testing::Test {
 protected:
  Uncertainty() { run("random:200", "spread"); }

  void run(const std::string& sample, const std::string& name) const {
    const auto outcome = test::run_oblique(
        folder_, {"run", "--H", "0.9", "--mu", "0.1:1.8", "--e", "normal(0.8,0.02,0.7,0.9)",
                  "--preset", "paper", "--sample", sample, "--name", name, "--quiet"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  }

  test::Outcome uncertainty(std::vector<std::string> words) const {
    words.insert(words.begin(), "uncertainty");
    return test::run_oblique(folder_, words);
  }

  test::TemporaryFolder folder_;
};

TEST_F(Uncertainty, StatisticsOfAnInputAreThoseOfItsDistribution) {
  const auto outcome = uncertainty({"spread", "--of", "e", "--format", "json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["sample"], "random");
  EXPECT_EQ(json["points"], 200);
  EXPECT_EQ(json["inputs"], (std::vector<std::string>{"mu", "e"}));
  std::map<std::string, nlohmann::json> of;
  for (const auto& row : json["rows"]) {
    of[row["statistic"]] = row;
  }
  EXPECT_NEAR(of["mean"]["value"], 0.8, 0.006);  // four times 0.02/sqrt(200)
  EXPECT_NEAR(of["mean"]["half"], 0.8, 0.008);
  EXPECT_NEAR(of["sd"]["value"], 0.02, 0.004);
  EXPECT_NEAR(of["quantile 0.5"]["value"], 0.8, 0.007);
  EXPECT_LT(of["quantile 0.5"]["value_from"], of["quantile 0.5"]["value"]);
  EXPECT_DOUBLE_EQ(of["correlation e"]["value"], 1.0);
  EXPECT_NEAR(of["correlation mu"]["value"], 0.0, 0.3);
}

TEST_F(Uncertainty, NotesOutputsWithoutValuesOrWithOne) {
  const auto json = nlohmann::json::parse(
      uncertainty({"spread", "--of", "fn_peak_N,H,2.5 + 1e-16 * mu,CASE WHEN mu < 0.2 THEN e END",
                   "--format", "json"})
          .out);
  const auto notes = json["notes"].dump();
  EXPECT_THAT(notes, HasSubstr("H is the same in all 200 rows."));
  EXPECT_THAT(notes, HasSubstr("END has a value in only "));
  EXPECT_THAT(notes, HasSubstr("2.5 + 1e-16 * mu is the same in all 200 rows."));
  const auto none = uncertainty({"spread", "--of", "mu + NULL"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("None of the 200 rows has a number of"));
}

TEST_F(Uncertainty, ModesHaveProbabilitiesThatAddUpToOne) {
  const auto outcome = uncertainty({"spread", "--of", "major_mode", "--format", "json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  double sum = 0.0;
  for (const auto& row : json["rows"]) {
    const double value = row["value"];
    sum += value;
    EXPECT_LE(row["value_from"], value);
    EXPECT_GE(row["value_to"], value);
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
}

TEST_F(Uncertainty, TablesShowStatisticsCorrelationsAndConvergence) {
  const auto outcome = uncertainty({"spread", "--out", folder_.file("spread.gp")});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("output"));
  for (const char* part :
       {"quantile 0.05", "correlation mu", "probability sC sR", "95 %", "quarter"}) {
    EXPECT_THAT(outcome.out, HasSubstr(part));
  }
  const auto script = text_in_file(folder_.file("spread.gp"));
  EXPECT_THAT(script, HasSubstr("95 % quantile"));
  EXPECT_THAT(script, HasSubstr("with boxxyerror"));
}

TEST_F(Uncertainty, AStudyThatIsNoSampleAndWrongQuantilesAreRefused) {
  const auto grid =
      test::run_oblique(folder_, {"run", "--H", "0.9", "--mu", "0.1,0.2", "--e", "0.8", "--preset",
                                  "paper", "--name", "grid", "--quiet"});
  ASSERT_EQ(grid.exit_code, 0) << grid.err;
  const auto outcome = uncertainty({"grid"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--sample"));
  EXPECT_EQ(uncertainty({"spread", "--quantiles", "5"}).exit_code, 2);
  EXPECT_EQ(uncertainty({"nothing"}).exit_code, 1);
  EXPECT_EQ(uncertainty({"spread", "--where", "mu > 9"}).exit_code, 1);
}

}  // namespace
}  // namespace oblique::client
