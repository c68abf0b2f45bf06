#include "worker/solver/chain/chain.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "worker/solver/model/errors.h"

namespace oblique::solver {
namespace {

/// Rows of a chain: the pin's position and slope, two a node, one more at each joint.
Eigen::Index count_rows(const ModelParameters& model) {
  validate(model);
  const auto links = static_cast<Eigen::Index>(model.lengths_m.size());
  const Eigen::Index n = model.elements_per_link;
  return 2 + 2 * n * links + (links - 1);
}

BandedMatrix with_unit_pin(Eigen::Index rows, double unit) {
  BandedMatrix matrix(static_cast<std::size_t>(rows));
  matrix.at(0, 0) = unit;
  return matrix;
}

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
  const auto is_above = [&](double lambda) {
    return is_above_eigenvalues(lambda, stiffness, mass);
  };
  double high = 1.0;
  while (!is_above(high)) {
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
    (is_above(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace

Chain::Chain(const ModelParameters& model)
    : rows_(count_rows(model)),
      gravity_m_s2_(model.g_m_s2),
      mass_per_length_(model.rho_kg_m3 * model.A_m2),
      weight_N_(Eigen::VectorXd::Zero(rows_)),
      momentum_kg_(Eigen::VectorXd::Zero(rows_)),
      mass_(with_unit_pin(rows_, 1.0)),
      mass_factor_(BandedMatrix(0)),
      along_(with_unit_pin(rows_, 0.0)) {
  number_rows(model);
  for (const Element& element : elements_) {
    const double length = 1.0 / element.inverse_length;
    add_element(mass_, element.row, mass_matrix(mass_per_length_, length), 1.0);
    // kappa^2 = r''.r'' counts both directions, so bending stiffness acts along the chain too.
    add_element(along_, element.row, gradient_matrix(length), model.E_Pa * model.A_m2);
    add_element(along_, element.row, bending_matrix(length), model.E_Pa * model.I_m4);
    const Eigen::Vector4d load = uniform_load(length);
    weight_N_(element.row) -= mass_per_length_ * gravity_m_s2_ * load;
    momentum_kg_(element.row) += mass_per_length_ * load;
  }
  mass_.at(static_cast<std::size_t>(tip_row()), 0) += model.tip_mass_kg;
  weight_N_(tip_row()) -= model.tip_mass_kg * model.g_m_s2;
  momentum_kg_(tip_row()) += model.tip_mass_kg;
  balance_links(model.tip_mass_kg);
  mass_factor_ = BandedCholesky(mass_);
  if (!mass_factor_.positive_definite()) {
    throw InputError(
        "the mass matrix of this model is not positive definite: rho, A and the lengths "
        "are too far apart in magnitude");
  }
  free_eigenvalue_ = largest_eigenvalue(along_, mass_);
}

void Chain::number_rows(const ModelParameters& model) {
  const int n = model.elements_per_link;
  Eigen::Index left = 0;  // row of the left node's position; its slope follows
  for (std::size_t link = 0; link < model.lengths_m.size(); ++link) {
    const double length = model.lengths_m[link] / n;
    first_element_.push_back(elements_.size());
    for (int e = 0; e < n; ++e) {
      const bool ends_at_joint = e + 1 == n && link + 1 < model.lengths_m.size();
      Element element{};
      std::iota(element.row.begin(), element.row.end(), left);
      if (ends_at_joint) {
        std::swap(element.row[2], element.row[3]);  // slope of the inner link, then the position
      }
      element.inverse_length = 1.0 / length;
      element.half_EA_length = 0.5 * model.E_Pa * model.A_m2 * length;
      element.bending = 2.0 * model.E_Pa * model.I_m4 / length;
      elements_.push_back(element);
      left = element.row[2];
    }
    const Element& last = elements_.back();
    constants_.push_back(elastic_constants(length, last.half_EA_length, last.bending));
  }
}

void Chain::balance_links(double tip_mass_kg) {
  balance_.resize(links());
  double beyond_kg = tip_mass_kg;
  const std::size_t elements_per_link = elements_.size() / links();
  for (std::size_t link = links(); link-- > 0;) {
    const double length = 1.0 / elements_[first_element_[link]].inverse_length;
    beyond_kg += static_cast<double>(elements_per_link) * mass_per_length_ * length;
    balance_[link] = {mass_per_length_ * uniform_load(length)[0], gravity_m_s2_ * beyond_kg};
  }
}

ChainState Chain::at_rest() const {
  ChainState state;
  state.q.setZero(2, rows_);
  state.v.setZero(2, rows_);
  double x = 0.0;
  for (const Element& element : elements_) {
    x += 1.0 / element.inverse_length;
    state.q(0, element.row[1]) = 1.0;
    state.q(0, element.row[2]) = x;
    state.q(0, element.row[3]) = 1.0;
  }
  return state;
}

GradientCoefficients Chain::gradient(const Element& element, const Coordinates& q) {
  return gradient_coefficients(q(Eigen::all, element.row), element.inverse_length);
}

double Chain::kinetic_energy_J(const Coordinates& v) const {
  return 0.5 *
         (mass_.bilinear(v.data(), v.data(), 2) + mass_.bilinear(v.data() + 1, v.data() + 1, 2));
}

double Chain::strain_energy_J(const Coordinates& q) const {
  double energy = 0.0;
  for (const Element& element : elements_) {
    energy += strain_energy(gradient(element, q), element.half_EA_length, element.bending);
  }
  return energy;
}

double Chain::gravity_energy_J(const Coordinates& q) const {
  return -q.row(1).dot(weight_N_);
}

Eigen::Vector2d Chain::momentum_Ns(const Coordinates& v) const {
  return v * momentum_kg_;
}

Coordinates Chain::node_positions_m(const Coordinates& q) const {
  Coordinates nodes(2, static_cast<Eigen::Index>(elements_.size()) + 1);
  nodes.col(0) = q.col(0);
  for (Eigen::Index e = 1; e < nodes.cols(); ++e) {
    nodes.col(e) = q.col(elements_[static_cast<std::size_t>(e - 1)].row[2]);
  }
  return nodes;
}

TipState Chain::tip(const ChainState& state) const {
  const auto r = state.q.col(tip_row());
  const auto v = state.v.col(tip_row());
  return {r.x(), r.y(), v.x(), v.y()};
}

Eigen::Vector2d Chain::inner_end_force(std::size_t link, const Coordinates& q,
                                       const Coordinates& acceleration) const {
  const Element& element = elements_[first_element_.at(link)];
  const double length = 1.0 / element.inverse_length;
  const GradientCoefficients f =
      elastic_gradient(gradient(element, q), element.half_EA_length, element.bending);
  // The first column of (dU/dC) B, and of Q'' M.
  Eigen::Vector2d force = (f.col(2) - f.col(0)) * element.inverse_length;
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
  // Across, the stiffness is the smaller by the axial part, so the highest frequency lies along.
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

/// Where a spring of that stiffness s at the tip lifts the largest eigenvalue to. It is the root of
/// 1 / (e^T (lambda M - K)^-1 e) = s above that of the free chain. The left side rises with lambda
/// and is concave, so Newton's steps stay below the root; each is the Rayleigh quotient of
/// z = (lambda M - K)^-1 e, so it errs by no more than it is below.
double Chain::risen_eigenvalue(double tip_stiffness_N_m) const {
  constexpr int kMostSteps = 30;
  const std::size_t tip = 2 * static_cast<std::size_t>(tip_row());
  std::vector<double> z(2 * mass_.rows());
  double lambda = free_eigenvalue_;
  for (int i = 0; i < kMostSteps; ++i) {
    const BandedCholesky factor(shifted(lambda, along_, mass_));
    if (!factor.positive_definite()) {
      break;
    }
    std::fill(z.begin(), z.end(), 0.0);
    z[tip] = 1.0;
    factor.solve_pairs(z.data());
    const double rise =
        (tip_stiffness_N_m * z[tip] - 1.0) * z[tip] / mass_.bilinear(z.data(), z.data(), 2);
    if (!(rise > 0.01 * kEigenvalueAccuracy * lambda)) {
      break;
    }
    lambda += rise;
  }
  return lambda;
}

}  // namespace oblique::solver
