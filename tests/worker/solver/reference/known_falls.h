#pragma once

#include <array>

#include <gtest/gtest.h>

#include "worker/solver/reference/chain.h"
#include "worker/solver/reference/fall.h"
#include "worker/solver/reference/tip.h"

namespace oblique::solver {

/// State of the tip after a drop H.
struct KnownFall {
  double H_m;
  double t_s;
  double x_m;  ///< NaN if unknown
  double vx_m_s;
  double vy_m_s;
};

/// States from an independent explicit solution of order 4 for the preset `paper`. They converged
/// to nine digits and are rounded to the digits given here.
inline constexpr std::array<KnownFall, 3> kKnownFalls{
    {{0.96, 0.42263713, 0.6273702, -5.23465, -5.34110},
     {1.00, 0.43018976, 0.5859693, -5.73783, -5.23380},
     {1.04, 0.43798758, 0.5389964, -6.31882, -4.99916}}};

/// Expects that a fall of `chain` passes through the states of kKnownFalls, to all given digits.
inline void expect_known_falls(const Chain& chain, const Fall& fall) {
  for (const KnownFall& known : kKnownFalls) {
    const ChainState state = fall.state_at(known.H_m);
    const TipState tip = chain.tip(state);
    EXPECT_NEAR(state.t_s, known.t_s, 1e-8);
    EXPECT_NEAR(tip.x_m, known.x_m, 1e-7);
    EXPECT_NEAR(tip.vx_m_s, known.vx_m_s, 5e-5);
    EXPECT_NEAR(tip.vy_m_s, known.vy_m_s, 5e-5);
  }
}

}  // namespace oblique::solver
