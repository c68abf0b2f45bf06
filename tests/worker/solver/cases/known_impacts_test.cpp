#include "tests/worker/solver/cases/known_impacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/worker/solver/cases/shared_fingers.h"

namespace oblique::solver {
namespace {

/// Relative error allowed for the default step, in addition to the rounding of the known value.
constexpr double kRelative = 3e-5;
constexpr double kForceDigit_N = 0.005;
constexpr double kTimeDigit_us = 0.0005;
constexpr double kStickDigit_us = 0.005;
/// Errors allowed in duration and stick (kRelativeTime) and in the ends of phases
/// (kRelativeInstant), divided by the duration. Minima of the force are flat. So the default
/// tolerance of 1e-5 moves the end of a phase by up to 3.5 ns.
constexpr double kRelativeTime = 3e-6;
constexpr double kRelativeInstant = 6e-6;
constexpr double kSlideDigit_mm = 0.000005;

std::string name_of(const KnownImpact& known) {
  return "H = " + std::to_string(known.H_m) + ", mu = " + std::to_string(known.mu) +
         ", e* = " + std::to_string(known.e_star);
}

const std::vector<CaseResult>& results() {
  static const std::vector<CaseResult> solved = [] {
    std::vector<CaseResult> list;
    for (const KnownImpact& known : known_impacts()) {
      list.push_back(paper_finger().solve(known.H_m, known.mu, known.e_star));
    }
    return list;
  }();
  return solved;
}

template <class Check>
void for_each_impact(const Check& check) {
  for (std::size_t i = 0; i < known_impacts().size(); ++i) {
    SCOPED_TRACE(name_of(known_impacts()[i]));
    check(known_impacts()[i], results()[i]);
  }
}

TEST(KnownImpacts, HaveTheKnownForcePeaks) {
  for_each_impact([](const KnownImpact& known, const CaseResult& result) {
    ASSERT_EQ(result.peaks.size(), known.fn_peaks_N.size());
    double largest_N = 0.0;
    for (std::size_t i = 0; i < result.peaks.size(); ++i) {
      const double fn_N = known.fn_peaks_N[i];
      EXPECT_NEAR(result.peaks[i].fn_N, fn_N, kRelative * fn_N + kForceDigit_N);
      largest_N = std::max(largest_N, result.peaks[i].fn_N);
    }
    EXPECT_EQ(result.fn_peak_N, largest_N);
    if (known.ft_peak_N > 0.0) {
      EXPECT_NEAR(result.ft_peak_N, known.ft_peak_N, kRelative * known.ft_peak_N + kForceDigit_N);
    }
  });
}

TEST(KnownImpacts, HaveTheKnownDurations) {
  for_each_impact([](const KnownImpact& known, const CaseResult& result) {
    EXPECT_NEAR(1e6 * result.duration_s, known.contact_us,
                kRelativeTime * known.contact_us + kTimeDigit_us);
    EXPECT_NEAR(1e6 * result.stick_total_s, known.stick_us,
                kRelativeTime * known.stick_us + kStickDigit_us);
    ASSERT_EQ(result.phases.size(), known.phases_us.size());
    for (std::size_t i = 0; i < result.phases.size(); ++i) {
      EXPECT_NEAR(1e6 * (result.phases[i].t1_s - result.phases[i].t0_s), known.phases_us[i],
                  kRelativeInstant * known.contact_us + kTimeDigit_us);
    }
  });
}

TEST(KnownImpacts, HaveAllKnownDigitsOfThePhasesAtATightTolerance) {
  ModelParameters model = preset("paper");
  model.tolerance = 1e-7;
  const Finger exact{model};
  for_each_impact([&exact](const KnownImpact& known, const CaseResult&) {
    const CaseResult result = exact.solve(known.H_m, known.mu, known.e_star);
    ASSERT_EQ(result.phases.size(), known.phases_us.size());
    for (std::size_t i = 0; i < result.phases.size(); ++i) {
      EXPECT_NEAR(1e6 * (result.phases[i].t1_s - result.phases[i].t0_s), known.phases_us[i],
                  1e-6 * known.contact_us + kTimeDigit_us);
    }
  });
}

TEST(KnownImpacts, HaveTheKnownSlide) {
  for_each_impact([](const KnownImpact& known, const CaseResult& result) {
    if (known.slide_mm > 0.0) {
      EXPECT_NEAR(1e3 * result.slide_m, known.slide_mm,
                  kRelative * known.slide_mm + kSlideDigit_mm);
    }
  });
}

TEST(KnownImpacts, HaveThePublishedModesAndNumbersOfMajorPeaks) {
  for_each_impact([](const KnownImpact& known, const CaseResult& result) {
    EXPECT_EQ(result.mode, known.mode);
    EXPECT_EQ(result.major_mode, known.major_peaks == 3 ? "sC sR sC sR sC sR" : "SC SR sR sC sR");
    const auto major = std::count_if(result.peaks.begin(), result.peaks.end(),
                                     [](const Peak& peak) { return peak.major; });
    EXPECT_EQ(static_cast<std::size_t>(major), known.major_peaks);
  });
}

TEST(KnownImpacts, CloseTheEnergyBalanceToAMillionthOfTheExchangedWork) {
  for_each_impact(
      [](const KnownImpact&, const CaseResult& result) { EXPECT_LT(result.energy.closure, 1e-6); });
}

TEST(SolveConvergence, DefaultStepOnTheConvergedMeshGivesTheKnownConvergedImpacts) {
  // Forces on meshes of 16, 32 and 48 elements agree within 2 N.
  const Finger finger{preset("converged")};
  const CaseResult slip = finger.solve(1.0, 0.4, 1.0);
  const CaseResult stick = finger.solve(1.0, 1.2, 1.0);
  struct Known {
    const CaseResult& result;
    std::vector<double> fn_peaks_N;
    double contact_us;
  };
  for (const Known& known : {Known{slip, {4909.0, 1500.0, 2047.0}, 564.0},
                             Known{stick, {4172.0, 991.0, 1268.0, 2113.0}, 543.1}}) {
    EXPECT_NEAR(1e6 * known.result.duration_s, known.contact_us, 0.5);
    std::vector<double> major_N;
    for (const Peak& peak : known.result.peaks) {
      if (peak.major) {
        major_N.push_back(peak.fn_N);
      }
    }
    ASSERT_EQ(major_N.size(), known.fn_peaks_N.size());
    for (std::size_t i = 0; i < major_N.size(); ++i) {
      EXPECT_NEAR(major_N[i], known.fn_peaks_N[i], 3.0);
    }
  }
}

}  // namespace
}  // namespace oblique::solver
