#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "tests/validation/validation_table.h"
#include "tests/worker/solver/analytic/analytic_rigid_impact.h"
#include "tests/worker/solver/reference/from_eliminated.h"
#include "tests/worker/solver/reference/rigid_tip_motion.h"
#include "worker/solver/reference/generalized_alpha.h"
#include "worker/solver/reference/solve_contact.h"

namespace oblique::validation {
namespace {

using solver::CaseResult;
using solver::RigidImpact;

const std::string kReference = "Stronge, rigid body, closed form";

/// Returns a free rod of 0.5 kg, inclined by 30 degrees, that strikes the ground with one end: W =
/// (1/m) [1 + 3 sin^2, -3 sin cos; -3 sin cos, 1 + 3 cos^2].
RigidImpact::Parameters flying_rod(double mu, double e_star, double vt_m_s) {
  const double c = std::cos(M_PI / 6.0);
  const double s = std::sin(M_PI / 6.0);
  RigidImpact::Parameters p;
  p.W_per_kg << 1.0 + 3.0 * s * s, -3.0 * s * c, -3.0 * s * c, 1.0 + 3.0 * c * c;
  p.W_per_kg /= 0.5;
  p.k_N_m = 2.7e7;
  p.eta2 = 1.2463;
  p.mu = mu;
  p.e_star = e_star;
  p.V0_m_s = {vt_m_s, -5.0};
  return p;
}

CaseResult solved(const RigidImpact::Parameters& p, double dt_s) {
  const solver::RigidTipMotion motion(p.W_per_kg);
  return solver::solve_contact(motion, {p.k_N_m, p.eta2, p.mu, p.e_star}, {dt_s, dt_s},
                               motion.moving(p.V0_m_s), {});
}

/// Returns the largest relative error. Force peaks are relative to the largest force, velocities to
/// the speed at touch, times to the duration, and the slide to speed at touch times duration.
double largest_error(const CaseResult& result, const RigidImpact& right, double speed_m_s) {
  double largest = std::abs(result.duration_s / right.duration_s() - 1.0);
  EXPECT_EQ(result.peaks.size(), right.fn_peaks_N().size());
  const double force_N = right.fn_peaks_N().empty() ? 0.0 : right.fn_peaks_N().front();
  for (std::size_t i = 0; i < std::min(result.peaks.size(), right.fn_peaks_N().size()); ++i) {
    largest = std::max(largest, std::abs(result.peaks[i].fn_N - right.fn_peaks_N()[i]) / force_N);
  }
  const Eigen::Vector2d out = right.velocity_out_m_s();
  return std::max({largest, std::abs(result.vt_out_m_s - out[0]) / speed_m_s,
                   std::abs(result.vn_out_m_s - out[1]) / speed_m_s,
                   std::abs(result.slide_m - right.slide_m()) / (speed_m_s * right.duration_s()),
                   std::abs(result.stick_total_s - right.stick_s()) / right.duration_s()});
}

struct Regime {
  const char* name;
  const char* mode;
  double mu;
  double vt_m_s;
};
/// Regimes of Stronge's theory. The closed form gives the mode of each.
constexpr std::array<Regime, 5> kRegimes{{{"slip throughout", "sC sR", 0.3, 3.0},
                                          {"stick, then slip in restitution", "SC SR sR", 0.8, 1.0},
                                          {"slip, stick, slip", "sC SC SR sR", 0.1, 1.0},
                                          {"stick that slips in compression", "SC sC sR", 0.5, 3.0},
                                          {"slip the other way", "sC sR", 0.1, -1.0}}};

TEST(RigidImpact, TheContactFollowsTheClosedFormInEachRegime) {
  for (const Regime& regime : kRegimes) {
    const RigidImpact::Parameters p = flying_rod(regime.mu, 0.7, regime.vt_m_s);
    const RigidImpact right(p);
    const CaseResult result = solved(p, right.duration_s() / 400);
    EXPECT_EQ(right.mode(), regime.mode);
    EXPECT_EQ(result.mode, regime.mode);
    expect_at_most({std::string("rigid rod, ") + regime.name + " (" + regime.mode +
                        "): forces, times, velocities, slide",
                    kReference, largest_error(result, right, p.V0_m_s.norm()), 1e-9,
                    "PEFRL at 1/400 of the contact: (w h)^4, w h = 0.01"});
  }
}

TEST(RigidImpact, WorkOfRestitutionIsMinusTheSquareOfTheRestitutionTimesThatOfCompression) {
  double largest = 0.0;
  for (const Regime& regime : kRegimes) {
    for (const double e_star : {0.3, 0.7, 1.0}) {
      const RigidImpact::Parameters p = flying_rod(regime.mu, e_star, regime.vt_m_s);
      const CaseResult result = solved(p, RigidImpact(p).duration_s() / 400);
      ASSERT_EQ(result.peaks.size(), 1U);
      // Compression stores F^2/2k. Restitution loses `restitution_J` and returns the rest.
      const double stored_J = result.fn_peak_N * result.fn_peak_N / (2.0 * p.k_N_m);
      const double given_back_J = stored_J - result.energy.restitution_J;
      largest = std::max(largest, std::abs(given_back_J / stored_J - e_star * e_star));
    }
  }
  expect_at_most({"rigid rod: e*^2 from the work of restitution over that of compression",
                  "Stronge's definition of e*", largest, 1e-12, "exact; rounding"});
}

/// Two links so stiff that they impact like rigid ones: W = J M^-1 J^T, with angles as coordinates.
struct StiffLinks {
  static constexpr double kLength_m = 0.4;
  static constexpr double kAngle_rad[2] = {-0.3, -1.2};

  explicit StiffLinks(double stiffening) {
    model.lengths_m = {kLength_m, kLength_m};
    model.elements_per_link = 1;
    model.g_m_s2 = 1e-12;
    model.E_Pa *= stiffening;
    for (int link = 0; link < 2; ++link) {
      J.col(link) << -std::sin(kAngle_rad[link]), std::cos(kAngle_rad[link]);
    }
    J *= kLength_m;
  }

  RigidImpact::Parameters impact(double mu, const Eigen::Vector2d& V_m_s) const {
    const double c = std::cos(kAngle_rad[1] - kAngle_rad[0]);
    Eigen::Matrix2d mass;
    mass << 4.0 / 3.0, 0.5 * c, 0.5 * c, 1.0 / 3.0;
    mass *= model.rho_kg_m3 * model.A_m2 * kLength_m * kLength_m * kLength_m;
    RigidImpact::Parameters p;
    p.W_per_kg = J * mass.inverse() * J.transpose();
    // The contact has a hundredth of the finger's stiffness, so that the links deform less.
    p.k_N_m = 2.7e5;
    p.eta2 = model.eta2;
    p.mu = mu;
    p.e_star = 0.7;
    p.V0_m_s = V_m_s;
    return p;
  }

  /// Returns straight links at the given angles, which rotate so that the tip has the velocity V.
  solver::ChainState state(const solver::Chain& chain, const Eigen::Vector2d& V_m_s) const {
    const Eigen::Vector2d rate = J.inverse() * V_m_s;
    solver::ChainState state = chain.at_rest();
    // Rows of q: pin and its slope; slope of the inner link at the joint, joint, slope of the outer
    // link at the joint; tip and its slope.
    const Eigen::Index link_of[7] = {0, 0, 0, 0, 1, 1, 1};
    const bool is_slope[7] = {false, true, true, false, true, false, true};
    const Eigen::Vector2d joint_m = J.col(0).reverse().cwiseProduct(Eigen::Vector2d(1.0, -1.0));
    for (Eigen::Index row = 0; row < 7; ++row) {
      const Eigen::Index link = link_of[row];
      const double angle = kAngle_rad[link];
      const Eigen::Vector2d along(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d across(-along[1], along[0]);
      Eigen::Vector2d q = along;
      Eigen::Vector2d v = across * rate[link];
      if (!is_slope[row]) {
        const double s_m = row == 0 ? 0.0 : kLength_m;
        q *= s_m;
        v *= s_m;
        if (link == 1) {
          q += joint_m;
          v += J.col(0) * rate[0];
        }
      }
      state.q.col(row) = q;
      state.v.col(row) = v;
    }
    return state;
  }

  solver::ModelParameters model = solver::preset("paper");
  Eigen::Matrix2d J;
};

struct ChainRegime {
  const char* mode;
  double mu;
  double vt_over_vn;
};
constexpr std::array<ChainRegime, 4> kChainRegimes{{{"sC sR", 0.2, -1.0},
                                                    {"SC SR sR", 0.6, 0.3},
                                                    {"sC SC SR sR", 0.6, 2.0},
                                                    {"sC sR SR sR", 0.2, 2.0}}};

double stiff_chain_error(const solver::Motion& motion, const RigidImpact::Parameters& p,
                         const solver::ChainState& touch, double dt_s, const char* mode) {
  const RigidImpact right(p);
  EXPECT_EQ(right.mode(), mode);
  const CaseResult result =
      solver::solve_contact(motion, {p.k_N_m, p.eta2, p.mu, p.e_star}, {dt_s, dt_s}, touch, {});
  EXPECT_EQ(result.mode, mode);
  return largest_error(result, right, p.V0_m_s.norm());
}

TEST(RigidImpact, StiffChainOfTwoLinksStrikesAsRigidLinksWithExplicitSteps) {
  const StiffLinks links(1e4);
  const solver::Chain chain(links.model);
  const solver::ExplicitMotion motion(chain);
  const double dt_s = 0.4 * solver::Pefrl::stability_limit() / chain.highest_frequency_rad_s(2.7e5);
  for (const ChainRegime& regime : kChainRegimes) {
    // At a lower speed, rounding in the stiff links would be visible.
    const auto p = links.impact(regime.mu, {-1e-3 * regime.vt_over_vn, -1e-3});
    expect_at_most({std::string("two stiff links, explicit, E * 1e4 (") + regime.mode + ")",
                    kReference,
                    stiff_chain_error(motion, p, links.state(chain, p.V0_m_s), dt_s, regime.mode),
                    2e-4, "deformation and rotation of the links, and rounding"});
  }
}

TEST(RigidImpact, StiffChainOfTwoLinksStrikesAsRigidLinksWithGeneralizedAlpha) {
  // Generalized-alpha does not need shorter steps for stiffer links.
  const StiffLinks links(1e6);
  const solver::Chain chain(links.model);
  const solver::GeneralizedAlphaMotion motion(links.model);
  for (const ChainRegime& regime : kChainRegimes) {
    const auto p = links.impact(regime.mu, {-1e-4 * regime.vt_over_vn, -1e-4});
    const auto touch = from_eliminated(motion.chain(), links.state(chain, p.V0_m_s));
    expect_at_most(
        {std::string("two stiff links, generalized-alpha, E * 1e6 (") + regime.mode + ")",
         kReference, stiff_chain_error(motion, p, touch, 1e-6, regime.mode), 1e-5,
         "rotation of the links during contact"});
  }
}

}  // namespace
}  // namespace oblique::validation
