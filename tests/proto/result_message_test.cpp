#include "proto/result_message.h"

#include <gtest/gtest.h>

#include "proto/frames.h"

namespace oblique::protocol {
namespace {

/// A result whose every field differs from the others.
solver::CaseResult distinct_result() {
  solver::CaseResult result{};
  result.fall_time_s = 0.43;
  result.impact_x_m = 0.58;
  result.vt_in_m_s = -5.7;
  result.vn_in_m_s = -5.2;
  result.duration_s = 5.5e-4;
  result.fn_peak_N = 5057.0;
  result.ft_peak_N = 2023.0;
  result.peaks = {
      {1e-5, 5057.0, 2023.0, true}, {2e-5, 40.0, 16.0, false}, {3e-5, 1516.0, 606.0, true}};
  result.ft_peaks = {{1.1e-5, 2023.0}, {3.1e-5, 607.0}};
  result.impulse_n_Ns = 0.7;
  result.impulse_t_Ns = 0.3;
  result.slide_m = 1e-3;
  result.vt_out_m_s = -4.0;
  result.vn_out_m_s = 2.0;
  result.mode = "SC SR sR";
  result.major_mode = "SC SR";
  result.stick_total_s = 7e-5;
  result.stick_intervals = {{0.0, 6e-5}, {8e-5, 9e-5}};
  result.reaction_peaks = {{3.2e-4, 5053.0}, {3.4e-4, 4611.0}};
  result.phases = {{solver::PhaseKind::kCompression, 0.0, 6.8e-5},
                   {solver::PhaseKind::kRestitution, 6.8e-5, 5.5e-4}};
  result.energy = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0};
  result.solver = {"explicit", 4e-6, 138, 3e-4, "0.1.0"};
  return result;
}

TEST(PointResultTest, ScalarsOfAResultKeepTheirValuesAndMeaning) {
  const PointResult message = to_message(42, distinct_result());
  EXPECT_EQ(message.point(), 42U);
  EXPECT_TRUE(message.error().empty());
  EXPECT_EQ(message.fall_time_s(), 0.43);
  EXPECT_EQ(message.impact_x_m(), 0.58);
  EXPECT_EQ(message.vt_in_m_s(), -5.7);
  EXPECT_EQ(message.vn_in_m_s(), -5.2);
  EXPECT_EQ(message.duration_s(), 5.5e-4);
  EXPECT_EQ(message.fn_peak_n(), 5057.0);
  EXPECT_EQ(message.ft_peak_n(), 2023.0);
  EXPECT_EQ(message.impulse_n_ns(), 0.7);
  EXPECT_EQ(message.impulse_t_ns(), 0.3);
  EXPECT_EQ(message.slide_m(), 1e-3);
  EXPECT_EQ(message.vt_out_m_s(), -4.0);
  EXPECT_EQ(message.vn_out_m_s(), 2.0);
  EXPECT_EQ(message.mode(), "SC SR sR");
  EXPECT_EQ(message.major_mode(), "SC SR");
  EXPECT_EQ(message.stick_total_s(), 7e-5);
  EXPECT_EQ(message.dt_s(), 4e-6);
  EXPECT_EQ(message.steps(), 138U);
  EXPECT_EQ(message.wall_s(), 3e-4);
}

TEST(PointResultTest, EnergiesOfAResultKeepTheirValuesAndMeaning) {
  const PointResult message = to_message(0, distinct_result());
  EXPECT_EQ(message.kinetic_in_j(), 1.0);
  EXPECT_EQ(message.friction_j(), 2.0);
  EXPECT_EQ(message.restitution_j(), 3.0);
  EXPECT_EQ(message.kinetic_change_j(), 4.0);
  EXPECT_EQ(message.strain_change_j(), 5.0);
  EXPECT_EQ(message.gravity_change_j(), 6.0);
  EXPECT_EQ(message.exchanged_j(), 7.0);
  EXPECT_EQ(message.closure(), 8.0);
}

TEST(PointResultTest, ListsOfAResultArePackedInOrder) {
  const PointResult message = to_message(0, distinct_result());
  const auto doubles = [](const auto& field) {
    return std::vector<double>(field.begin(), field.end());
  };
  EXPECT_EQ(doubles(message.peaks()),
            (std::vector<double>{1e-5, 5057.0, 2023.0, 2e-5, 40.0, 16.0, 3e-5, 1516.0, 606.0}));
  EXPECT_EQ(doubles(message.major_peaks()), (std::vector<double>{0, 2}));
  EXPECT_EQ(doubles(message.ft_peaks()), (std::vector<double>{1.1e-5, 2023.0, 3.1e-5, 607.0}));
  EXPECT_EQ(doubles(message.phase_ends_s()), (std::vector<double>{6.8e-5, 5.5e-4}));
  EXPECT_EQ(doubles(message.stick_intervals()), (std::vector<double>{0.0, 6e-5, 8e-5, 9e-5}));
  EXPECT_EQ(doubles(message.reaction_peaks()),
            (std::vector<double>{3.2e-4, 5053.0, 3.4e-4, 4611.0}));
}

TEST(PointResultTest, AResultComesBackFromAFrameUnchanged) {
  const PointResult sent = to_message(42, distinct_result());
  PointResult received;
  ASSERT_TRUE(decode(encode(sent), received));
  EXPECT_EQ(encode(received), encode(sent));
}

TEST(PointResultTest, AFailedPointAlwaysHasAReason) {
  EXPECT_EQ(failed_point(7, "the contact does not end").error(), "the contact does not end");
  EXPECT_EQ(failed_point(7, "the contact does not end").point(), 7U);
  EXPECT_EQ(failed_point(7, "").error(), "unknown");
}

}  // namespace
}  // namespace oblique::protocol
