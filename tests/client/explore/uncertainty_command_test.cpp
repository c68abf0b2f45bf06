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
using testing::Not;
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
  const auto outcome = uncertainty({"spread", "--of", "e,mu > 0.95", "--format", "json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["sample"], "random");
  EXPECT_EQ(json["points"], 200);
  EXPECT_EQ(json["inputs"], (std::vector<std::string>{"mu", "e"}));
  const auto& e = json["outputs"][0];
  EXPECT_EQ(e["points"], (std::vector<int>{25, 50, 100, 200}));
  const auto& of = e["statistics"];
  EXPECT_NEAR(of["mean"]["value"][3], 0.8, 0.006);  // four times 0.02/sqrt(200)
  EXPECT_NEAR(of["sd"]["value"][3], 0.02, 0.004);
  EXPECT_NEAR(of["quantile 0.5"]["value"][3], 0.8, 0.007);
  EXPECT_LT(of["quantile 0.5"]["from"][3], of["quantile 0.5"]["value"][3]);
  EXPECT_DOUBLE_EQ(of["pearson e"]["value"][3], 1.0);
  EXPECT_NEAR(of["spearman mu"]["value"][3], 0.0, 0.3);
  EXPECT_NEAR(json["outputs"][1]["statistics"]["mean"]["value"][3], 0.5, 0.15);
}

TEST_F(Uncertainty, ModesHaveProbabilitiesThatAddUpToOne) {
  const auto outcome = uncertainty({"spread", "--of", "major_mode", "--format", "csv"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("output,statistic,points,value,from,to\nmajor_mode,"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("too wide")));
  const auto json =
      nlohmann::json::parse(uncertainty({"spread", "--of", "major_mode", "--format", "json"}).out);
  double sum = 0.0;
  for (const auto& [mode, probability] : json["outputs"][0]["statistics"].items()) {
    const double value = probability["value"].back();
    sum += value;
    EXPECT_LE(probability["from"].back(), value) << mode;
    EXPECT_GE(probability["to"].back(), value) << mode;
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
}

TEST_F(Uncertainty, TablesShowStatisticsCorrelationsAndConvergence) {
  const auto outcome = uncertainty({"spread", "--out", folder_.file("spread.gp")});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("fn_peak_N"));
  for (const char* part :
       {"quantile 0.05", "pearson mu", "spearman e", "probability", "of the first 25"}) {
    EXPECT_THAT(outcome.out, HasSubstr(part));
  }
  const auto script = text_in_file(folder_.file("spread.gp"));
  EXPECT_THAT(script, HasSubstr("95 % quantile"));
  EXPECT_THAT(script, HasSubstr("with boxxyerror"));
  EXPECT_THAT(script, HasSubstr("with xerrorbars"));
}

TEST_F(Uncertainty, ASampleThatIsSpreadMoreEvenlyIsNoted) {
  run("sobol:64", "even");
  const auto outcome = uncertainty({"even", "--of", "fn_peak_N"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("sobol points are spread more evenly"));
}

TEST_F(Uncertainty, AStudyThatIsNoSampleAndWrongQuantilesAreRefused) {
  const auto grid =
      test::run_oblique(folder_, {"run", "--H", "0.9", "--mu", "0.1,0.2", "--e", "0.8", "--preset",
                                  "paper", "--name", "grid", "--quiet"});
  ASSERT_EQ(grid.exit_code, 0) << grid.err;
  const auto outcome = uncertainty({"grid"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--sample"));
  EXPECT_EQ(uncertainty({"spread", "--quantiles", "0.5,0.1"}).exit_code, 2);
  EXPECT_EQ(uncertainty({"spread", "--quantiles", "5"}).exit_code, 2);
  EXPECT_EQ(uncertainty({"nothing"}).exit_code, 1);
  EXPECT_EQ(uncertainty({"spread", "--where", "mu > 9"}).exit_code, 1);
}

}  // namespace
}  // namespace oblique::client
