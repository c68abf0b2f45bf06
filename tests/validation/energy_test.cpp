#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "tests/validation/both_ways.h"
#include "tests/validation/validation_table.h"

namespace oblique::validation {
namespace {

using solver::CaseResult;
using solver::ChainState;
using solver::Motion;

const std::string kBalance = "kinetic + strain + gravity + springs + losses = constant";

/// Returns the energy that is missing in the balance of a contact, divided by the exchanged work.
/// Expects that the result contains the same value.
double closure(const CaseResult& result) {
  const solver::ContactEnergy& e = result.energy;
  const double missing_J =
      e.kinetic_change_J + e.strain_change_J + e.gravity_change_J + e.friction_J + e.restitution_J;
  EXPECT_NEAR(std::abs(missing_J) / e.exchanged_J, e.closure, 1e-12);
  return std::abs(missing_J) / e.exchanged_J;
}

TEST(Energy, BalancesInThePublishedContactsWithBothIntegrators) {
  const BothWays both(solver::preset("paper"));
  double by_explicit = 0.0;
  double by_generalized_alpha = 0.0;
  for (const Point& point : kPublishedPoints) {
    by_explicit = std::max(by_explicit, closure(both.explicit_case(point, 1e-6)));
    by_generalized_alpha =
        std::max(by_generalized_alpha, closure(both.generalized_alpha_case(point, 1e-7)));
  }
  expect_at_most({"ten published contacts, explicit, 1 us: missing energy, of the exchanged work",
                  kBalance, by_explicit, 1e-6, "stated accuracy"});
  expect_at_most(
      {"ten published contacts, generalized-alpha, 0.1 us: missing energy, of the exchanged work",
       kBalance, by_generalized_alpha, 1e-6, "stated accuracy"});
}

/// Returns the change of the total energy in the fall to H = 1 m, divided by the kinetic energy at
/// the end of this fall.
double fall_drift(const Motion& motion, const solver::Fall& fall) {
  const solver::Energies before = motion.energies(motion.at_rest());
  const solver::Energies after = motion.energies(fall.state_at(1.0));
  return std::abs(after.kinetic_J + after.strain_J + after.gravity_J - before.strain_J -
                  before.gravity_J) /
         after.kinetic_J;
}

TEST(Energy, IsConservedInTheFallWithBothIntegrators) {
  const solver::ModelParameters model = solver::preset("paper");
  const solver::Chain chain(model);
  const auto generalized_alpha = std::make_shared<solver::GeneralizedAlphaMotion>(model);
  const auto one = solver::solve_stepped_fall(chain, 2.5e-6);
  const auto other =
      solver::solve_stepped_fall(generalized_alpha, 5e-6, solver::longest_fall_s(chain));
  expect_at_most({"fall to H = 1, explicit, 2.5 us: energy, of the kinetic one", kBalance,
                  fall_drift(solver::ExplicitMotion(chain), *one), 1e-10, "symplectic, no drift"});
  expect_at_most({"fall to H = 1, generalized-alpha, 5 us: energy, of the kinetic one", kBalance,
                  fall_drift(*generalized_alpha, *other), 1e-7,
                  "the vibration from the release, which is damped away"});
}

}  // namespace
}  // namespace oblique::validation
