#include "worker/solver/fast/lane_stepper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/motion.h"

namespace oblique::solver {
namespace {

struct Shape {
  std::size_t links;
  int elements_per_link;
};

/// Returns a chain of a given shape whose other parameters depend on `i`.
Chain chain_number(std::size_t i, const Shape& shape) {
  const double more = static_cast<double>(i);
  ModelParameters model = preset("paper");
  model.elements_per_link = shape.elements_per_link;
  model.lengths_m.assign(shape.links, 0.4);
  model.lengths_m.front() *= 1.0 + 0.03 * more;
  model.E_Pa *= 1.0 - 0.02 * more;
  model.A_m2 *= 1.0 + 0.01 * more;
  model.I_m4 *= 1.0 + 0.05 * more;
  model.rho_kg_m3 *= 1.0 - 0.04 * more;
  model.tip_mass_kg = 0.1 * more;
  return Chain(model);
}

constexpr double kStep_s = 1e-7;

AffineContactForce<double> push_at_tip(const Chain& chain) {
  AffineContactForce<double> force;
  force.fn0 = 500.0;
  force.ft0 = -200.0;
  force.k_nn = 2.7e7;
  force.k_tt = 2e7;
  force.x0 = chain.length_m();
  return force;
}

/// Steps chains in the lanes of one kernel and returns their states.
class Steps {
 public:
  Steps(const Chain& shape, const LaneKernel& kernel)
      : stepper_(shape.tables(), kernel), accept_(kernel.lanes, 1) {}

  /// Loads a moving chain with a force at its tip into a lane.
  void load(std::size_t lane, const Chain& chain) {
    ChainState state = chain.at_rest();
    state.v.row(1).setLinSpaced(0.0, -1.0);
    stepper_.load(lane, chain.tables(), state.q.data(), state.v.data());
    stepper_.set_step(lane, kStep_s);
    stepper_.set_force(lane, push_at_tip(chain));
  }
  void run(int steps) {
    for (int i = 0; i < steps; ++i) {
      stepper_.step();
      stepper_.settle(accept_);
    }
  }
  /// Returns state, integrals and reactions of a lane after a step.
  std::vector<double> of(std::size_t lane, const Chain& chain) const {
    const std::size_t size = 2 * chain.tables().rows;
    std::vector<double> all(2 * size);
    stepper_.store(lane, all.data(), all.data() + size);
    const ContactIntegrals<double> integrals = stepper_.integrals(lane);
    all.insert(all.end(), {integrals.impulse_n, integrals.impulse_t, integrals.work_t});
    for (std::size_t link = 0; link < chain.links(); ++link) {
      all.push_back(stepper_.mean_reactions_squared_N2()[link * stepper_.lanes() + lane]);
    }
    return all;
  }

 private:
  LaneStepper stepper_;
  std::vector<unsigned char> accept_;
};

constexpr Shape kShapes[]{{3, 4}, {3, 1}, {1, 1}, {1, 3}, {2, 16}, {64, 1}};

std::vector<Chain> chains_of(const Shape& shape, std::size_t count) {
  std::vector<Chain> chains;
  for (std::size_t i = 0; i < count; ++i) {
    chains.push_back(chain_number(i, shape));
  }
  return chains;
}

TEST(LaneStepper, ALaneHasTheSameBitsBesideOtherChainsAndBesideEqualChains) {
  for (const LaneKernel& kernel : runnable_lane_kernels()) {
    for (const Shape& shape : kShapes) {
      SCOPED_TRACE(testing::Message() << kernel.name << ", links " << shape.links);
      const auto chains = chains_of(shape, kernel.lanes);
      Steps mixed(chains[0], kernel);
      for (std::size_t lane = 0; lane < kernel.lanes; ++lane) {
        mixed.load(lane, chains[lane]);
      }
      mixed.run(20);
      for (std::size_t lane = 0; lane < kernel.lanes; ++lane) {
        Steps alone(chains[0], kernel);
        alone.load(0, chains[lane]);
        alone.run(20);
        EXPECT_EQ(mixed.of(lane, chains[lane]), alone.of(0, chains[lane])) << "lane " << lane;
      }
    }
  }
}

/// Returns state and integrals of the reference, ExplicitMotion, after `steps` steps.
std::vector<double> by_reference(const Chain& chain, int steps) {
  const ExplicitMotion motion(chain);
  ChainState state = chain.at_rest();
  state.v.row(1).setLinSpaced(0.0, -1.0);
  const AffineContactForce<double> force = push_at_tip(chain);
  ContactIntegrals<double> integrals;
  ChainState next;
  for (int i = 0; i < steps; ++i) {
    integrals = motion.step(state, force, kStep_s, next);
    std::swap(state, next);
  }
  std::vector<double> all(state.q.data(), state.q.data() + state.q.size());
  all.insert(all.end(), state.v.data(), state.v.data() + state.v.size());
  all.insert(all.end(), {integrals.impulse_n, integrals.impulse_t, integrals.work_t});
  return all;
}

TEST(LaneStepper, AgreesWithTheReferenceToRounding) {
  for (const LaneKernel& kernel : runnable_lane_kernels()) {
    for (const Shape& shape : kShapes) {
      SCOPED_TRACE(testing::Message() << kernel.name << ", links " << shape.links);
      const auto chains = chains_of(shape, kernel.lanes);
      for (const bool side_by_side : {false, true}) {
        Steps steps(chains[0], kernel);
        for (std::size_t lane = 0; lane < kernel.lanes; ++lane) {
          steps.load(lane, chains[side_by_side ? lane : 1]);
        }
        steps.run(20);
        const Chain& last = chains[side_by_side ? kernel.lanes - 1 : 1];
        const auto expected = by_reference(last, 20);
        const auto actual = steps.of(kernel.lanes - 1, last);
        for (std::size_t i = 0; i < expected.size(); ++i) {
          // The acceleration of a slope has a rounding error of about 2e-16 E/(rho l^3), which is
          // 4e-4 1/s^2 at l = 25 mm. In the 2 us of these steps, this error changes rates by 1e-9.
          // Rates are of order 1.
          EXPECT_NEAR(actual[i], expected[i], 1e-8 * std::max(1.0, std::abs(expected[i]))) << i;
        }
      }
    }
  }
}

TEST(LaneStepper, SwitchingBetweenSharedAndOwnConstantsLeavesTheResultsUnchanged) {
  const LaneKernel& kernel = runnable_lane_kernels().front();
  const auto chains = chains_of({3, 4}, 2);
  Steps changing(chains[0], kernel);
  changing.load(0, chains[0]);
  changing.run(5);
  changing.load(1, chains[1]);
  changing.run(5);
  changing.load(1, chains[0]);
  changing.run(5);
  changing.load(1, chains[1]);
  changing.run(5);
  Steps alone(chains[0], kernel);
  alone.load(0, chains[0]);
  alone.run(20);
  EXPECT_EQ(changing.of(0, chains[0]), alone.of(0, chains[0]));
}

}  // namespace
}  // namespace oblique::solver
