#pragma once

/// The interface between the motion of a chain and the contact at its tip. The contact sets the
/// force; the motion returns the tip's state and the integrals of the force.
namespace oblique::solver {

/// Tip position and velocity in the fixed frame, origin at O, y up.
struct TipState {
  double x_m;
  double y_m;
  double vx_m_s;
  double vy_m_s;
};

/// F_c of eq. 16 between two events, affine in the tip's position:
///   F_n = fn0 - k_nn (y - y0),   F_t = ft0 - k_tn (y - y0) - k_tt (x - x0).
/// `Real` is a number or a vector of lanes.
template <class Real>
struct AffineContactForce {
  Real fn0{};
  Real ft0{};
  Real k_nn{};
  Real k_tn{};
  Real k_tt{};
  Real x0{};
  Real y0{};

  Real fn_N(const Real& y_m) const { return fn0 - k_nn * (y_m - y0); }
  Real ft_N(const Real& x_m, const Real& y_m) const {
    return ft0 - k_tn * (y_m - y0) - k_tt * (x_m - x0);
  }
};

inline constexpr AffineContactForce<double> kNoContact{};

/// Time integrals over one step, of the order of the integrator.
template <class Real>
struct ContactIntegrals {
  Real impulse_n{};  ///< int F_n dt [Ns]
  Real impulse_t{};  ///< int F_t dt [Ns]
  Real work_t{};     ///< int F_t V_t dt [J]
};

}  // namespace oblique::solver
