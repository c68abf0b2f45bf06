// The fall in a trace, by all ways to fall.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/worker/solver/cases/shared_fingers.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::solver {
namespace {

struct TraceWithFall {
  CaseResult result;
  std::vector<TraceRow> fall;
  std::vector<TraceRow> contact;
};

TraceWithFall traced_with_fall(const Finger& finger, bool with_fall = true) {
  TraceWithFall traced;
  const auto take = [&traced](const TraceRow& row) {
    (row.state == kFalling ? traced.fall : traced.contact).push_back(row);
    EXPECT_TRUE(row.state != kFalling || traced.contact.empty()) << "the fall comes first";
  };
  traced.result = finger.solve(0.9, 0.9, 0.7, {take, true, with_fall});
  return traced;
}

/// Explicit steps, collocation, and steps of generalized-alpha.
const std::vector<Finger>& fingers() {
  static const std::vector<Finger> list = [] {
    ModelParameters by_steps = coarse_model();
    by_steps.integrator = Integrator::kGeneralizedAlpha;
    by_steps.dt_fall_s = 20e-6;
    by_steps.dt_s = 1e-6;
    return std::vector<Finger>{coarse_finger(), Finger{coarse_model(8)}, Finger{by_steps}};
  }();
  return list;
}

const std::vector<TraceWithFall>& falls() {
  static const std::vector<TraceWithFall> list = [] {
    std::vector<TraceWithFall> each;
    for (const Finger& finger : fingers()) {
      each.push_back(traced_with_fall(finger));
    }
    return each;
  }();
  return list;
}

TEST(FallOfATrace, GoesFromReleaseToTouchInEvenTimes) {
  for (const TraceWithFall& t : falls()) {
    ASSERT_EQ(t.fall.size(), static_cast<std::size_t>(kFallRows));
    const TraceRow& release = t.fall.front();
    EXPECT_EQ(release.t_s, -t.result.fall_time_s);
    EXPECT_EQ(release.y_m, 0.0);
    EXPECT_NEAR(release.x_m, 1.2, 1e-12);
    EXPECT_EQ(release.vn_m_s, 0.0);
    EXPECT_EQ(release.kinetic_J, 0.0);
    const double apart_s = t.result.fall_time_s / (kFallRows - 1);
    for (std::size_t i = 1; i < t.fall.size(); ++i) {
      EXPECT_NEAR(t.fall[i].t_s, t.fall[i - 1].t_s + apart_s, 1e-4 * apart_s) << i;
      EXPECT_LT(t.fall[i].y_m, t.fall[i - 1].y_m) << "the tip does not turn";
    }
  }
}

TEST(FallOfATrace, EndsWithTheInstantThatTheContactBeginsWith) {
  for (const TraceWithFall& t : falls()) {
    TraceRow last = t.fall.back();
    EXPECT_EQ(last.t_s, 0.0);
    EXPECT_EQ(last.vP_m_s, last.vt_m_s) << "P goes along with the tip until it is held";
    last.vP_m_s = t.contact.front().vP_m_s;
    std::vector<double> before;
    std::vector<double> after;
    append_numbers(last, before);
    append_numbers(t.contact.front(), after);
    EXPECT_EQ(before, after);
  }
}

TEST(FallOfATrace, NothingActsAtTheTipAndNothingIsDeformedThere) {
  for (const TraceWithFall& t : falls()) {
    for (const TraceRow& row : t.fall) {
      EXPECT_EQ(row.fn_N, 0.0);
      EXPECT_EQ(row.ft_N, 0.0);
      EXPECT_EQ(row.uy_m, 0.0);
      EXPECT_EQ(row.ux_m, 0.0);
      EXPECT_EQ(row.xP_m, row.x_m);
    }
  }
}

TEST(FallOfATrace, LeavesRowsOfTheContactAndResultAsTheyAreWithoutIt) {
  for (std::size_t i = 0; i < fingers().size(); ++i) {
    const TraceWithFall without = traced_with_fall(fingers()[i], false);
    EXPECT_TRUE(without.fall.empty());
    ASSERT_EQ(without.contact.size(), falls()[i].contact.size());
    for (std::size_t row = 0; row < without.contact.size(); ++row) {
      std::vector<double> numbers;
      std::vector<double> with_fall;
      append_numbers(without.contact[row], numbers);
      append_numbers(falls()[i].contact[row], with_fall);
      ASSERT_EQ(numbers, with_fall) << row;
      ASSERT_EQ(without.contact[row].state, falls()[i].contact[row].state);
    }
    EXPECT_EQ(without.result.duration_s, falls()[i].result.duration_s);
    EXPECT_EQ(without.result.fn_peak_N, falls()[i].result.fn_peak_N);
    EXPECT_EQ(without.result.mode, falls()[i].result.mode);
  }
}

}  // namespace
}  // namespace oblique::solver
