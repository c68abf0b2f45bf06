#include "proto/result_message.h"

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/frames.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::protocol {
namespace {

using testing::HasSubstr;

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// Returns a result in which no two fields have the same value.
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
  result.margin = 0.021;
  result.margin_event = "turn";
  result.stick_total_s = 7e-5;
  result.stick_intervals = {{0.0, 6e-5}, {8e-5, 9e-5}};
  result.reaction_peaks = {{3.2e-4, 5053.0}, {3.4e-4, 4611.0}};
  result.phases = {{solver::PhaseKind::kCompression, 0.0, 6.8e-5},
                   {solver::PhaseKind::kRestitution, 6.8e-5, 5.5e-4}};
  result.energy = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0};
  result.errors = {1, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08};
  result.solver = {"", 4e-6, 138, 3e-4, ""};
  return result;
}

TEST(PointResultTest, AResultIsTheSameAfterEncodingAndDecoding) {
  const auto sent = distinct_result();
  PointResult message;
  ASSERT_TRUE(decode(encode(to_message(42, sent)), message));
  EXPECT_EQ(fault_of(message), "");
  const auto received = from_message(message);
  for (const auto& field : solver::result_fields()) {
    if (const auto* number = std::get_if<solver::Member<double>>(&field.value)) {
      ASSERT_EQ(number->of(received) == nullptr, number->of(sent) == nullptr) << field.name;
      EXPECT_TRUE(number->of(sent) == nullptr || *number->of(received) == *number->of(sent))
          << field.name;
    }
  }
  EXPECT_EQ(received.phases.at(1).kind, solver::PhaseKind::kRestitution);
  EXPECT_EQ(received.phases.at(1).t0_s, 6.8e-5);
  EXPECT_FALSE(received.peaks.at(1).major);
  EXPECT_TRUE(received.peaks.at(2).major);
  EXPECT_EQ(encode(to_message(42, received)), encode(message)) << "the remaining members are equal";
}

TEST(PointResultTest, MissingOutputsStayMissing) {
  auto lacking = distinct_result();
  lacking.margin.reset();
  lacking.margin_event.reset();
  lacking.errors.mode_same.reset();
  const PointResult message = to_message(0, lacking);
  EXPECT_EQ(fault_of(message), "");
  const auto received = from_message(message);
  EXPECT_FALSE(received.margin.has_value());
  EXPECT_FALSE(received.margin_event.has_value());
  EXPECT_FALSE(received.errors.mode_same.has_value());
  EXPECT_EQ(received.stick_total_s, 7e-5);
  EXPECT_EQ(received.major_mode, "SC SR");
}

TEST(PointResultTest, AFailedPointAlwaysHasAReason) {
  EXPECT_EQ(failed_point(7, "the contact does not end").error(), "the contact does not end");
  EXPECT_EQ(failed_point(7, "the contact does not end").point(), 7U);
  EXPECT_EQ(failed_point(7, "").error(), "unknown");
  EXPECT_EQ(fault_of(failed_point(7, "")), "");
}

TEST(PointResultTest, ANumberThatCannotBeStoredIsDetectedInEveryField) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const PointResult sound = to_message(0, distinct_result());
  for (const auto& [number, expected] : {std::pair{kNotANumber, "is not a finite number"},
                                         {kInfinity, "is not a finite number"},
                                         {1e308, "too large to be stored"},
                                         {-1.1e100, "too large to be stored"}}) {
    int i = 0;
    solver::for_each_sent<double>(
        [&, number = number, expected = expected](const auto& field, const auto& member) {
          PointResult message = sound;
          message.set_reals(i++, number);
          const bool is_absent = member.may_be_absent && std::isnan(number);
          EXPECT_THAT(fault_of(message), HasSubstr(is_absent ? "" : expected)) << field.name;
        });
    for (auto* (PointResult::*list)() :
         {&PointResult::mutable_peaks, &PointResult::mutable_ft_peaks,
          &PointResult::mutable_phase_ends_s, &PointResult::mutable_stick_intervals,
          &PointResult::mutable_reaction_peaks}) {
      PointResult message = sound;
      (message.*list)()->Set(1, number);
      EXPECT_THAT(fault_of(message), HasSubstr(expected));
    }
  }
  PointResult largest = sound;
  largest.set_reals(0, 1e100);
  largest.mutable_peaks()->Set(1, -1e100);
  EXPECT_EQ(fault_of(largest), "");
}

TEST(PointResultTest, AListHasAtMost4096ElementsAndAResultAMebibyte) {
  PointResult message = to_message(0, distinct_result());
  message.clear_peaks();
  message.clear_major_peaks();
  message.mutable_peaks()->Resize(3 * 4096, 1e-5);
  EXPECT_EQ(fault_of(message), "");
  message.mutable_peaks()->Resize(3 * 100'000, 1e-5);
  EXPECT_THAT(fault_of(message), HasSubstr("bytes; at most 1048576"));
  message.mutable_peaks()->Resize(3 * 4097, 1e-5);
  EXPECT_EQ(fault_of(message), "the worker sent 4097 peaks; at most 4096 are allowed");
  PointResult failed = failed_point(0, "why");
  failed.mutable_major_peaks()->Resize(1 << 20, 300);
  EXPECT_THAT(fault_of(failed), HasSubstr("at most 1048576 are allowed"));
}

TEST(PointResultTest, InvalidResultsAreRefused) {
  const PointResult sound = to_message(0, distinct_result());
  PointResult shorter = sound;
  shorter.mutable_reals()->RemoveLast();
  EXPECT_THAT(fault_of(shorter), HasSubstr("31 real numbers"));
  PointResult silent = sound;
  silent.clear_texts();
  EXPECT_THAT(fault_of(silent), HasSubstr("0 texts"));
  PointResult odd = sound;
  odd.add_ft_peaks(1.0);
  EXPECT_THAT(fault_of(odd), HasSubstr("wrong length"));
  PointResult no_such_peak = sound;
  no_such_peak.add_major_peaks(3);  // it has three
  EXPECT_THAT(fault_of(no_such_peak), HasSubstr("major peak"));
  PointResult verbose = sound;
  verbose.set_texts(0, std::string(65537, 'S'));
  EXPECT_THAT(fault_of(verbose), HasSubstr("too long"));
  EXPECT_THAT(fault_of(failed_point(0, std::string(65537, 'x'))), HasSubstr("too long"));
  EXPECT_NE(fault_of(PointResult()), "") << "an empty result is invalid";
}

}  // namespace
}  // namespace oblique::protocol
