#include "client/convergence/mesh_study.h"

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace oblique::client {
namespace {

using solver::CaseResult;
using testing::HasSubstr;

constexpr double kFourthOrder = 4.0;

// A contact whose every output is off by h^4 of itself, the tangential exit velocity by 100 times
// as much of `near_zero` (which is its limit).
CaseResult contact_at(double h, double near_zero) {
  const double off = h * h * h * h;
  const double factor = 1.0 + off;
  CaseResult result{};
  result.fn_peak_N = 4000.0 * factor;
  result.ft_peak_N = 2000.0 * factor;
  result.peaks = {{1e-5, 4000.0 * factor, 2000.0 * factor, true},
                  {3e-5, 1000.0 * factor, 500.0 * factor, true}};
  result.mode = "SC SR sR sC sR";
  result.major_mode = result.mode;
  result.duration_s = 5e-4 * factor;
  result.stick_total_s = 0.0;
  result.slide_m = 1e-3 * factor;
  result.impulse_n_Ns = 1.0 * factor;
  result.impulse_t_Ns = 0.4 * factor;
  result.vt_in_m_s = -5.0;
  result.vn_in_m_s = -5.0;
  result.vt_out_m_s = near_zero * (1.0 + 100.0 * off);
  result.vn_out_m_s = 2.0 * factor;
  result.reaction_peaks = {{1e-5, 900.0 * factor}};
  return result;
}

Refinement meshes_with(const std::vector<CaseResult>& results) {
  Refinement refinement{.what = "mesh", .levels = {}, .convergence = {}};
  for (std::size_t i = 0; i < results.size(); ++i) {
    refinement.levels.push_back(
        {.level = {"n = " + std::to_string(4 << i), {}}, .results = {results[i]}, .wall_s = 0.0});
  }
  refinement.convergence = convergence_of(results, kFourthOrder);
  return refinement;
}

Refinement refinement_of_a_point(double near_zero) {
  return meshes_with({contact_at(0.4, near_zero), contact_at(0.2, near_zero),
                      contact_at(0.1, near_zero), contact_at(0.05, near_zero)});
}

const OutputStudy& output_named(const MeshStudy& study, const std::string& name) {
  return *std::find_if(study.outputs.begin(), study.outputs.end(),
                       [&](const auto& output) { return output.name == name; });
}

TEST(MeshStudy, TellsHowFarEachMeshIsFromTheLimits) {
  const auto study = study_of({refinement_of_a_point(-1.0)}, 0.005);
  const auto& peaks = output_named(study, "major_peaks_N");
  EXPECT_EQ(peaks.points(), 1U);
  EXPECT_NEAR(*peaks.largest(0), 0.0256, 1e-6);
  EXPECT_NEAR(*peaks.largest(1), 0.0016, 1e-6);
  EXPECT_NEAR(*output_named(study, "vt_out_m_s").median(1), 0.16, 1e-4);
  EXPECT_EQ(output_named(study, "reaction_peaks_N").within(0, 0.005), 0U);
  EXPECT_EQ(output_named(study, "reaction_peaks_N").within(1, 0.005), 1U);
}

TEST(MeshStudy, ChoosesTheCoarsestMeshFromWhichOnAllIsCloseEnough) {
  const std::vector<Refinement> points{refinement_of_a_point(-1.0)};
  EXPECT_EQ(study_of(points, 3.0).chosen, 0U);
  EXPECT_EQ(study_of(points, 0.02).chosen, 2U);
  EXPECT_EQ(study_of(points, 0.001).chosen, 3U);
  EXPECT_FALSE(study_of(points, 1e-5).chosen);
}

TEST(MeshStudy, LeavesAnOutputBehindAtOnePointInFiveButNotAtTwo) {
  const auto off = [](double vn_out_m_s) {
    auto coarse = contact_at(0.1, -1.0);
    coarse.vn_out_m_s = vn_out_m_s;
    return meshes_with(
        {contact_at(0.2, -1.0), coarse, contact_at(0.04, -1.0), contact_at(0.02, -1.0)});
  };
  std::vector<Refinement> points(5, off(2.0));
  points[3] = off(2.1);
  EXPECT_EQ(study_of(points, 0.02).chosen, 1U);
  points[4] = off(2.1);
  EXPECT_EQ(study_of(points, 0.02).chosen, 2U);
}

TEST(MeshStudy, AnotherModeIsNotWithinAnything) {
  auto coarse = contact_at(0.4, -1.0);
  coarse.major_mode = "sC sR";
  const auto study = study_of(
      {meshes_with({coarse, contact_at(0.2, -1.0), contact_at(0.1, -1.0), contact_at(0.05, -1.0)})},
      10.0);
  const auto& duration = output_named(study, "duration_s");
  EXPECT_FALSE(duration.largest(0));
  EXPECT_EQ(duration.within(0, 10.0), 0U);
  EXPECT_EQ(duration.points(), 1U);
  EXPECT_EQ(study.chosen, 1U);
  EXPECT_FALSE(study.misses[0].empty());
}

TEST(MeshStudy, AnOutputThatIsZeroCountsNowhere) {
  const auto study = study_of({refinement_of_a_point(-1.0)}, 0.005);
  for (const auto& output : study.outputs) {
    EXPECT_NE(output.name, "stick_total_s");
  }
}

TEST(MeshStudy, NamesWhatTheChosenMeshMisses) {
  std::vector<Refinement> points(
      5, meshes_with({contact_at(0.1, -1.0), contact_at(0.05, -1.0), contact_at(0.025, -1.0)}));
  points[2] = meshes_with({contact_at(0.2, 0.1), contact_at(0.1, 0.1), contact_at(0.05, 0.1)});
  const auto study = study_of(points, 0.02);
  ASSERT_EQ(study.chosen, 0U);
  std::ostringstream out;
  print_study(
      out, study,
      {{1.0, 0.1, 1.0}, {1.0, 0.2, 1.0}, {1.0, 0.3, 0.6}, {1.0, 0.4, 1.0}, {1.0, 0.5, 1.0}});
  EXPECT_THAT(out.str(), HasSubstr("H = 1 m, mu = 0.3, e* = 0.6: 16 % of 0.1 vt_out_m_s"));
  EXPECT_EQ(json_of(study)["chosen"], "n = 4");
}

}  // namespace
}  // namespace oblique::client
