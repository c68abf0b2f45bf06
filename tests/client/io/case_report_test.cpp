#include "client/io/case_report.h"

#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

solver::CaseResult some_result() {
  solver::CaseResult result{};
  result.H_m = 1.0;
  result.mu = 1.2;
  result.peaks = {{1e-5, 4000.0, 2000.0, true}, {2e-5, 3990.0, 1990.0, false}};
  result.ft_peaks = {{1.5e-5, 2100.0}};
  result.fn_peak_N = 4000.0;
  result.mode = "SC SR sC sR";
  result.major_mode = "SC SR";
  result.stick_intervals = {{0.0, 1e-5}};
  result.phases = {{solver::PhaseKind::kCompression, 0.0, 1e-5},
                   {solver::PhaseKind::kRestitution, 1e-5, 3e-5}};
  result.solver = {"explicit", 1e-6, 30, 1e-3, "0.1.0"};
  return result;
}

TEST(SolveJson, HasExactlyTheDocumentedFields) {
  std::string names;
  const auto json = json_of(some_result());
  for (const auto& [name, value] : json.items()) {
    names += name + ' ';
  }
  EXPECT_EQ(names,
            "H mu e fall_time_s impact_x_m vt_in_m_s vn_in_m_s duration_s fn_peak_N ft_peak_N "
            "fn_peaks_N ft_peaks_N major_peaks_N major_peak_1_N major_peak_2_N major_peak_3_N "
            "major_peak_1_t_s major_peak_2_t_s major_peak_3_t_s impulse_n_Ns impulse_t_Ns slide_m "
            "vt_out_m_s vn_out_m_s mode major_mode margin margin_event stick_total_s "
            "stick_intervals_s phases reaction_peaks energy errors solver ");
}

TEST(SolveJson, HasListsOfPeaksAndReactionsAndNullForMissingValues) {
  auto result = some_result();
  result.reaction_peaks = {{2e-5, 900.0}, {3e-5, 1800.0}};
  const auto json = json_of(result);
  EXPECT_TRUE(json["margin"].is_null());
  EXPECT_TRUE(json["margin_event"].is_null());
  EXPECT_EQ(json["reaction_peaks"],
            nlohmann::ordered_json::parse(
                R"([{"t_s": 2e-5, "force_N": 900.0}, {"t_s": 3e-5, "force_N": 1800.0}])"));
  EXPECT_EQ(json["fn_peaks_N"], nlohmann::ordered_json::parse("[4000.0, 3990.0]"));
  EXPECT_EQ(json["major_peaks_N"], nlohmann::ordered_json::parse("[4000.0]"));
  EXPECT_EQ(json["ft_peaks_N"], nlohmann::ordered_json::parse("[2100.0]"));
  EXPECT_EQ(json["stick_intervals_s"], nlohmann::ordered_json::parse("[[0.0, 1e-5]]"));
  EXPECT_EQ(json["phases"][1]["kind"], "restitution");
  EXPECT_EQ(json["solver"]["steps"], 30);
}

std::string summary_of(const solver::CaseResult& result) {
  std::ostringstream out;
  print_summary(out, result);
  return out.str();
}

TEST(Summary, ShowsTheMarginAndWarnsOfASmallOne) {
  auto result = some_result();
  EXPECT_THAT(summary_of(result), Not(HasSubstr("margin")));
  result.margin_event = "turn";
  result.margin = 0.0361;
  EXPECT_THAT(summary_of(result),
              HasSubstr("margin      0.036 (0 fragile, 1 safe), closest event: turn\n"));
  result.margin = 3e-7;
  EXPECT_THAT(summary_of(result), HasSubstr("closest event: turn; the mode is not reliable\n"));
}

TEST(Summary, MarksRipplesAndAvoidsMinusZeroAndNeedlessExponents) {
  auto result = some_result();
  result.energy.restitution_J = -3e-17;
  result.vt_out_m_s = -1e-6;
  result.solver.wall_s = 0.1234;
  const auto text = summary_of(result);
  EXPECT_THAT(text, HasSubstr("  ripple\n"));
  EXPECT_THAT(text, HasSubstr("(with ripples: SC SR sC sR)"));
  EXPECT_THAT(text, Not(HasSubstr("-0.0")));
  EXPECT_THAT(text, Not(HasSubstr("e+")));
  EXPECT_THAT(text, HasSubstr("123 ms"));
}

TEST(Summary, ShowsEstimatedErrorsIfTheResultHasThem) {
  auto result = some_result();
  EXPECT_THAT(summary_of(result), Not(HasSubstr("errors")));
  result.errors.mode_same = 0;
  result.errors.fn_peak = 0.0123;
  EXPECT_THAT(summary_of(result), HasSubstr("[%]: F_n 1.2, F_t -"));
  EXPECT_THAT(summary_of(result), HasSubstr("another mode on half the mesh"));
}

}  // namespace
}  // namespace oblique::client
