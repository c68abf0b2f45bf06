// Falls by explicit steps in lanes: the same as alone, and the same physics as steps of one number
// at a time.
#include "worker/solver/fast/lane_falls.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "worker/solver/reference/fall.h"

namespace oblique::solver {
namespace {

constexpr double kStep_s = 8e-6;

class LaneFallsTest : public testing::Test {
 protected:
  /// More chains of one link than any kernel has lanes, each with another E and length.
  LaneFallsTest() {
    for (int i = 0; i < 11; ++i) {
      ModelParameters model = preset("paper");
      model.lengths_m = {0.4 + 0.05 * i};
      model.elements_per_link = 2;
      model.E_Pa *= 1.0 - 0.05 * i;
      chains_.push_back(std::make_unique<Chain>(model));
    }
  }
  FallRequest fall(std::size_t i, double dt_s = kStep_s) const {
    return {chains_[i].get(), std::make_shared<ExplicitMotion>(*chains_[i]), dt_s, 0.0};
  }
  static void expect_same_bits(const FallSolution& a, const FallSolution& b) {
    ASSERT_TRUE(a.fall && b.fall) << a.error << b.error;
    EXPECT_GT(a.fall->largest_drop_m(), 0.3);
    EXPECT_EQ(a.fall->largest_drop_m(), b.fall->largest_drop_m());
    const ChainState one = a.fall->state_at(0.3);
    const ChainState other = b.fall->state_at(0.3);
    EXPECT_EQ(one.t_s, other.t_s);
    EXPECT_EQ(one.q, other.q);
    EXPECT_EQ(one.v, other.v);
  }

  std::vector<std::unique_ptr<Chain>> chains_;
};

TEST_F(LaneFallsTest, AFallHasTheSameBitsAloneAndInACrowd) {
  std::vector<FallRequest> falls;
  for (std::size_t i = 0; i < chains_.size(); ++i) {
    falls.push_back(fall(i));
  }
  for (const LaneKernel& kernel : runnable_lane_kernels()) {
    const auto together = solve_by_steps(falls, kernel);
    ASSERT_EQ(together.size(), falls.size());
    for (const std::size_t i : {0U, 5U, 10U}) {
      expect_same_bits(together[i], solve_by_steps(std::vector{falls[i]}, kernel).front());
    }
  }
}

TEST_F(LaneFallsTest, AgreesWithStepsOfOneNumberAtATime) {
  const auto solution = solve_by_steps(std::vector{fall(3)}).front();
  const auto alone = solve_stepped_fall(*chains_[3], kStep_s);
  ASSERT_TRUE(solution.fall) << solution.error;
  EXPECT_NEAR(solution.fall->largest_drop_m(), alone->largest_drop_m(), 1e-11);
  EXPECT_NEAR(solution.fall->state_at(0.4).t_s, alone->state_at(0.4).t_s, 1e-12);
}

TEST_F(LaneFallsTest, OneThatFailsLeavesItsNeighboursAlone) {
  const auto alone = solve_by_steps(std::vector{fall(1)});
  const auto beside = solve_by_steps(std::vector{fall(0, 1.0), fall(1), fall(2, 1e-300)});
  EXPECT_FALSE(beside[0].fall);
  EXPECT_NE(beside[0].error.find("diverged"), std::string::npos) << beside[0].error;
  EXPECT_FALSE(beside[2].fall);
  EXPECT_NE(beside[2].error.find("more than 1e+09 steps"), std::string::npos) << beside[2].error;
  expect_same_bits(beside[1], alone.front());
}

}  // namespace
}  // namespace oblique::solver
