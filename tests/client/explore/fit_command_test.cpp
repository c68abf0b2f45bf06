#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/explore/fit_coverage.h"
#include "tests/support/programs.h"
#include "tests/support/temporary_folder.h"

namespace oblique::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(FitCoverage, IsThatOf95PercentIntervals) {
  const auto coverage = test::fit_coverage(50, 2);
  EXPECT_EQ(coverage.fits, 50);
  // If intervals cover the truth in 95 % of fits, the probability of fewer than 42 in 50 is 0.1 %.
  EXPECT_GE(coverage.k, 42);
  EXPECT_GE(coverage.eta2, 42);
}

class FitCommand : public ::testing::Test {
 protected:
  /// Writes measured.csv: impacts that begin with stick or slip, solved with the preset `paper`.
  void measure() {
    ASSERT_EQ(oblique({"run", "--H", "0.9,1", "--mu", "0.4,1.4", "--e", "1", "--preset", "paper",
                       "--name", "truth"})
                  .exit_code,
              0);
    ASSERT_EQ(oblique({"query", "truth", "--select", "H, mu, fn_peak_N, ft_peak_N", "--out",
                       "measured.csv"})
                  .exit_code,
              0);
  }

  test::Outcome oblique(const std::vector<std::string>& arguments) {
    return test::run_oblique(folder_, arguments);
  }

  test::Outcome fit(std::vector<std::string> more) {
    std::vector<std::string> arguments{"fit", "measured.csv", "--preset", "paper"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return oblique(arguments);
  }

  test::TemporaryFolder folder_;
};

TEST_F(FitCommand, FindsTheParametersOfMeasurements) {
  measure();
  const std::vector<std::string> flags{"--e",        "1",    "--fit", "k=1e7:1e8", "--fit",
                                       "eta2=1:1.8", "--sd", "1%",    "--json"};
  const auto first = fit(flags);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto found = nlohmann::json::parse(first.out);
  EXPECT_NEAR(found["unknowns"][0]["value"].get<double>(), 2.7e7, 1e5);
  EXPECT_NEAR(found["unknowns"][1]["value"].get<double>(), 1.2463, 1e-3);
  EXPECT_LT(found["unknowns"][1]["lower_95"].get<double>(), 1.24);
  EXPECT_GT(found["unknowns"][1]["upper_95"].get<double>(), 1.25);
  EXPECT_EQ(found["degrees_of_freedom"], 6);
  EXPECT_EQ(found["residuals"].size(), 8U);
  EXPECT_EQ(found["residuals"][0]["output"], "fn_peak_N");
  // All points of the second run are already stored.
  const auto again = fit(flags);
  EXPECT_EQ(again.out, first.out);
  EXPECT_THAT(again.err, HasSubstr("Continuing"));
}

TEST_F(FitCommand, ReportsWrongInput) {
  std::ofstream(folder_.file("measured.csv")) << "H,mu,fn_peak_N\n1,0.4,5058\n";
  const auto error_of = [&](const std::vector<std::string>& flags) {
    const auto ended = fit(flags);
    EXPECT_EQ(ended.exit_code, 2) << ended.err;
    return ended.err;
  };
  EXPECT_THAT(error_of({"--e", "1"}), HasSubstr("give --fit KEY=FROM:TO"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "k", "--sd", "1%"}), HasSubstr("write KEY=FROM:TO"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "kk=1:2", "--sd", "1%"}), HasSubstr("kk"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "links=2:4", "--sd", "1%"}), HasSubstr("links"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "k=1e7:1e8"}),
              HasSubstr("fn_peak_N has no standard deviation"));
  EXPECT_THAT(error_of({"--fit", "k=1e7:1e8", "--sd", "1%"}), HasSubstr("--e is missing"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "H=0.5:1", "--sd", "1%"}),
              HasSubstr("H is given twice"));
  EXPECT_THAT(error_of({"--e", "1,0.9", "--fit", "k=1e7:1e8", "--sd", "1%"}),
              HasSubstr("fit takes one value"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "k=1e7:1e8:1e8", "--sd", "1%"}),
              HasSubstr("k from 1e+07 to 1e+08 with the start 1e+08: the bounds must rise"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "k=1e7:1e8", "--fit", "eta2=1:2", "--sd", "1%"}),
              HasSubstr("2 unknowns cannot be determined by 1 measured"));
}

}  // namespace
}  // namespace oblique::client
