#include "worker/solver/lanes/lane_batch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "tests/worker/solver/cases/shared_fingers.h"
#include "worker/solver/contact/solve_contact.h"
#include "worker/solver/motion/fall.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {
namespace {

/// The coarse model with its fall, as LaneBatch needs them.
struct Coarse {
  ModelParameters model = coarse_model();
  Chain chain{model};
  StepChoice steps{chain, model};
  Fall fall{chain, steps.fall_s()};

  ContactCase contact(std::uint64_t tag, std::uint64_t group, double mu, double e_star,
                      const ChainState& touch) const {
    return {tag, group, {model.k_N_m, model.eta2, mu, e_star}, steps.contact(e_star), &touch};
  }
};

const Coarse& coarse() {
  static const Coarse one;
  return one;
}

std::map<std::uint64_t, ContactOutcome> solved(const std::vector<ContactCase>& cases) {
  LaneBatch batch(coarse().chain, runnable_lane_kernels().front());
  std::map<std::uint64_t, ContactOutcome> outcomes;
  std::size_t next = 0;
  batch.solve(
      [&]() -> std::optional<ContactCase> {
        return next < cases.size() ? std::optional(cases[next++]) : std::nullopt;
      },
      [&](ContactOutcome&& outcome) {
        const std::uint64_t tag = outcome.tag;
        const bool is_new = outcomes.emplace(tag, std::move(outcome)).second;
        EXPECT_TRUE(is_new) << "case " << tag << " came twice";
      });
  return outcomes;
}

TEST(LaneBatch, FollowersOfAContactThatFailsBeforeItsFirstTurnEachGetAnOutcome) {
  const ChainState sound = coarse().fall.state_at(0.9);
  ChainState broken = sound;
  broken.v(0, coarse().chain.tip_row()) = std::numeric_limits<double>::quiet_NaN();
  std::vector<ContactCase> cases;
  for (const double e_star : {1.0, 0.9, 0.8, 0.7}) {
    cases.push_back(coarse().contact(cases.size(), 1, 0.4, e_star, broken));
  }
  cases.push_back(coarse().contact(cases.size(), 2, 0.4, 1.0, sound));
  const auto outcomes = solved(cases);
  ASSERT_EQ(outcomes.size(), cases.size());
  for (std::uint64_t tag = 0; tag < 4; ++tag) {
    EXPECT_FALSE(outcomes.at(tag).result);
    EXPECT_NE(outcomes.at(tag).error.find("diverged"), std::string::npos);
  }
  EXPECT_TRUE(outcomes.at(4).result) << outcomes.at(4).error;
}

TEST(LaneBatch, PeaksOfReactionsFromMomentaAreThoseOfTheAccelerations) {
  const ExplicitMotion motion(coarse().chain);
  std::vector<ChainState> touches;
  for (const double H_m : {0.01, 0.5, 0.9, 1.04}) {
    touches.push_back(coarse().fall.state_at(H_m));
  }
  std::vector<ContactCase> cases;
  for (const ChainState& touch : touches) {
    for (const double mu : {0.0, 0.4, 1.4}) {
      for (const double e_star : {1.0, 0.6, 0.1}) {
        ContactCase one = coarse().contact(cases.size(), cases.size() / 3, mu, e_star, touch);
        // A single element's link vibrates fast: steps that resolve it.
        one.steps = {0.25 * one.steps.compression_s, 0.25 * one.steps.restitution_s};
        cases.push_back(one);
      }
    }
  }
  const auto outcomes = solved(cases);
  for (const ContactCase& one : cases) {
    SCOPED_TRACE(one.tag);
    const CaseResult exact = solve_contact(motion, one.parameters, one.steps, *one.touch, {});
    ASSERT_TRUE(outcomes.at(one.tag).result);
    const auto& peaks = outcomes.at(one.tag).result->reaction_peaks;
    ASSERT_EQ(peaks.size(), 3U);
    for (std::size_t joint = 0; joint < peaks.size(); ++joint) {
      const ReactionPeak& known = exact.reaction_peaks[joint];
      EXPECT_NEAR(peaks[joint].force_N, known.force_N, 1e-3 * known.force_N) << joint;
    }
  }
}

}  // namespace
}  // namespace oblique::solver
