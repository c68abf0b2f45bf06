#include "client/output/case_report.h"

#include <optional>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

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

TEST(SolveJson, HasExactlyTheFieldsThatAreDocumented) {
  const auto json = json_of(some_result());
  std::set<std::string> names;
  for (const auto& [name, value] : json.items()) {
    names.insert(name);
  }
  EXPECT_EQ(names, (std::set<std::string>{"H",
                                          "mu",
                                          "e",
                                          "fall_time_s",
                                          "impact_x_m",
                                          "vt_in_m_s",
                                          "vn_in_m_s",
                                          "duration_s",
                                          "fn_peak_N",
                                          "ft_peak_N",
                                          "fn_peaks_N",
                                          "ft_peaks_N",
                                          "major_peaks_N",
                                          "major_peak_1_N",
                                          "major_peak_2_N",
                                          "major_peak_3_N",
                                          "major_peak_1_t_s",
                                          "major_peak_2_t_s",
                                          "major_peak_3_t_s",
                                          "impulse_n_Ns",
                                          "impulse_t_Ns",
                                          "slide_m",
                                          "vt_out_m_s",
                                          "vn_out_m_s",
                                          "mode",
                                          "major_mode",
                                          "margin",
                                          "margin_event",
                                          "stick_total_s",
                                          "stick_intervals_s",
                                          "phases",
                                          "reaction_peaks",
                                          "energy",
                                          "errors",
                                          "solver"}));
}

TEST(SolveJson, ListsAllPeaksAndTheMajorOnes) {
  const auto json = json_of(some_result());
  EXPECT_EQ(json["fn_peaks_N"], nlohmann::ordered_json::parse("[4000.0, 3990.0]"));
  EXPECT_EQ(json["major_peaks_N"], nlohmann::ordered_json::parse("[4000.0]"));
  EXPECT_EQ(json["ft_peaks_N"], nlohmann::ordered_json::parse("[2100.0]"));
  EXPECT_EQ(json["stick_intervals_s"], nlohmann::ordered_json::parse("[[0.0, 1e-5]]"));
  EXPECT_EQ(json["phases"][1]["kind"], "restitution");
  EXPECT_EQ(json["solver"]["steps"], 30);
}

TEST(SolveJson, HasNullForWhatAResultLacks) {
  auto result = some_result();
  EXPECT_TRUE(json_of(result)["margin"].is_null());
  EXPECT_TRUE(json_of(result)["margin_event"].is_null());
  result.margin = 0.25;
  result.margin_event = "turn";
  EXPECT_EQ(json_of(result)["margin"], 0.25);
  EXPECT_EQ(json_of(result)["margin_event"], "turn");
}

TEST(SolveJson, GivesTheLargestReactionAtThePinAndAtEachJoint) {
  auto result = some_result();
  result.reaction_peaks = {{2e-5, 900.0}, {3e-5, 1800.0}};
  EXPECT_EQ(json_of(result)["reaction_peaks"],
            nlohmann::ordered_json::parse(
                R"([{"t_s": 2e-5, "force_N": 900.0}, {"t_s": 3e-5, "force_N": 1800.0}])"));
}

TEST(Summary, SaysHowNearAnotherModeIsAndWhenThatIsTooNear) {
  auto result = some_result();
  const auto text_with = [&](std::optional<double> margin) {
    result.margin = margin;
    std::ostringstream out;
    print_summary(out, result);
    return out.str();
  };
  EXPECT_EQ(text_with(std::nullopt).find("margin"), std::string::npos);
  result.margin_event = "turn";
  EXPECT_NE(text_with(0.0361).find("margin      0.036 (0 fragile, 1 safe), closest event: turn\n"),
            std::string::npos);
  EXPECT_NE(text_with(3e-7).find("closest event: turn; the mode is not to be trusted\n"),
            std::string::npos);
}

TEST(Summary, TellsRipplesFromPeaks) {
  std::ostringstream out;
  print_summary(out, some_result());
  EXPECT_NE(out.str().find("ripple"), std::string::npos);
  EXPECT_NE(out.str().find("(with ripples: SC SR sC sR)"), std::string::npos);
}

TEST(Summary, NeverShowsMinusZeroOrAnExponentWherePlainDigitsDo) {
  auto result = some_result();
  result.energy.restitution_J = -3e-17;
  result.vt_out_m_s = -1e-6;
  result.solver.wall_s = 0.1234;
  std::ostringstream out;
  print_summary(out, result);
  EXPECT_EQ(out.str().find("-0.0"), std::string::npos) << out.str();
  EXPECT_EQ(out.str().find("e+"), std::string::npos) << out.str();
  EXPECT_NE(out.str().find("123 ms"), std::string::npos) << out.str();
}

TEST(Summary, TellsErrorsWhereTheyWereEstimated) {
  auto result = some_result();
  std::ostringstream without;
  print_summary(without, result);
  EXPECT_EQ(without.str().find("errors"), std::string::npos);
  result.errors.mode_same = 0;
  result.errors.fn_peak = 0.0123;
  std::ostringstream with;
  print_summary(with, result);
  EXPECT_NE(with.str().find("[%]: F_n 1.2, F_t -"), std::string::npos) << with.str();
  EXPECT_NE(with.str().find("another mode on half the mesh"), std::string::npos) << with.str();
}

}  // namespace
}  // namespace oblique::client
