#include "worker/solver/fast/lane_contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/worker/solver/cases/same_bits.h"
#include "tests/worker/solver/cases/shared_fingers.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/solve_contact.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {
namespace {

/// A coarse model with its fall, as input of solve_contacts().
struct Coarse {
  ModelParameters model = coarse_model();
  Chain chain{model};
  StepChoice steps{chain, model};
  std::shared_ptr<const Fall> fall = solve_stepped_fall(chain, steps.fall_s());

  ContactCase contact(std::uint64_t tag, std::uint64_t group, double mu, double e_star,
                      const ChainState& touch) const {
    return {tag,   group, &chain, {model.k_N_m, model.eta2, mu, e_star}, steps.contact(e_star),
            &touch};
  }
};

const Coarse& coarse() {
  static const Coarse one;
  return one;
}

std::map<std::uint64_t, Outcome> solved(
    const std::vector<ContactCase>& cases,
    const LaneKernel& kernel = runnable_lane_kernels().front()) {
  std::map<std::uint64_t, Outcome> outcomes;
  std::size_t next = 0;
  solve_contacts(
      coarse().chain,
      [&]() -> std::optional<ContactCase> {
        return next < cases.size() ? std::optional(cases[next++]) : std::nullopt;
      },
      [&](Outcome&& outcome) {
        const std::uint64_t tag = outcome.number;
        const bool is_new = outcomes.emplace(tag, std::move(outcome)).second;
        EXPECT_TRUE(is_new) << "case " << tag << " was delivered twice";
      },
      {}, kernel);
  return outcomes;
}

/// Returns models whose chains differ but have one shape. The last model differs from the first
/// only in k.
const std::vector<std::unique_ptr<Coarse>>& unlike_models() {
  static const auto all = [] {
    std::vector<ModelParameters> models(5, coarse_model());
    models[1].E_Pa *= 0.8;
    models[1].tip_mass_kg = 0.2;
    models[2].lengths_m = {0.45, 0.4, 0.35};
    models[2].I_m4 *= 1.3;
    models[3].rho_kg_m3 *= 0.9;
    models[3].A_m2 *= 1.1;
    models[4].k_N_m *= 0.7;  // its chain equals that of the first model
    std::vector<std::unique_ptr<Coarse>> list;
    for (const ModelParameters& model : models) {
      list.emplace_back(new Coarse{model});  // not movable, because members point to each other
    }
    return list;
  }();
  return all;
}

TEST(LaneContacts, ACaseHasTheSameBitsBesideCasesOfOtherChains) {
  std::vector<ChainState> touches;
  for (const auto& model : unlike_models()) {
    touches.push_back(model->fall->state_at(0.9));
  }
  std::vector<ContactCase> cases;
  for (const double mu : {0.0, 0.4, 1.4}) {
    for (std::size_t i = 0; i < touches.size(); ++i) {
      for (const double e_star : {1.0, 0.5}) {
        cases.push_back(
            unlike_models()[i]->contact(cases.size(), cases.size() / 2, mu, e_star, touches[i]));
      }
    }
  }
  for (const LaneKernel& kernel : runnable_lane_kernels()) {
    const auto together = solved(cases, kernel);
    ASSERT_EQ(together.size(), cases.size());
    for (const ContactCase& one : cases) {
      SCOPED_TRACE(std::string(kernel.name) + ", case " + std::to_string(one.number));
      const auto alone = solved({one}, kernel);
      ASSERT_TRUE(alone.at(one.number).result) << alone.at(one.number).error;
      ASSERT_TRUE(together.at(one.number).result) << together.at(one.number).error;
      expect_same_bits(*together.at(one.number).result, *alone.at(one.number).result);
    }
  }
}

TEST(LaneContacts, WhenASharedContactFailsEachOfItsCasesFailsAndNoOther) {
  const Coarse& other = *unlike_models()[2];
  const ChainState sound = other.fall->state_at(0.9);
  ChainState broken = coarse().fall->state_at(0.9);
  broken.v(0, coarse().chain.tip_row()) = std::numeric_limits<double>::quiet_NaN();
  std::vector<ContactCase> cases;
  for (const std::uint64_t group : {1U, 2U, 3U}) {
    for (const double e_star : {1.0, 0.9, 0.8, 0.7}) {
      cases.push_back(coarse().contact(cases.size(), group, 0.4, e_star, broken));
    }
    cases.push_back(other.contact(cases.size(), 10 + group, 0.4, 0.8, sound));
  }
  const auto outcomes = solved(cases);
  ASSERT_EQ(outcomes.size(), cases.size());
  const auto alone = solved({cases[4]});
  for (const ContactCase& one : cases) {
    const Outcome& outcome = outcomes.at(one.number);
    if (one.touch == &broken) {
      EXPECT_FALSE(outcome.result);
      EXPECT_NE(outcome.error.find("diverged"), std::string::npos);
    } else {
      ASSERT_TRUE(outcome.result) << outcome.error;
      expect_same_bits(*outcome.result, *alone.at(4).result);
    }
  }
}

TEST(LaneContacts, AChainMayBeDestroyedAfterItsCaseIsDone) {
  std::vector<std::unique_ptr<Chain>> chains;
  const ChainState touch = coarse().fall->state_at(0.5);
  std::size_t done = 0;
  solve_contacts(
      coarse().chain,
      [&]() -> std::optional<ContactCase> {
        if (chains.size() == 40) {
          return std::nullopt;
        }
        ModelParameters model = coarse_model();
        model.E_Pa *= 1.0 + 0.01 * static_cast<double>(chains.size() % 5);
        chains.push_back(std::make_unique<Chain>(model));
        ContactCase one = coarse().contact(chains.size() - 1, chains.size(), 0.4, 0.8, touch);
        one.chain = chains.back().get();
        return one;
      },
      [&](Outcome&& outcome) {
        EXPECT_TRUE(outcome.result) << outcome.error;
        chains[outcome.number].reset();
        ++done;
      });
  EXPECT_EQ(done, chains.size());
}

TEST(LaneContacts, PeaksOfReactionsFromMomentaAgreeWithThoseFromAccelerations) {
  const ExplicitMotion motion(coarse().chain);
  std::vector<ChainState> touches;
  for (const double H_m : {0.01, 0.5, 0.9, 1.04}) {
    touches.push_back(coarse().fall->state_at(H_m));
  }
  std::vector<ContactCase> cases;
  for (const ChainState& touch : touches) {
    for (const double mu : {0.0, 0.4, 1.4}) {
      for (const double e_star : {1.0, 0.6, 0.1}) {
        ContactCase one = coarse().contact(cases.size(), cases.size() / 3, mu, e_star, touch);
        // These steps resolve the fast vibrations of a link with a single element.
        one.steps = {0.25 * one.steps.compression_s, 0.25 * one.steps.restitution_s};
        cases.push_back(one);
      }
    }
  }
  const auto outcomes = solved(cases);
  for (const ContactCase& one : cases) {
    SCOPED_TRACE(one.number);
    const CaseResult exact = solve_contact(motion, one.parameters, one.steps, *one.touch, {});
    ASSERT_TRUE(outcomes.at(one.number).result);
    const auto& peaks = outcomes.at(one.number).result->reaction_peaks;
    ASSERT_EQ(peaks.size(), 3U);
    for (std::size_t joint = 0; joint < peaks.size(); ++joint) {
      const ReactionPeak& known = exact.reaction_peaks[joint];
      EXPECT_NEAR(peaks[joint].force_N, known.force_N, 1e-3 * known.force_N) << joint;
    }
  }
}

}  // namespace
}  // namespace oblique::solver
