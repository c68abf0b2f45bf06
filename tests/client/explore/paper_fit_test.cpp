#include "client/explore/paper_fit.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/paper/paper_comparison.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

TEST(PaperFit, OfWhatThePaperDoesNotPrintEndsWithinOnePercentOfThePreset) {
  std::vector<PaperFitStep> steps;
  const auto end = fit_paper(published_table(), solver::preset("printed"),
                             [&](const PaperFitStep& step) { steps.push_back(step); });
  const auto preset = solver::preset("paper");
  for (const auto name : kFittedKeys) {
    const auto& key = *solver::find_model_key(name);
    EXPECT_NEAR(key.get(end.model) / key.get(preset), 1.0, 0.01) << name;
  }
  EXPECT_EQ(end.differences.size(), 63U);
  EXPECT_EQ(end.summary.missing, 0U);
  // The numbers are printed with two or three digits; their rounding alone gives 0.6 % rms.
  EXPECT_LT(end.summary.rms_percent, 0.6);
  ASSERT_GT(steps.size(), 1U);
  EXPECT_EQ(steps.front().iteration, 0);
  EXPECT_GT(steps.front().summary.rms_percent, 3.0);
  for (std::size_t i = 1; i < steps.size(); ++i) {
    EXPECT_LE(steps[i].summary.rms_percent, steps[i - 1].summary.rms_percent);
  }
}

}  // namespace
}  // namespace oblique::client
