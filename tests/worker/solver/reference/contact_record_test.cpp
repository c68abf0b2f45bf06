#include "worker/solver/reference/contact_record.h"

#include <gtest/gtest.h>

namespace oblique::solver {
namespace {

constexpr ContactParameters kParameters{1e6, 1.25, 0.5, 1.0};
/// F_t = -kTangential_N_m x in stick.
constexpr double kTangential_N_m = 1e6 / 1.25;

constexpr TipState at(double x_m, double y_m) {
  return {x_m, y_m, 0.0, 0.0};
}

/// A contact that is driven step by step: the law, what is recorded of it, and where the tip is.
struct RecordedContact {
  explicit RecordedContact(double vt_in_m_s)
      : tip{0.0, 0.0, vt_in_m_s, -1.0}, law(kParameters, tip), record(law, tip) {}

  void step_to(const TipState& end, const ContactIntegrals<double>& integrals = {}) {
    record.add_step(law, tip, end, integrals);
    tip = end;
  }
  void turn(double t_s) {
    record.add_turn(law, tip, t_s);
    law.turn(tip);
    record.add_state(law, tip, t_s);
  }
  void slip(double t_s) {
    law.start_slip(tip, law.ft_N(tip) > 0.0 ? -1.0 : 1.0);
    record.add_state(law, tip, t_s);
  }
  void stick(double t_s) {
    law.stop_slip(tip);
    record.add_state(law, tip, t_s);
  }
  CaseResult finished(double t_s) {
    record.finish(law, tip, t_s);
    CaseResult result{};
    record.write_to(result);
    return result;
  }

  TipState tip;
  ContactLaw law;
  ContactRecord record;
};

constexpr double kSticking_m_s = 0.1;
constexpr double kSliding_m_s = 1.0;

TEST(ContactRecord, StickThroughATurnIsOneInterval) {
  RecordedContact contact(kSticking_m_s);
  contact.step_to(at(1e-6, -1e-4));
  contact.turn(1e-4);
  contact.step_to(at(1e-6, -5e-5));
  contact.slip(1.5e-4);
  contact.step_to(at(1e-6, 0.0));
  const CaseResult result = contact.finished(2e-4);
  EXPECT_EQ(result.mode, "SC SR sR");
  ASSERT_EQ(result.stick_intervals.size(), 1U);
  EXPECT_EQ(result.stick_intervals[0].t0_s, 0.0);
  EXPECT_EQ(result.stick_intervals[0].t1_s, 1.5e-4);
  EXPECT_EQ(result.stick_total_s, 1.5e-4);
}

TEST(ContactRecord, AStateOfNoLengthIsNotInTheMode) {
  RecordedContact contact(kSliding_m_s);
  contact.step_to(at(1e-6, -1e-4));
  contact.turn(1e-4);   // sR, left at once
  contact.stick(1e-4);  // SR
  contact.step_to(at(1e-6, 0.0));
  const CaseResult result = contact.finished(2e-4);
  EXPECT_EQ(result.mode, "sC SR");
  ASSERT_EQ(result.stick_intervals.size(), 1U);
  EXPECT_EQ(result.stick_intervals[0].t0_s, 1e-4);
}

TEST(ContactRecord, AStateThatBeginsAtSeparationIsNotInTheMode) {
  RecordedContact contact(kSticking_m_s);
  contact.step_to(at(1e-6, -1e-4));
  contact.turn(1e-4);
  contact.step_to(at(0.0, 0.0));
  contact.slip(2e-4);
  const CaseResult result = contact.finished(2e-4);
  EXPECT_EQ(result.mode, "SC SR");
  ASSERT_EQ(result.stick_intervals.size(), 1U);
  EXPECT_EQ(result.stick_intervals[0].t1_s, 2e-4);
}

TEST(ContactRecord, LargestTangentialForceOfAPeakCountsTheValleyFromWhichItFalls) {
  RecordedContact contact(kSticking_m_s);
  contact.step_to(at(-4e-5, -1e-4));
  contact.turn(1e-4);
  contact.step_to(at(-5e-5, -5e-5));  // the valley, where |F_t| is largest
  contact.turn(2e-4);
  contact.step_to(at(-1e-5, -8e-5));
  contact.turn(3e-4);
  contact.step_to(at(0.0, 0.0));
  const CaseResult result = contact.finished(4e-4);
  ASSERT_EQ(result.peaks.size(), 2U);
  EXPECT_DOUBLE_EQ(result.peaks[0].ft_N, kTangential_N_m * 5e-5);
  EXPECT_DOUBLE_EQ(result.peaks[1].ft_N, kTangential_N_m * 5e-5);
  EXPECT_DOUBLE_EQ(result.ft_peak_N, kTangential_N_m * 5e-5);
}

TEST(ContactRecord, WorkExchangedCountsWhatGoesInAndWhatComesBack) {
  RecordedContact contact(kSticking_m_s);
  ContactIntegrals<double> integrals;
  integrals.work_t = 0.25;
  contact.step_to(at(0.0, -1e-3), integrals);
  contact.turn(1e-4);
  integrals.work_t = -0.375;
  contact.step_to(at(0.0, 0.0), integrals);
  const CaseResult result = contact.finished(2e-4);
  // F_n = 1e6 N/m 1e-3 m: half a joule each way, against that along the ground.
  EXPECT_DOUBLE_EQ(result.energy.exchanged_J, 0.5 + 0.5 + 0.25 + 0.375);
  EXPECT_DOUBLE_EQ(result.energy.friction_J, 0.125);
  EXPECT_NEAR(result.energy.restitution_J, 0.0, 1e-15);
}

}  // namespace
}  // namespace oblique::solver
