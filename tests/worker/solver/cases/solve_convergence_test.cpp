#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/worker/solver/cases/shared_fingers.h"

namespace oblique::solver {
namespace {

TEST(SolveConvergence, DefaultStepOnTheConvergedMeshGivesTheKnownConvergedImpacts) {
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
