#pragma once

#include <gtest/gtest.h>

#include <cstddef>

#include "worker/solver/model/case_result.h"

namespace oblique::solver {

/// Compares all numbers of two results except the wall time, bit by bit.
inline void expect_same_bits(const CaseResult& a, const CaseResult& b) {
  EXPECT_EQ(a.H_m, b.H_m);
  EXPECT_EQ(a.mu, b.mu);
  EXPECT_EQ(a.e_star, b.e_star);
  EXPECT_EQ(a.fall_time_s, b.fall_time_s);
  EXPECT_EQ(a.impact_x_m, b.impact_x_m);
  EXPECT_EQ(a.vt_in_m_s, b.vt_in_m_s);
  EXPECT_EQ(a.vn_in_m_s, b.vn_in_m_s);
  EXPECT_EQ(a.duration_s, b.duration_s);
  EXPECT_EQ(a.fn_peak_N, b.fn_peak_N);
  EXPECT_EQ(a.ft_peak_N, b.ft_peak_N);
  EXPECT_EQ(a.impulse_n_Ns, b.impulse_n_Ns);
  EXPECT_EQ(a.impulse_t_Ns, b.impulse_t_Ns);
  EXPECT_EQ(a.slide_m, b.slide_m);
  EXPECT_EQ(a.vt_out_m_s, b.vt_out_m_s);
  EXPECT_EQ(a.vn_out_m_s, b.vn_out_m_s);
  EXPECT_EQ(a.mode, b.mode);
  EXPECT_EQ(a.major_mode, b.major_mode);
  EXPECT_EQ(a.margin, b.margin);
  EXPECT_EQ(a.margin_event, b.margin_event);
  EXPECT_EQ(a.stick_total_s, b.stick_total_s);
  ASSERT_EQ(a.peaks.size(), b.peaks.size());
  for (std::size_t i = 0; i < a.peaks.size(); ++i) {
    EXPECT_EQ(a.peaks[i].t_s, b.peaks[i].t_s);
    EXPECT_EQ(a.peaks[i].fn_N, b.peaks[i].fn_N);
    EXPECT_EQ(a.peaks[i].ft_N, b.peaks[i].ft_N);
    EXPECT_EQ(a.peaks[i].major, b.peaks[i].major);
  }
  ASSERT_EQ(a.ft_peaks.size(), b.ft_peaks.size());
  for (std::size_t i = 0; i < a.ft_peaks.size(); ++i) {
    EXPECT_EQ(a.ft_peaks[i].t_s, b.ft_peaks[i].t_s);
    EXPECT_EQ(a.ft_peaks[i].ft_N, b.ft_peaks[i].ft_N);
  }
  ASSERT_EQ(a.phases.size(), b.phases.size());
  for (std::size_t i = 0; i < a.phases.size(); ++i) {
    EXPECT_EQ(a.phases[i].kind, b.phases[i].kind);
    EXPECT_EQ(a.phases[i].t0_s, b.phases[i].t0_s);
    EXPECT_EQ(a.phases[i].t1_s, b.phases[i].t1_s);
    EXPECT_EQ(a.phases[i].fn_end_N, b.phases[i].fn_end_N);
  }
  ASSERT_EQ(a.stick_intervals.size(), b.stick_intervals.size());
  for (std::size_t i = 0; i < a.stick_intervals.size(); ++i) {
    EXPECT_EQ(a.stick_intervals[i].t0_s, b.stick_intervals[i].t0_s);
    EXPECT_EQ(a.stick_intervals[i].t1_s, b.stick_intervals[i].t1_s);
  }
  ASSERT_EQ(a.reaction_peaks.size(), b.reaction_peaks.size());
  for (std::size_t i = 0; i < a.reaction_peaks.size(); ++i) {
    EXPECT_EQ(a.reaction_peaks[i].t_s, b.reaction_peaks[i].t_s);
    EXPECT_EQ(a.reaction_peaks[i].force_N, b.reaction_peaks[i].force_N);
  }
  EXPECT_EQ(a.energy.kinetic_in_J, b.energy.kinetic_in_J);
  EXPECT_EQ(a.energy.friction_J, b.energy.friction_J);
  EXPECT_EQ(a.energy.restitution_J, b.energy.restitution_J);
  EXPECT_EQ(a.energy.kinetic_change_J, b.energy.kinetic_change_J);
  EXPECT_EQ(a.energy.strain_change_J, b.energy.strain_change_J);
  EXPECT_EQ(a.energy.gravity_change_J, b.energy.gravity_change_J);
  EXPECT_EQ(a.energy.exchanged_J, b.energy.exchanged_J);
  EXPECT_EQ(a.energy.closure, b.energy.closure);
  EXPECT_EQ(a.errors, b.errors);
  EXPECT_EQ(a.solver.dt_s, b.solver.dt_s);
  EXPECT_EQ(a.solver.steps, b.solver.steps);
}

}  // namespace oblique::solver
