#include "worker/solver/reference/contact_law.h"

#include <cmath>

namespace oblique::solver {

ContactLaw::ContactLaw(const ContactParameters& parameters, const TipState& touch)
    : parameters_(parameters),
      tangential_stiffness_N_m_(parameters.k_N_m / parameters.eta2),
      stick_(std::abs(touch.vx_m_s) < parameters.mu * parameters.eta2 * std::abs(touch.vy_m_s)),
      s_(touch.vx_m_s < 0.0 ? -1.0 : 1.0),
      x_anchor_m_(touch.x_m),
      y_anchor_m_(touch.y_m) {
  enter(PhaseKind::kCompression);
}

void ContactLaw::enter(PhaseKind phase) {
  phase_ = phase;
  const double stiffness_ratio =
      is_compression() ? 1.0 : 1.0 / (parameters_.e_star * parameters_.e_star);
  normal_stiffness_N_m_ = stiffness_ratio * parameters_.k_N_m;
  slip_coupling_ = parameters_.mu * parameters_.eta2 * stiffness_ratio;
}

AffineContactForce<double> ContactLaw::affine() const {
  AffineContactForce<double> force{
      .fn0 = fn_anchor_N_, .k_nn = normal_stiffness_N_m_, .x0 = x_anchor_m_, .y0 = y_anchor_m_};
  if (stick_) {
    force.ft0 = ft_anchor_N_;
    force.k_tt = tangential_stiffness_N_m();
  } else {
    force.ft0 = -s_ * parameters_.mu * fn_anchor_N_;
    force.k_tn = -s_ * parameters_.mu * force.k_nn;
  }
  return force;
}

void ContactLaw::anchor(const TipState& tip) {
  const double fn = fn_N(tip);
  const double ft = ft_N(tip);
  fn_anchor_N_ = fn;
  ft_anchor_N_ = ft;
  x_anchor_m_ = tip.x_m;
  y_anchor_m_ = tip.y_m;
}

void ContactLaw::turn(const TipState& tip) {
  anchor(tip);
  enter(is_compression() ? PhaseKind::kRestitution : PhaseKind::kCompression);
}

void ContactLaw::start_slip(const TipState& tip, double direction) {
  anchor(tip);
  s_ = direction;
  stick_ = false;
}

void ContactLaw::stop_slip(const TipState& tip) {
  anchor(tip);
  if (parameters_.mu == 0.0) {
    s_ = -s_;
  } else {
    stick_ = true;
  }
}

}  // namespace oblique::solver
