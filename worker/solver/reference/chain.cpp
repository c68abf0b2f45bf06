#include "worker/solver/reference/chain.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "worker/solver/model/errors.h"

namespace oblique::solver {
namespace {

void add_element(BandedMatrix& matrix, const std::array<Eigen::Index, 4>& row,
                 const Eigen::Matrix4d& entries, double factor) {
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = 0; b < 4; ++b) {
      if (row[a] != 0 && row[b] != 0) {
        matrix.add(static_cast<std::size_t>(row[a]), static_cast<std::size_t>(row[b]),
                   factor * entries(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)));
      }
    }
  }
}

constexpr double kEigenvalueAccuracy = 1e-10;  ///< relative

/// lambda M - K, with a unit row for the pin.
BandedMatrix shifted(double lambda, const BandedMatrix& stiffness, const BandedMatrix& mass) {
  BandedMatrix matrix(mass.rows());
  matrix.at(0, 0) = 1.0;
  for (std::size_t i = 1; i < mass.rows(); ++i) {
    for (std::size_t d = 0; d <= kHalfBandwidth; ++d) {
      matrix.at(i, d) = lambda * mass.at(i, d) - stiffness.at(i, d);
    }
  }
  return matrix;
}

/// lambda M - K is positive definite exactly above the largest lambda with det(K - lambda M) = 0.
bool is_above_eigenvalues(double lambda, const BandedMatrix& stiffness, const BandedMatrix& mass) {
  return BandedCholesky(shifted(lambda, stiffness, mass)).positive_definite();
}

double largest_eigenvalue(const BandedMatrix& stiffness, const BandedMatrix& mass) {
  double high = 1.0;
  while (!is_above_eigenvalues(high, stiffness, mass)) {
    high *= 4.0;
    if (!std::isfinite(high)) {
      throw InputError(
          "the stiffness of this model is beyond numbers: E, A, I, rho, k, eta2 and the "
          "lengths are too far apart in magnitude");
    }
  }
  double low = 0.25 * high;
  while (high - low > kEigenvalueAccuracy * high) {
    const double middle = 0.5 * (low + high);
    (is_above_eigenvalues(middle, stiffness, mass) ? high : low) = middle;
  }
  return high;
}

}  // namespace

ElementChain::ElementChain(const ModelParameters& model)
    : gravity_m_s2_(model.g_m_s2),
      mass_per_length_(model.rho_kg_m3 * model.A_m2),
      mass_kg_(mass_per_length_ *
                   std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0) +
               model.tip_mass_kg) {
  validate(model);
  for (const double link_m : model.lengths_m) {
    constants_.push_back(element_constants(link_m / model.elements_per_link,
                                           model.E_Pa * model.A_m2, model.E_Pa * model.I_m4,
                                           mass_per_length_));
  }
}

void ElementChain::add_loads(Eigen::Index rows, double tip_mass_kg) {
  rows_ = rows;
  weight_N_.setZero(rows);
  momentum_kg_.setZero(rows);
  for (const Element& element : elements_) {
    const Eigen::Vector4d load = uniform_load(length_of(element));
    weight_N_(element.row) -= mass_per_length_ * gravity_m_s2_ * load;
    momentum_kg_(element.row) += mass_per_length_ * load;
  }
  weight_N_(tip_row()) -= tip_mass_kg * gravity_m_s2_;
  momentum_kg_(tip_row()) += tip_mass_kg;
}

double ElementChain::length_m() const {
  return tip(at_rest()).x_m;
}

ChainState ElementChain::at_rest() const {
  ChainState state;
  state.q.setZero(2, rows_);
  state.v.setZero(2, rows_);
  double x = 0.0;
  for (const Element& element : elements_) {
    state.q(0, element.row[0]) = x;
    x += length_of(element);
    state.q(0, element.row[1]) = 1.0;
    state.q(0, element.row[2]) = x;
    state.q(0, element.row[3]) = 1.0;
  }
  return state;
}

TipState ElementChain::tip(const ChainState& state) const {
  const auto r = state.q.col(tip_row());
  const auto v = state.v.col(tip_row());
  return {r.x(), r.y(), v.x(), v.y()};
}

double ElementChain::strain_energy_J(const Coordinates& q) const {
  double energy = 0.0;
  for (const Element& element : elements_) {
    energy += strain_energy(coordinates_of(element, q), constants_of(element));
  }
  return energy;
}

Coordinates ElementChain::node_positions_m(const Coordinates& q) const {
  Coordinates nodes(2, static_cast<Eigen::Index>(elements_.size()) + 1);
  nodes.col(0) = q.col(elements_.front().row[0]);
  for (Eigen::Index e = 1; e < nodes.cols(); ++e) {
    nodes.col(e) = q.col(elements_[static_cast<std::size_t>(e - 1)].row[2]);
  }
  return nodes;
}

Chain::Chain(const ModelParameters& model) : ElementChain(model), tip_mass_kg_(model.tip_mass_kg) {
  const auto per_link = static_cast<std::size_t>(model.elements_per_link);
  std::size_t left = 0;  // row of the left node's position; its slope follows
  for (std::size_t link = 0; link < links(); ++link) {
    for (std::size_t e = 1; e <= per_link; ++e) {
      const ElementRows rows = rows_of_element(left, e == per_link && link + 1 < links());
      const auto index = [](std::size_t row) { return static_cast<Eigen::Index>(row); };
      elements_.push_back(
          {{index(rows.p_i), index(rows.s_i), index(rows.p_j), index(rows.s_j)}, link});
      left = rows.p_j;
    }
  }
  add_loads(elements_.back().row[2] + 2, tip_mass_kg_);
  mass_ = BandedMatrix(static_cast<std::size_t>(rows_));
  along_ = mass_;
  mass_.at(0, 0) = 1.0;
  for (const Element& element : elements_) {
    const double length = length_of(element);
    add_element(mass_, element.row, mass_matrix(mass_per_length_, length), 1.0);
    // kappa^2 = r''.r'' counts both directions, so bending stiffness acts along the chain too.
    add_element(along_, element.row, gradient_matrix(length), model.E_Pa * model.A_m2);
    add_element(along_, element.row, bending_matrix(length), model.E_Pa * model.I_m4);
  }
  mass_.at(static_cast<std::size_t>(tip_row()), 0) += tip_mass_kg_;
  balance_.resize(links());
  double beyond_kg = tip_mass_kg_;
  for (std::size_t link = links(); link-- > 0;) {
    const double length = 1.0 / constants_[link].inverse_length;
    beyond_kg += static_cast<double>(per_link) * mass_per_length_ * length;
    balance_[link] = {mass_per_length_ * uniform_load(length)[0], gravity_m_s2_ * beyond_kg};
  }
  mass_factor_ = BandedCholesky(mass_);
  if (!mass_factor_.positive_definite()) {
    throw InputError(
        "the mass matrix of this model is not positive definite: rho, A and the lengths "
        "are too far apart in magnitude");
  }
  free_eigenvalue_ = largest_eigenvalue(along_, mass_);
}

ChainTables<double> Chain::tables() const {
  return {static_cast<std::size_t>(rows_),
          static_cast<std::size_t>(tip_row()),
          links(),
          elements_per_link(),
          constants_.data(),
          mass_factor_.data(),
          weight_N_.data(),
          momentum_kg_.data(),
          balance_.data(),
          &tip_mass_kg_};
}

double Chain::kinetic_energy_J(const Coordinates& v) const {
  return 0.5 * (mass_.quadratic_form(v.data()) + mass_.quadratic_form(v.data() + 1));
}

Eigen::Vector2d Chain::inner_end_force(std::size_t link, const Coordinates& q,
                                       const Coordinates& acceleration) const {
  const Element& element = elements_[link * elements_per_link()];
  const double length = length_of(element);
  Eigen::Vector2d force =
      elastic_gradient(coordinates_of(element, q), constants_of(element)).col(0);
  const Eigen::Vector4d mass = mass_matrix(mass_per_length_, length).col(0);
  for (std::size_t a = 0; a < 4; ++a) {
    force += mass[static_cast<Eigen::Index>(a)] * acceleration.col(element.row[a]);
  }
  force.y() += mass_per_length_ * gravity_m_s2_ * uniform_load(length)[0];
  return force;
}

double Chain::tip_inertia_kg() const {
  Coordinates acceleration = Coordinates::Zero(2, rows_);
  acceleration(0, tip_row()) = 1.0;
  mass_factor_.solve_pairs(acceleration.data());
  return 1.0 / acceleration(0, tip_row());
}

double Chain::highest_frequency_rad_s(double tip_stiffness_N_m) const {
  // Stiffness along the chain gives the highest frequency; stiffness across it is smaller.
  if (tip_stiffness_N_m == 0.0) {
    return std::sqrt(free_eigenvalue_);
  }
  const double risen = risen_eigenvalue(tip_stiffness_N_m);
  BandedMatrix held = along_;
  held.at(static_cast<std::size_t>(tip_row()), 0) += tip_stiffness_N_m;
  if (is_above_eigenvalues((1.0 + kEigenvalueAccuracy) * risen, held, mass_)) {
    return std::sqrt(risen);
  }
  return std::sqrt(largest_eigenvalue(held, mass_));
}

/// The largest eigenvalue with a spring of stiffness s at the tip: the root of
/// 1 / (e^T (lambda M - K)^-1 e) = s above the largest eigenvalue of the free chain. The left side
/// rises with lambda and is concave, so Newton's method stays below the root. Each iterate is the
/// Rayleigh quotient of z = (lambda M - K)^-1 e.
double Chain::risen_eigenvalue(double tip_stiffness_N_m) const {
  constexpr int kMaxSteps = 30;
  const std::size_t tip = 2 * static_cast<std::size_t>(tip_row());
  std::vector<double> z(2 * mass_.rows());
  double lambda = free_eigenvalue_;
  for (int i = 0; i < kMaxSteps; ++i) {
    const BandedCholesky factor(shifted(lambda, along_, mass_));
    if (!factor.positive_definite()) {
      break;
    }
    std::fill(z.begin(), z.end(), 0.0);
    z[tip] = 1.0;
    factor.solve_pairs(z.data());
    const double rise =
        (tip_stiffness_N_m * z[tip] - 1.0) * z[tip] / mass_.quadratic_form(z.data());
    if (!(rise > 0.01 * kEigenvalueAccuracy * lambda)) {
      break;
    }
    lambda += rise;
  }
  return lambda;
}

}  // namespace oblique::solver
