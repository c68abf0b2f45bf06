#pragma once

namespace oblique::solver {

/// Smallest e*. Below, k/e*^2 turns the rounding of the tip's position into forces of newtons, and
/// events come faster than they can be told apart in double precision.
inline constexpr double kSmallestRestitution = 1e-3;

}  // namespace oblique::solver
