#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "worker/solver/reference/contact_record.h"

namespace oblique::solver {
namespace {

using testing::ElementsAreArray;

struct Case {
  const char* what;
  std::vector<double> fn_N;
  std::vector<bool> survives;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> table{
      {"nothing", {}, {}},
      {"one peak", {100}, {true}},
      {"two deep peaks", {100, 50, 90}, {true, true, true}},
      {"exactly 5 % apart stays", {100, 45, 50}, {true, true, true}},
      {"just less goes", {100, 45.1, 50}, {true, false, false}},
      {"ripple on the way up", {40, 37, 100}, {false, false, true}},
      {"ripple on the way down", {100, 30, 33}, {true, false, false}},
      {"ripple on the way down, then a peak",
       {100, 30, 33, 10, 60},
       {true, false, false, true, true}},
      {"ripple at the foot of a later peak",
       {100, 20, 23, 21, 80},
       {true, true, false, false, true}},
      {"the shallowest goes first", {100, 50, 54, 51, 90}, {true, true, false, false, true}},
      {"two ripples on one slope", {100, 70, 72, 40, 43}, {true, false, false, false, false}},
      {"all ripples leave the largest", {98, 96, 100, 97, 99}, {false, false, true, false, false}},
  };
  return table;
}

TEST(WithoutRipples, KeepsWhatIsAtLeastFivePercentOfTheLargestPeakApart) {
  for (const Case& c : cases()) {
    EXPECT_THAT(without_ripples(c.fn_N), ElementsAreArray(c.survives)) << c.what;
  }
}

TEST(WithoutRipples, WhatSurvivesAlternatesBeginsAndEndsWithAPeakAndKeepsTheLargest) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<double> fn_N{uniform(generator)};
    const int ripples = trial % 8;
    for (int i = 0; i < ripples; ++i) {
      fn_N.push_back(fn_N.back() * uniform(generator));
      fn_N.push_back(fn_N.back() + uniform(generator) * (i % 2 == 0 ? 0.05 : 1.0));
    }
    const auto survives = without_ripples(fn_N);
    const double largest = *std::max_element(fn_N.begin(), fn_N.end());
    std::vector<double> left;
    bool expect_peak = true;
    for (std::size_t i = 0; i < fn_N.size(); ++i) {
      if (survives[i]) {
        EXPECT_EQ(i % 2 == 0, expect_peak) << "peaks and valleys alternate";
        expect_peak = !expect_peak;
        left.push_back(fn_N[i]);
      }
    }
    ASSERT_EQ(left.size() % 2, 1U);
    EXPECT_EQ(*std::max_element(left.begin(), left.end()), largest);
    for (std::size_t i = 1; i < left.size(); ++i) {
      EXPECT_GE(std::abs(left[i] - left[i - 1]), 0.05 * largest);
    }
  }
}

}  // namespace
}  // namespace oblique::solver
