#include "client/paper/paper_comparison.h"

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/io/console.h"
#include "client/io/row_output.h"
#include "client/study/study_file.h"
#include "client/trace/solve_again.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

// Two published cases: one with two peaks, two phases and a stick time, one without numbers.
PublishedTable small_table() {
  PublishedCase counted;
  counted.H_m = 1.0;
  counted.mu = 1.2;
  counted.e_star = 1.0;
  counted.mode = "SC SR sR sC sR";
  counted.fn_kN = {4.0, 1.0};
  counted.ft_kN = {2.0, 0.5};
  counted.phases_ms = {0.1, 0.2};
  counted.stick_ms = 0.1;
  PublishedCase uncounted;
  uncounted.H_m = 0.96;
  uncounted.mu = 0.4;
  uncounted.e_star = 1.0;
  uncounted.mode = "sC sR";
  return {.cases = {counted, uncounted},
          .misprints = {{.where = "column 3", .printed = {"7.0 kN"}, .why = "it is column 2"}}};
}

// A list of three peaks; the third is a ripple.
constexpr const char* kLateRipple = "[[1e-5,4040,2020,1],[2e-5,1000,500,1],[3e-5,990,495,0]]";

/// A stored row of a point with e* = 1.
protocol::Table rows_of_point(double H_m, double mu, const std::string& peaks = kLateRipple) {
  protocol::Table rows;
  rows.rows.push_back({std::int64_t{0}, H_m, mu, 1.0, peaks,
                       "[[\"compression\",0,1e-4],[\"restitution\",1e-4,3e-4]]", 1.1e-4,
                       "SC SR sR sC sR"});
  return rows;
}

TEST(Comparison, ComparesMajorPeaksPhasesAndStickWithThePaper) {
  const auto table = small_table();
  const auto rows = rows_of_point(1.0, 1.2);
  const auto differences = compare(table, own_cases(table, rows));
  ASSERT_EQ(differences.size(), 7U);
  EXPECT_NEAR(differences[0].percent().value(), 1.0, 1e-9);
  EXPECT_NEAR(differences[1].ours.value(), 1.0, 1e-12);
  EXPECT_NEAR(differences[5].percent().value(), 0.0, 1e-9);
  EXPECT_NEAR(differences[6].percent().value(), 10.0, 1e-9);
  const auto summary = summary_of(differences);
  EXPECT_EQ(summary.counted, 7U);
  EXPECT_EQ(summary.missing, 0U);
  EXPECT_NEAR(summary.largest_percent, 10.0, 1e-9);
  EXPECT_NEAR(summary.rms_percent, std::sqrt((1.0 + 1.0 + 100.0) / 7.0), 1e-9);
}

TEST(Comparison, IgnoresPhasesOfARowFromTheFirstRippleOn) {
  const auto table = small_table();
  const auto rows =
      rows_of_point(1.0, 1.2, "[[1e-5,4040,2020,1],[2e-5,4000,2000,0],[3e-5,1000,500,1]]");
  const auto own = own_cases(table, rows).front().value();
  EXPECT_EQ(own.phases_ms, std::vector<double>{0.1});
  EXPECT_EQ(own.fn_kN, (std::vector<double>{4.04, 1.0}));
}

TEST(Comparison, MergesRipplesInThePhasesOfAResult) {
  using solver::PhaseKind;
  solver::CaseResult result{};
  // The force turns at 4000, 100, 200, 150, 1000 N; the peak of 200 N and the valley of 150 N form
  // a ripple.
  result.phases = {
      {PhaseKind::kCompression, 0.0, 1.0, 4000.0}, {PhaseKind::kRestitution, 1.0, 3.0, 100.0},
      {PhaseKind::kCompression, 3.0, 4.0, 200.0},  {PhaseKind::kRestitution, 4.0, 5.0, 150.0},
      {PhaseKind::kCompression, 5.0, 9.0, 1000.0}, {PhaseKind::kRestitution, 9.0, 16.0, 0.0}};
  EXPECT_EQ(own_case(result).phases_ms, (std::vector<double>{1e3, 2e3, 6e3, 7e3}));
}

TEST(Comparison, HasARowForEachPublishedNumberAndCountsMissingNumbers) {
  const auto table = small_table();
  const auto differences = compare(table, own_cases(table, {}));
  EXPECT_EQ(summary_of(differences).counted, 0U);
  EXPECT_EQ(summary_of(differences).missing, 7U);
  const auto rows = rows_of(table, differences);
  EXPECT_EQ(rows.rows.size(), 7U);
  EXPECT_EQ(rows.rows[0].size(), rows.columns.size());
}

TEST(Comparison, RefusesAStudyWithSeveralPointsForOneCase) {
  auto rows = rows_of_point(1.0, 1.2);
  rows.rows.push_back(rows.rows.front());
  EXPECT_THROW(own_cases(small_table(), rows), std::runtime_error);
}

TEST(Comparison, IsPrintedWithDifferencesSummaryAndMisprints) {
  const auto table = small_table();
  const auto rows = rows_of_point(1.0, 1.2);
  std::ostringstream out;
  print_comparison(out, table, own_cases(table, rows));
  const auto text = out.str();
  for (const char* part :
       {"4.040 / 4.00 / +1.00", "0.1100 / 0.100 / +10.00", "not solved", "the same",
        "7 reliable published numbers", "largest 10.00 % (time in stick at H = 1, mu = 1.2",
        "The mode is the published one in 1 of 1 cases", "column 3: 7.0 kN", "it is column 2"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in:\n" << text;
  }
}

TEST(Comparison, ListsCasesWhoseModeDiffersFromThePublishedOne) {
  auto table = small_table();
  table.cases[0].mode = "sC sR";
  std::ostringstream out;
  print_modes(out, table, own_cases(table, rows_of_point(1.0, 1.2)));
  for (const char* part :
       {"The mode is the published one in 0 of 1 cases solved",
        "- H = 1, mu = 1.2, e* = 1: SC SR sR sC sR (2 peaks), published sC sR (1)"}) {
    EXPECT_NE(out.str().find(part), std::string::npos) << out.str();
  }
}

TEST(PublishedTable, Contains63ReliableNumbers) {
  std::size_t fn = 0;
  std::size_t ft = 0;
  std::size_t phases = 0;
  std::size_t sticks = 0;
  for (const auto& published : published_table().cases) {
    fn += published.fn_kN.size();
    ft += published.ft_kN.size();
    phases += published.phases_ms.size();
    sticks += published.stick_ms ? 1U : 0U;
  }
  EXPECT_EQ(fn, 24U);
  EXPECT_EQ(ft, 24U);
  EXPECT_EQ(phases, 12U);
  EXPECT_EQ(sticks, 3U);
}

TEST(PublishedTable, HasTheCasesOfTheExampleStudyInTheSameOrder) {
  const auto published = published_table().cases;
  std::ostringstream dropped;
  Console console(dropped, dropped);
  const protocol::PointTable study(
      read_study_file(std::string(OBLIQUE_SOURCE_DIR) + "/deploy/studies/paper.toml",
                      tip_reach(console))
          .recipe);
  ASSERT_EQ(published.size(), study.size());
  for (std::uint64_t i = 0; i < study.size(); ++i) {
    EXPECT_EQ(published[i].H_m, study.point(i).H_m);
    EXPECT_EQ(published[i].mu, study.point(i).mu);
    EXPECT_EQ(published[i].e_star, study.point(i).e_star);
  }
  EXPECT_EQ(study.model(0), solver::preset("paper"));
}

}  // namespace
}  // namespace oblique::client
