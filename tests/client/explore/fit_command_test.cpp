#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/explore/fit_coverage.h"
#include "tests/support/amount.h"
#include "tests/support/programs.h"
#include "tests/support/temporary_folder.h"

namespace oblique::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(FitCoverage, IsThatOf95PercentIntervalsAlsoIfTheDeviationsAreScaled) {
  for (const bool is_scaled : {false, true}) {
    const int fits = test::amount(20, 50);
    // If intervals cover the truth in 95 % of fits, fewer than 15 in 20 or 42 in 50 have a
    // probability of 0.1 % at most.
    const int least = test::amount(15, 42);
    const auto coverage = test::fit_coverage(fits, 2, is_scaled);
    EXPECT_EQ(coverage.fits, fits);
    EXPECT_GE(coverage.k, least) << is_scaled;
    EXPECT_GE(coverage.eta2, least) << is_scaled;
  }
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

TEST_F(FitCommand, SaysWhichValuesFitAsWellAsABound) {
  std::ofstream(folder_.file("measured.csv"))
      << "H,mu,vn_out_m_s\n0.8,0.4,1.1781\n0.8,1.2,1.7955\n1,0.4,1.9232\n1,1.2,0.9185\n";
  const auto of_e = fit({"--fit", "e=0.5:1", "--sd", "1%", "--quiet"}).out;
  EXPECT_THAT(of_e, HasSubstr("\ne is at its bound 1; values down to 0.976"));
  EXPECT_THAT(of_e, AllOf(Not(HasSubstr("no effect")), Not(HasSubstr("beyond"))));
  const auto both = fit({"--fit", "e=0.5:1", "--fit", "k=2.8e7:1e8", "--sd", "1%", "--quiet"}).out;
  EXPECT_THAT(both, HasSubstr("\ne is at its bound 1; values down to 0.99"));
  EXPECT_THAT(both, HasSubstr("\nk is at its bound 2.8e+07; values up to 2.80"));
  EXPECT_THAT(both, HasSubstr("fit as well. Values beyond the bound may fit better.\n"));
}

TEST_F(FitCommand, NotesThatAScaleBelow1NarrowsTheAnswer) {
  measure();
  const std::vector<std::string> flags{"--e", "1", "--fit", "k=1e7:1e8", "--sd", "1%"};
  auto scaled = flags;
  scaled.emplace_back("--scale");
  EXPECT_THAT(fit(scaled).out, HasSubstr("so --scale narrows sd to 0.001 of its size"));
  EXPECT_THAT(fit(flags).out, Not(HasSubstr("--scale")));
}

TEST_F(FitCommand, WithoutAFileRefusesFlagsThatItWouldIgnore) {
  for (const std::vector<std::string>& flags :
       std::vector<std::vector<std::string>>{{"--scale"},
                                             {"--db", "x.db"},
                                             {"--workers", "1"},
                                             {"--name", "x"},
                                             {"--server", "x"},
                                             {"--keys", "x"},
                                             {"--timeout", "5"},
                                             {"--no-reuse"},
                                             {"--fall-memory", "2GB"},
                                             {"--fit", "k=1e7:1e8"},
                                             {"--sd", "1%"},
                                             {"--k", "2e7"},
                                             {"--preset", "paper"}}) {
    auto words = flags;
    words.insert(words.begin(), "fit");
    const auto refused = oblique(words);
    EXPECT_EQ(refused.exit_code, 2) << flags[0];
    EXPECT_THAT(refused.err, HasSubstr(flags[0] + " needs measured numbers"));
  }
  for (const std::string picture : {"fit.svg", "fit.gp", "fit.png", "fit.pdf"}) {
    const auto refused = oblique({"fit", "--out", picture});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err,
                HasSubstr("--out " + picture + ": the fit to the paper's numbers has"));
  }
}

TEST_F(FitCommand, SaysWhichPointFailsIfTheModelHasNoOutput) {
  std::ofstream(folder_.file("measured.csv")) << "H,mu,fn_peak_N\n1e-9,0.4,5058\n";
  const auto failed = fit({"--e", "1", "--fit", "k=1e7:1e8", "--sd", "1%", "--quiet"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.err,
              HasSubstr("no such output at the start; give other starts. Point 0 failed"));
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
  EXPECT_THAT(error_of({"--e", "1", "--fit", "k=abc:1e8", "--sd", "1%"}),
              HasSubstr("\"abc\" is not a number"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "kk=1:2", "--sd", "1%"}), HasSubstr("kk"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "links=2:4", "--sd", "1%"}), HasSubstr("links"));
  EXPECT_THAT(error_of({"--e", "1", "--fit", "k=1e7:1e8"}),
              HasSubstr("fn_peak_N has no standard deviation"));
  EXPECT_THAT(error_of({"--fit", "k=1e7:1e8", "--sd", "1%"}), HasSubstr("--e is missing"));
  EXPECT_THAT(error_of({"--fit", "k=1e7:1e8", "--e", "1", "--from", "printed"}),
              HasSubstr("--from"));
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
