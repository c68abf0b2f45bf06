#include "worker/solver/chain/chain.h"

#include <cmath>

#include "worker/solver/model/errors.h"

namespace oblique::solver {
namespace {

/// Rows of a chain: the pin's position and slope, two a node, one more at each joint.
std::size_t count_rows(const ModelParameters& model) {
  validate(model);
  const std::size_t links = model.lengths_m.size();
  const auto n = static_cast<std::size_t>(model.elements_per_link);
  return 2 + 2 * n * links + (links - 1);
}

BandedMatrix with_unit_pin(std::size_t rows, double unit) {
  BandedMatrix matrix(rows);
  matrix.at(0, 0) = unit;
  return matrix;
}

void add_element(BandedMatrix& matrix, const std::size_t (&row)[4],
                 const std::array<std::array<double, 4>, 4>& entries, double factor) {
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = 0; b < 4; ++b) {
      if (row[a] != 0 && row[b] != 0) {
        matrix.add(row[a], row[b], factor * entries[a][b]);
      }
    }
  }
}

/// Largest lambda with det(K - lambda M) = 0: lambda M - K is positive definite exactly above it.
double largest_eigenvalue(const BandedMatrix& stiffness, const BandedMatrix& mass) {
  const auto is_above = [&](double lambda) {
    BandedMatrix shifted(mass.rows());
    shifted.at(0, 0) = 1.0;
    for (std::size_t i = 1; i < mass.rows(); ++i) {
      for (std::size_t d = 0; d <= kHalfBandwidth; ++d) {
        shifted.at(i, d) = lambda * mass.at(i, d) - stiffness.at(i, d);
      }
    }
    return BandedCholesky(shifted).positive_definite();
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
  while (high - low > 1e-10 * high) {
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
      weight_N_(rows_, 0.0),
      momentum_kg_(rows_, 0.0),
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
    const auto load = uniform_load(length);
    for (std::size_t a = 0; a < 4; ++a) {
      weight_N_[element.row[a]] -= mass_per_length_ * gravity_m_s2_ * load[a];
      momentum_kg_[element.row[a]] += mass_per_length_ * load[a];
    }
  }
  mass_.at(tip_row(), 0) += model.tip_mass_kg;
  weight_N_[tip_row()] -= model.tip_mass_kg * model.g_m_s2;
  momentum_kg_[tip_row()] += model.tip_mass_kg;
  balance_links(model.tip_mass_kg);
  mass_factor_ = BandedCholesky(mass_);
  if (!mass_factor_.positive_definite()) {
    throw InputError(
        "the mass matrix of this model is not positive definite: rho, A and the lengths "
        "are too far apart in magnitude");
  }
}

void Chain::number_rows(const ModelParameters& model) {
  const int n = model.elements_per_link;
  std::size_t left = 0;  // row of the left node's position; its slope follows
  for (std::size_t link = 0; link < model.lengths_m.size(); ++link) {
    const double length = model.lengths_m[link] / n;
    first_element_.push_back(elements_.size());
    for (int e = 0; e < n; ++e) {
      const bool ends_at_joint = e + 1 == n && link + 1 < model.lengths_m.size();
      Element element{};
      for (std::size_t a = 0; a < 4; ++a) {
        element.row[a] = left + a;
      }
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
  state.q.assign(2 * rows_, 0.0);
  state.v.assign(2 * rows_, 0.0);
  double x = 0.0;
  for (const Element& element : elements_) {
    x += 1.0 / element.inverse_length;
    state.q[2 * element.row[1]] = 1.0;
    state.q[2 * element.row[2]] = x;
    state.q[2 * element.row[3]] = 1.0;
  }
  return state;
}

double Chain::kinetic_energy_J(const Coordinates& v) const {
  return 0.5 *
         (mass_.bilinear(v.data(), v.data(), 2) + mass_.bilinear(v.data() + 1, v.data() + 1, 2));
}

double Chain::strain_energy_J(const Coordinates& q) const {
  const auto at = [&q](std::size_t row) {
    return PlanarVector<double>{q[2 * row], q[2 * row + 1]};
  };
  double energy = 0.0;
  for (const Element& element : elements_) {
    const auto [pi, si, pj, sj] = element.row;
    energy +=
        strain_energy(gradient_coefficients(at(pi), at(si), at(pj), at(sj), element.inverse_length),
                      element.half_EA_length, element.bending);
  }
  return energy;
}

double Chain::gravity_energy_J(const Coordinates& q) const {
  double energy = 0.0;
  for (std::size_t row = 0; row < rows_; ++row) {
    energy -= weight_N_[row] * q[2 * row + 1];
  }
  return energy;
}

PlanarVector<double> Chain::momentum_Ns(const Coordinates& v) const {
  PlanarVector<double> momentum{0.0, 0.0};
  for (std::size_t row = 0; row < rows_; ++row) {
    momentum.x += momentum_kg_[row] * v[2 * row];
    momentum.y += momentum_kg_[row] * v[2 * row + 1];
  }
  return momentum;
}

std::vector<PlanarVector<double>> Chain::node_positions_m(const Coordinates& q) const {
  std::vector<PlanarVector<double>> nodes{{q[0], q[1]}};
  for (const Element& element : elements_) {
    const std::size_t outer = 2 * element.row[2];
    nodes.push_back({q[outer], q[outer + 1]});
  }
  return nodes;
}

TipState Chain::tip(const ChainState& state) const {
  const std::size_t i = 2 * tip_row();
  return {state.q[i], state.q[i + 1], state.v[i], state.v[i + 1]};
}

PlanarVector<double> Chain::inner_end_force(std::size_t link, const Coordinates& q,
                                            const Coordinates& acceleration) const {
  const Element& element = elements_[first_element_.at(link)];
  const auto at = [](const Coordinates& values, std::size_t row) {
    return PlanarVector<double>{values[2 * row], values[2 * row + 1]};
  };
  const auto [pi, si, pj, sj] = element.row;
  const double length = 1.0 / element.inverse_length;
  const auto g =
      gradient_coefficients(at(q, pi), at(q, si), at(q, pj), at(q, sj), element.inverse_length);
  const auto f = elastic_gradient(g, element.half_EA_length, element.bending);
  PlanarVector<double> force{(f.c[2].x - f.c[0].x) * element.inverse_length,
                             (f.c[2].y - f.c[0].y) * element.inverse_length};
  const auto mass = mass_matrix(mass_per_length_, length);
  for (std::size_t b = 0; b < 4; ++b) {
    force.x += mass[0][b] * acceleration[2 * element.row[b]];
    force.y += mass[0][b] * acceleration[2 * element.row[b] + 1];
  }
  force.y += mass_per_length_ * gravity_m_s2_ * uniform_load(length)[0];
  return force;
}

double Chain::highest_frequency_rad_s(double tip_stiffness_N_m) const {
  // Across, the stiffness is the smaller by the axial part, so the highest frequency lies along.
  BandedMatrix held = along_;
  held.at(tip_row(), 0) += tip_stiffness_N_m;
  return std::sqrt(largest_eigenvalue(held, mass_));
}

}  // namespace oblique::solver
