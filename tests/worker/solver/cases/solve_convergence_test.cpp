#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/worker/solver/cases/known_impacts.h"
#include "tests/worker/solver/cases/shared_fingers.h"

namespace oblique::solver {
namespace {

/// Largest errors over the known impacts on a coarse mesh, in all of which the order of states is
/// the same at every step used here.
struct Errors {
  double closure = 0.0;
  double peaks = 0.0;
  double duration = 0.0;
  double slide = 0.0;
  double velocity_m_s = 0.0;
};

class SolveConvergence : public testing::Test {
 protected:
  static constexpr double kCoarse_s = 8.6e-6;
  static constexpr double kSmallestRatio = 11.3;  // order 3.5

  static std::vector<CaseResult> solved(double dt_s) {
    ModelParameters model = coarse_model(2);
    model.dt_s = dt_s;
    const Finger finger{model};
    std::vector<CaseResult> results;
    for (const KnownImpact& known : known_impacts()) {
      results.push_back(finger.solve(known.H_m, known.mu, known.e_star));
    }
    return results;
  }

  static Errors errors(const std::vector<CaseResult>& results,
                       const std::vector<CaseResult>& exact) {
    Errors largest;
    const auto raise = [](double& value, double error) { value = std::max(value, error); };
    for (std::size_t i = 0; i < results.size(); ++i) {
      const CaseResult& a = results[i];
      const CaseResult& b = exact[i];
      EXPECT_EQ(a.mode, b.mode);
      EXPECT_EQ(a.peaks.size(), b.peaks.size());
      for (std::size_t p = 0; p < std::min(a.peaks.size(), b.peaks.size()); ++p) {
        raise(largest.peaks, std::abs(a.peaks[p].fn_N / b.peaks[p].fn_N - 1.0));
      }
      raise(largest.closure, a.energy.closure);
      raise(largest.duration, std::abs(a.duration_s / b.duration_s - 1.0));
      raise(largest.slide, std::abs(a.slide_m / b.slide_m - 1.0));
      raise(largest.velocity_m_s,
            std::hypot(a.vt_out_m_s - b.vt_out_m_s, a.vn_out_m_s - b.vn_out_m_s));
    }
    return largest;
  }
};

TEST_F(SolveConvergence, EverythingIsOfOrderFourThoughEventsLieInsideSteps) {
  const auto exact = solved(kCoarse_s / 32.0);
  const Errors coarse = errors(solved(kCoarse_s), exact);
  const Errors middle = errors(solved(kCoarse_s / 2.0), exact);
  const Errors fine = errors(solved(kCoarse_s / 4.0), exact);
  const auto expect_order_four = [](double a, double b, double c) {
    EXPECT_GT(a / b, kSmallestRatio);
    EXPECT_GT(b / c, kSmallestRatio);
  };
  expect_order_four(coarse.closure, middle.closure, fine.closure);
  expect_order_four(coarse.peaks, middle.peaks, fine.peaks);
  expect_order_four(coarse.duration, middle.duration, fine.duration);
  expect_order_four(coarse.slide, middle.slide, fine.slide);
  expect_order_four(coarse.velocity_m_s, middle.velocity_m_s, fine.velocity_m_s);
}

TEST_F(SolveConvergence, DefaultStepOnTheConvergedMeshGivesTheKnownConvergedImpacts) {
  // n = 16, 32 and 48 agree to 2 N.
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
