#include "tests/worker/solver/analytic/analytic_rigid_impact.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>

namespace oblique::solver {
namespace {

constexpr int kSamplesPerPeriod = 2000;
constexpr int kMaxSamples = 2'000'000;
constexpr int kMaxRegimes = 100;
constexpr double kRounding = 1e-10;

/// Returns cos(w t) and sin(w t)/w. Negative w^2 gives the hyperbolic functions.
double even_solution(double w_squared, double t) {
  const double w = std::sqrt(std::abs(w_squared));
  return w_squared < 0.0 ? std::cosh(w * t) : std::cos(w * t);
}
double odd_solution(double w_squared, double t) {
  const double w = std::sqrt(std::abs(w_squared));
  if (w * t < 1e-12) {
    return t;
  }
  return (w_squared < 0.0 ? std::sinh(w * t) : std::sin(w * t)) / w;
}
/// Returns (1 - cos(w t))/w^2, the response to a constant force from rest, without cancellation.
double forced_solution(double w_squared, double t) {
  const double half = odd_solution(w_squared, 0.5 * t);
  return 2.0 * half * half;
}

double bisected(const std::function<double(double)>& phi, double low, double high) {
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (phi(middle) < 0.0 ? low : high) = middle;
  }
  return high;
}

}  // namespace

Eigen::Vector2d RigidImpact::Motion::way_m(double t_s) const {
  Eigen::Vector2d z;
  for (int i = 0; i < 2; ++i) {
    z[i] = modal_velocity[i] * odd_solution(rates_squared[i], t_s) +
           modal_force[i] * forced_solution(rates_squared[i], t_s);
  }
  return modes * z;
}

Eigen::Vector2d RigidImpact::Motion::velocity_m_s(double t_s) const {
  Eigen::Vector2d z;
  for (int i = 0; i < 2; ++i) {
    z[i] = modal_velocity[i] * even_solution(rates_squared[i], t_s) +
           modal_force[i] * odd_solution(rates_squared[i], t_s);
  }
  return modes * z;
}

double RigidImpact::Motion::shortest_period_s() const {
  return 2.0 * M_PI / std::sqrt(rates_squared.cwiseAbs().maxCoeff());
}

RigidImpact::Motion RigidImpact::begin(const Regime& regime, const Eigen::Vector2d& F_N) const {
  Motion motion;
  motion.regime = regime;
  const double k_n = regime.compression ? p_.k_N_m : p_.k_N_m / (p_.e_star * p_.e_star);
  motion.K_N_m.setZero();
  motion.K_N_m(1, 1) = k_n;
  if (regime.stick) {
    motion.K_N_m(0, 0) = p_.k_N_m / p_.eta2;
  } else {
    motion.K_N_m(0, 1) = -regime.s * p_.mu * k_n;
  }
  const Eigen::EigenSolver<Eigen::Matrix2d> solver(p_.W_per_kg * motion.K_N_m);
  motion.modes = solver.eigenvectors().real();
  motion.rates_squared = solver.eigenvalues().real();
  motion.F0_N = F_N;
  motion.modal_force = motion.modes.inverse() * (p_.W_per_kg * F_N);
  motion.modal_velocity = motion.modes.inverse() * V_m_s_;
  return motion;
}

double RigidImpact::slip_velocity_m_s(const Motion& motion, double t_s) const {
  const Eigen::Vector2d V = motion.velocity_m_s(t_s);
  // The deformation is u_x = -F_t eta2/k, and in slip F_t = -s mu F_n.
  const double F_n_rate = -motion.K_N_m(1, 1) * V[1];
  return V[0] - motion.regime.s * p_.mu * F_n_rate * p_.eta2 / p_.k_N_m;
}

RigidImpact::Ending RigidImpact::end_of(const Motion& motion) const {
  struct Watch {
    End end;
    double s;
    std::function<double(double)> phi;  // the regime ends where phi rises through zero
  };
  const Regime& regime = motion.regime;
  std::vector<Watch> watches;
  if (!regime.compression) {
    watches.push_back({End::kSeparation, 0.0, [&](double t) { return -motion.force_N(t)[1]; }});
  }
  const double turn_sign = regime.compression ? 1.0 : -1.0;
  watches.push_back({End::kTurn, 0.0,
                     [&, turn_sign](double t) { return turn_sign * motion.velocity_m_s(t)[1]; }});
  if (regime.stick) {
    for (const double s : {1.0, -1.0}) {
      watches.push_back({End::kSlip, s, [&, s](double t) {
                           const Eigen::Vector2d F = motion.force_N(t);
                           return -s * F[0] - p_.mu * F[1];
                         }});
    }
  } else {
    watches.push_back(
        {End::kStick, 0.0, [&](double t) { return -regime.s * slip_velocity_m_s(motion, t); }});
  }
  const double step_s = motion.shortest_period_s() / kSamplesPerPeriod;
  std::vector<double> before;
  for (const Watch& watch : watches) {
    // A function that is zero at the start, up to rounding, can end the regime only after it has
    // been negative.
    const double scale = watch.end == End::kSeparation || watch.end == End::kSlip
                             ? p_.V0_m_s.norm() * std::sqrt(p_.k_N_m / p_.W_per_kg(1, 1))
                             : p_.V0_m_s.norm();
    const double value = watch.phi(0.0);
    before.push_back(value < -kRounding * scale ? value : 0.0);
  }
  for (int sample = 1; sample <= kMaxSamples; ++sample) {
    const double t = sample * step_s;
    std::optional<Ending> first;
    for (std::size_t i = 0; i < watches.size(); ++i) {
      const double value = watches[i].phi(t);
      if (before[i] < 0.0 && value >= 0.0) {
        const double root = bisected(watches[i].phi, t - step_s, t);
        if (!first || root < first->t_s) {
          first = Ending{watches[i].end, root, watches[i].s};
        }
      }
      before[i] = value;
    }
    if (first) {
      return *first;
    }
  }
  throw std::runtime_error("a regime of the rigid impact does not end");
}

void RigidImpact::close(const Motion& motion, double t_s) {
  const Eigen::Vector2d way = motion.way_m(t_s);
  const Eigen::Vector2d F = motion.force_N(t_s);
  const double work = 0.5 * (motion.F0_N[1] + F[1]) * way[1];
  (motion.regime.compression ? compression_work_J_ : restitution_work_J_) += work;
  if (motion.regime.stick) {
    stick_s_ += t_s;
  } else {
    slide_m_ += std::abs(way[0] + (F[0] - motion.F0_N[0]) * p_.eta2 / p_.k_N_m);
  }
  V_m_s_ = motion.velocity_m_s(t_s);
}

RigidImpact::RigidImpact(const Parameters& parameters) : p_(parameters), V_m_s_(p_.V0_m_s) {
  Regime regime{std::abs(V_m_s_[0]) < p_.mu * p_.eta2 * std::abs(V_m_s_[1]), true,
                V_m_s_[0] < 0.0 ? -1.0 : 1.0, 0.0};
  Eigen::Vector2d F = Eigen::Vector2d::Zero();
  while (motions_.size() < kMaxRegimes) {
    motions_.push_back(begin(regime, F));
    regimes_.push_back(regime);
    const Motion& motion = motions_.back();
    const Ending ending = end_of(motion);
    F = motion.force_N(ending.t_s);
    close(motion, ending.t_s);
    regime.t0_s += ending.t_s;
    switch (ending.end) {
      case End::kSeparation:
        duration_s_ = regime.t0_s;
        return;
      case End::kTurn:
        if (regime.compression) {
          fn_peaks_N_.push_back(F[1]);
        }
        regime.compression = !regime.compression;
        break;
      case End::kSlip:
        regime.stick = false;
        regime.s = ending.s;
        break;
      case End::kStick:
        regime.stick = true;
        break;
    }
  }
  throw std::runtime_error("the rigid impact has too many regimes");
}

std::string RigidImpact::mode() const {
  std::string text;
  for (const Regime& regime : regimes_) {
    text += text.empty() ? "" : " ";
    text += regime.stick ? 'S' : 's';
    text += regime.compression ? 'C' : 'R';
  }
  return text;
}

const RigidImpact::Motion& RigidImpact::motion_at(double t_s) const {
  const auto after =
      std::upper_bound(motions_.begin(), motions_.end(), t_s,
                       [](double t, const Motion& motion) { return t < motion.regime.t0_s; });
  return *(after - 1);
}

Eigen::Vector2d RigidImpact::velocity_m_s(double t_s) const {
  const Motion& motion = motion_at(t_s);
  return motion.velocity_m_s(t_s - motion.regime.t0_s);
}

Eigen::Vector2d RigidImpact::force_N(double t_s) const {
  const Motion& motion = motion_at(t_s);
  return motion.force_N(t_s - motion.regime.t0_s);
}

}  // namespace oblique::solver
