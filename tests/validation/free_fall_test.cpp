#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "tests/validation/validation_table.h"
#include "tests/worker/solver/reference/known_falls.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/generalized_alpha.h"
#include "worker/solver/reference/motion.h"

namespace oblique::validation {
namespace {

using solver::Chain;
using solver::ChainState;
using solver::Fall;
using solver::GeneralizedAlphaMotion;
using solver::kKnownFalls;
using solver::KnownFall;
using solver::ModelParameters;
using solver::Motion;
using solver::TipState;

/// Largest errors over all known states.
struct FallErrors {
  double t_s = 0.0;
  double x_m = 0.0;
  double v_m_s = 0.0;
};

const std::string kKnownFrom = "independent explicit solution, converged";

/// Known state of three rigid links, computed in minimal coordinates by a Runge-Kutta method. The
/// state does not depend on A and I.
constexpr std::array<KnownFall, 1> kRigid{
    {{1.00, 0.430188812, std::numeric_limits<double>::quiet_NaN(), -5.738072, -5.234437}}};

template <std::size_t n>
FallErrors errors(const Motion& motion, const Fall& fall, const std::array<KnownFall, n>& known) {
  FallErrors worst;
  for (const KnownFall& right : known) {
    const ChainState state = fall.state_at(right.H_m);
    const TipState tip = motion.tip(state);
    worst.t_s = std::max(worst.t_s, std::abs(state.t_s - right.t_s));
    worst.x_m = std::fmax(worst.x_m, std::abs(tip.x_m - right.x_m));
    worst.v_m_s = std::max(
        {worst.v_m_s, std::abs(tip.vx_m_s - right.vx_m_s), std::abs(tip.vy_m_s - right.vy_m_s)});
  }
  return worst;
}

template <std::size_t n>
FallErrors explicit_errors(const ModelParameters& model, double dt_s,
                           const std::array<KnownFall, n>& known) {
  const Chain chain(model);
  return errors(solver::ExplicitMotion(chain), *solver::solve_stepped_fall(chain, dt_s), known);
}

template <std::size_t n>
FallErrors generalized_alpha_errors(const ModelParameters& model, double dt_s,
                                    const std::array<KnownFall, n>& known) {
  const auto motion = std::make_shared<GeneralizedAlphaMotion>(model);
  return errors(*motion,
                *solver::solve_stepped_fall(motion, dt_s, solver::longest_fall_s(Chain(model))),
                known);
}

TEST(FreeFall, ExplicitIntegratorReachesTheKnownStates) {
  const FallErrors worst = explicit_errors(solver::preset("paper"), 2.5e-6, kKnownFalls);
  expect_at_most({"fall, explicit, 2.5 us: time at H = 0.96, 1, 1.04 [s]", kKnownFrom, worst.t_s,
                  1e-8, "digits of the reference"});
  expect_at_most({"fall, explicit, 2.5 us: x of the tip [m]", kKnownFrom, worst.x_m, 1e-7,
                  "digits of the reference"});
  expect_at_most({"fall, explicit, 2.5 us: velocity of the tip [m/s]", kKnownFrom, worst.v_m_s,
                  5e-5, "digits of the reference"});
}

TEST(FreeFall, GeneralizedAlphaReachesTheKnownStates) {
  const FallErrors worst = generalized_alpha_errors(solver::preset("paper"), 5e-6, kKnownFalls);
  expect_at_most({"fall, generalized-alpha, 5 us: time at H = 0.96, 1, 1.04 [s]", kKnownFrom,
                  worst.t_s, 1e-8 + 3e-9, "the reference's digits, and the vibration's 3e-9"});
  expect_at_most({"fall, generalized-alpha, 5 us: x of the tip [m]", kKnownFrom, worst.x_m, 1e-7,
                  "digits of the reference"});
  expect_at_most({"fall, generalized-alpha, 5 us: velocity of the tip [m/s]", kKnownFrom,
                  worst.v_m_s, 1e-3,
                  "amplitude of the vibration from the release, unresolved at 5 us"});
}

TEST(FreeFall, GeneralizedAlphaFindsTheImpactTimeWithStepsOfATenthOfAMillisecond) {
  const FallErrors worst = generalized_alpha_errors(solver::preset("paper"), 1e-4, kKnownFalls);
  expect_at_most({"fall, generalized-alpha, 100 us: time at H = 0.96, 1, 1.04 [s]", kKnownFrom,
                  worst.t_s, 3e-7, "(w h)^2/12 t of links that turn at w = 25 rad/s in the end"});
}

TEST(FreeFall, StiffLinksFallAsRigidOnes) {
  ModelParameters model = solver::preset("paper");
  model.elements_per_link = 1;
  model.E_Pa *= 100.0;
  const FallErrors one = explicit_errors(model, 1.5e-6, kRigid);
  const FallErrors other = generalized_alpha_errors(model, 5e-6, kRigid);
  const std::string reference = "three rigid links";
  const std::string reason = "bending moves it by 1e-6 s at E, and as 1/E";
  expect_at_most({"fall, explicit, E * 100: time at H = 1 [s]", reference, one.t_s, 2e-8, reason});
  expect_at_most(
      {"fall, generalized-alpha, E * 100: time at H = 1 [s]", reference, other.t_s, 2e-8, reason});
  const std::string vibration = "vibration from the release, 1e-3 at E and as 1/sqrt(E)";
  expect_at_most({"fall, explicit, E * 100: velocity of the tip [m/s]", reference, one.v_m_s, 1e-4,
                  vibration});
  expect_at_most({"fall, generalized-alpha, E * 100: velocity of the tip [m/s]", reference,
                  other.v_m_s, 1e-4, vibration});
}

}  // namespace
}  // namespace oblique::validation
