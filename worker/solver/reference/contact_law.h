#pragma once

#include "worker/solver/model/case_result.h"
#include "worker/solver/reference/tip.h"

/// The local compliant contact model: a bilinear normal and a linear tangential spring between the
/// tip R and a massless particle P, which sticks to the ground or slides under Coulomb friction.
/// Forces act on the tip: F_n >= 0 upwards, F_t along x.
namespace oblique::solver {

struct ContactParameters {
  double k_N_m;   ///< normal stiffness in compression
  double eta2;    ///< k over the tangential stiffness
  double mu;      ///< Coulomb friction
  double e_star;  ///< Stronge's energetic restitution; stiffness in restitution is k / e*^2
};

/// Step lengths of one contact.
struct ContactSteps {
  double compression_s;
  double restitution_s;
};

/// Regime of the contact, with the anchors of its laws, which are linear between events:
///   F_n = fn_anchor - k_n (y - y_anchor),  k_n = k or k / e*^2       (paper, eqs. 17 and 22)
///   stick: F_t = ft_anchor - (k/eta2) (x - x_anchor)                 (paper, eq. 19)
///   slip:  F_t = -s mu F_n                                           (paper, eq. 18)
class ContactLaw {
 public:
  /// At touch: compression, all forces zero; stick iff |V_t| < mu eta2 |V_n| (paper, eq. 21).
  ContactLaw(const ContactParameters& parameters, const TipState& touch);

  bool is_compression() const { return phase_ == PhaseKind::kCompression; }
  bool is_stick() const { return stick_; }
  /// Direction in which P slides; in stick, the direction of the last slip.
  double slip_direction() const { return s_; }
  double mu() const { return parameters_.mu; }
  double e_star() const { return parameters_.e_star; }
  /// Slope of the normal element in the present phase [N/m].
  double normal_stiffness_N_m() const { return normal_stiffness_N_m_; }
  double tangential_stiffness_N_m() const { return tangential_stiffness_N_m_; }

  /// Eq. 17.
  double fn_N(const TipState& tip) const {
    return fn_anchor_N_ - normal_stiffness_N_m_ * (tip.y_m - y_anchor_m_);
  }
  /// Eq. 19 in stick, eq. 18 in slip.
  double ft_N(const TipState& tip) const {
    return stick_ ? ft_anchor_N_ - tangential_stiffness_N_m_ * (tip.x_m - x_anchor_m_)
                  : -s_ * parameters_.mu * fn_N(tip);
  }
  double fn_rate_N_s(const TipState& tip) const { return -normal_stiffness_N_m_ * tip.vy_m_s; }
  double ft_rate_N_s(const TipState& tip) const {
    return stick_ ? -tangential_stiffness_N_m_ * tip.vx_m_s
                  : -s_ * parameters_.mu * fn_rate_N_s(tip);
  }
  /// Tangential deformation u_x = -F_t eta2 / k [m].
  double ux_m(const TipState& tip) const { return -ft_N(tip) / tangential_stiffness_N_m(); }
  /// Position of P along the ground [m].
  double xP_m(const TipState& tip) const { return tip.x_m - ux_m(tip); }
  /// Eq. 24: P's velocity in slip, V_t + s mu eta2 (k_n/k) V_n.
  double slip_velocity_m_s(const TipState& tip) const { return s_ * slip_speed_m_s(tip, s_); }
  /// The speed that P would have if it slid in `direction` (1 or -1).
  double slip_speed_m_s(const TipState& tip, double direction) const {
    return direction * tip.vx_m_s + slip_coupling_ * tip.vy_m_s;
  }

  /// Eq. 16: the laws as affine functions of the tip's position.
  AffineContactForce<double> affine() const;

  void set_restitution(double e_star) {
    parameters_.e_star = e_star;
    enter(phase_);
  }
  /// Eq. 22: changes between compression and restitution; forces are continuous.
  void turn(const TipState& tip);
  /// Eq. 23: P starts to slide in `direction`, 1 or -1 along x.
  void start_slip(const TipState& tip, double direction);
  /// Eq. 24: P comes to rest; without friction it reverses instead.
  void stop_slip(const TipState& tip);

 private:
  void anchor(const TipState& tip);
  void enter(PhaseKind phase);

  ContactParameters parameters_;
  double tangential_stiffness_N_m_;
  PhaseKind phase_{};
  double normal_stiffness_N_m_{};  ///< k_n of the present phase
  double slip_coupling_{};         ///< mu eta2 k_n/k: speed of P in slip per V_n
  bool stick_;
  double s_;
  double x_anchor_m_;
  double y_anchor_m_;
  double fn_anchor_N_ = 0.0;
  double ft_anchor_N_ = 0.0;
};

}  // namespace oblique::solver
