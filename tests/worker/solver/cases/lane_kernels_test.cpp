#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <sstream>
#include <vector>

#include <gtest/gtest.h>

#include "worker/solver/fast/lane_contacts.h"
#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {
namespace {

struct Case {
  double H_m;
  double mu;
  double e_star;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const double H_m : {0.2, 0.55, 0.9, 1.1}) {
    for (const double mu : {0.0, 0.3, 0.8, 1.4}) {
      for (const double e_star : {0.3, 0.7, 1.0}) {
        all.push_back({H_m, mu, e_star});
      }
    }
  }
  return all;
}

std::vector<CaseResult> solve_by(const LaneKernel& kernel) {
  const ModelParameters model = preset("paper");
  const Chain chain(model);
  const StepChoice steps(chain, model);
  const auto fall = solve_stepped_fall(chain, steps.fall_s());
  const std::vector<Case> all = cases();
  std::vector<CaseResult> results(all.size());
  ChainState touch;
  std::size_t next = 0;
  solve_contacts(
      chain,
      [&]() -> std::optional<ContactCase> {
        if (next == all.size()) {
          return std::nullopt;
        }
        const Case& c = all[next];
        touch = fall->state_at(c.H_m);
        const std::size_t number = next++;
        return ContactCase{number,
                           number / 3,
                           &chain,
                           {model.k_N_m, model.eta2, c.mu, c.e_star},
                           steps.contact(c.e_star),
                           &touch};
      },
      [&](Outcome&& outcome) {
        ASSERT_TRUE(outcome.result) << outcome.error;
        results.at(outcome.number) = std::move(*outcome.result);
      },
      {}, kernel);
  return results;
}

/// Instruction sets differ in the number of lanes, and in whether a multiply-add rounds once or
/// twice. A contact amplifies rounding errors, most of all if a state begins at a grazing event.
TEST(LaneKernels, InstructionSetsDifferByAmplifiedRoundingOnly) {
  const auto kernels = runnable_lane_kernels();
  const std::vector<CaseResult> expected = solve_by(kernels.back());
  double largest = 0.0;
  for (const LaneKernel& kernel : kernels.first(kernels.size() - 1)) {
    const std::vector<CaseResult> results = solve_by(kernel);
    for (std::size_t i = 0; i < results.size(); ++i) {
      EXPECT_EQ(results[i].mode, expected[i].mode) << kernel.name << " case " << i;
      const auto compare = [&](double a, double b) {
        largest = std::max(largest, std::abs(a - b) / std::max(std::abs(b), 1e-12));
      };
      compare(results[i].fn_peak_N, expected[i].fn_peak_N);
      compare(results[i].ft_peak_N, expected[i].ft_peak_N);
      compare(results[i].duration_s, expected[i].duration_s);
      compare(results[i].slide_m, expected[i].slide_m);
      compare(results[i].stick_total_s, expected[i].stick_total_s);
    }
  }
  std::ostringstream text;
  text << largest;
  RecordProperty("largest_relative_difference", text.str());
  EXPECT_LT(largest, 1e-8);
}

}  // namespace
}  // namespace oblique::solver
