#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace oblique::solver {

/// Closed form of a rigid body that strikes the ground through the local compliant contact
/// (Stronge, Impact Mechanics). The inverse mass W at the tip, symmetric and positive definite,
/// describes the body: d(V_t, V_n)/dt = W (F_t, F_n). Let r be the displacement of the tip since
/// the regime began. In each regime the force is F_0 - K r, so that
///
///   r'' = W F_0 - W K r,
///   K = diag(k/eta2, k_n) in stick; in slip K has the rows (0, -s mu k_n) and (0, k_n).
///
/// Eigenmodes solve this equation. A regime ends at a root of a function of the solution, found by
/// scanning and bisection. The closed form shares no code with the solver.
class RigidImpact {
 public:
  struct Parameters {
    Eigen::Matrix2d W_per_kg;  ///< inverse mass; index 0 is tangential, 1 normal
    double k_N_m;
    double eta2;
    double mu;
    double e_star;
    Eigen::Vector2d V0_m_s;  ///< V_n < 0
  };
  struct Regime {
    bool stick;
    bool compression;
    double s;     ///< direction in which P slides: 1 or -1
    double t0_s;  ///< start
  };

  explicit RigidImpact(const Parameters& parameters);

  const std::vector<Regime>& regimes() const { return regimes_; }
  /// Returns the states in order, for example "SC SR sR".
  std::string mode() const;
  double duration_s() const { return duration_s_; }
  /// Returns the normal force at the end of each compression.
  const std::vector<double>& fn_peaks_N() const { return fn_peaks_N_; }
  Eigen::Vector2d velocity_out_m_s() const { return V_m_s_; }
  double slide_m() const { return slide_m_; }
  double stick_s() const { return stick_s_; }
  /// Work of F_n on the body in all compressions (negative) and in all restitutions (positive).
  double compression_work_J() const { return compression_work_J_; }
  double restitution_work_J() const { return restitution_work_J_; }
  /// Return (V_t, V_n) and (F_t, F_n) at a time from 0 to duration_s().
  Eigen::Vector2d velocity_m_s(double t_s) const;
  Eigen::Vector2d force_N(double t_s) const;

 private:
  /// The motion of one regime from its start.
  struct Motion {
    Regime regime;
    Eigen::Matrix2d modes;
    Eigen::Vector2d rates_squared;  ///< eigenvalues of W K
    Eigen::Vector2d F0_N;
    Eigen::Matrix2d K_N_m;
    Eigen::Vector2d modal_force;
    Eigen::Vector2d modal_velocity;

    Eigen::Vector2d way_m(double t_s) const;
    Eigen::Vector2d velocity_m_s(double t_s) const;
    Eigen::Vector2d force_N(double t_s) const { return F0_N - K_N_m * way_m(t_s); }
    double shortest_period_s() const;
  };
  enum class End { kSeparation, kTurn, kSlip, kStick };
  struct Ending {
    End end;
    double t_s;  ///< time from the start of the regime
    double s;    ///< if `end` is kSlip: direction in which P then slides
  };

  Motion begin(const Regime& regime, const Eigen::Vector2d& F_N) const;
  double slip_velocity_m_s(const Motion& motion, double t_s) const;
  Ending end_of(const Motion& motion) const;
  void close(const Motion& motion, double t_s);
  const Motion& motion_at(double t_s) const;

  Parameters p_;
  std::vector<Regime> regimes_;
  std::vector<Motion> motions_;
  std::vector<double> fn_peaks_N_;
  Eigen::Vector2d V_m_s_;
  double duration_s_ = 0.0;
  double slide_m_ = 0.0;
  double stick_s_ = 0.0;
  double compression_work_J_ = 0.0;
  double restitution_work_J_ = 0.0;
};

}  // namespace oblique::solver
