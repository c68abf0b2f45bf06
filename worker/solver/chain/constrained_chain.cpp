#include "worker/solver/chain/constrained_chain.h"

#include "worker/solver/chain/beam_tangent.h"

namespace oblique::solver {
namespace {

PlanarVector<double> pair_at(const Coordinates& values, std::size_t index) {
  return {values[index], values[index + 1]};
}

/// Gradient coefficients of the element whose eight coordinates start at `first`.
GradientCoefficients<double> coefficients(const Coordinates& q, std::size_t first,
                                          double inverse_length) {
  return gradient_coefficients(pair_at(q, first), pair_at(q, first + 2), pair_at(q, first + 4),
                               pair_at(q, first + 6), inverse_length);
}

}  // namespace

ConstrainedChain::ConstrainedChain(const ModelParameters& model) : tip_mass_kg_(model.tip_mass_kg) {
  validate(model);
  const auto n = static_cast<std::size_t>(model.elements_per_link);
  const double mass_per_length = model.rho_kg_m3 * model.A_m2;
  for (const double link_length_m : model.lengths_m) {
    const double length = link_length_m / static_cast<double>(n);
    const std::size_t inner = size_ + 2;
    links_.push_back({size_, inner, inner + 4 * n});
    for (std::size_t e = 0; e < n; ++e) {
      elements_.push_back({inner + 4 * e, 1.0 / length, 0.5 * model.E_Pa * model.A_m2 * length,
                           2.0 * model.E_Pa * model.I_m4 / length,
                           mass_matrix(mass_per_length, length)});
    }
    size_ = inner + 4 * (n + 1);
  }
  gravity_.assign(size_, 0.0);
  for (const Element& element : elements_) {
    const auto load = uniform_load(1.0 / element.inverse_length);
    for (std::size_t a = 0; a < 4; ++a) {
      gravity_[element.first + 2 * a + 1] -= mass_per_length * model.g_m_s2 * load[a];
    }
  }
  gravity_[tip_index() + 1] -= model.tip_mass_kg * model.g_m_s2;
}

ChainState ConstrainedChain::at_rest() const {
  ChainState state;
  state.q.assign(size_, 0.0);
  state.v.assign(size_, 0.0);
  double x = 0.0;
  for (const Element& element : elements_) {
    state.q[element.first] = x;
    state.q[element.first + 2] = 1.0;
    x += 1.0 / element.inverse_length;
    state.q[element.first + 4] = x;
    state.q[element.first + 6] = 1.0;
  }
  return state;
}

TipState ConstrainedChain::tip(const ChainState& state) const {
  const std::size_t i = tip_index();
  return {state.q[i], state.q[i + 1], state.v[i], state.v[i + 1]};
}

ChainState ConstrainedChain::from_eliminated(const ChainState& eliminated) const {
  ChainState state = at_rest();
  state.t_s = eliminated.t_s;
  const auto copy = [&](std::size_t to, std::size_t from) {
    for (std::size_t c = 0; c < 2; ++c) {
      state.q[to + c] = eliminated.q[2 * from + c];
      state.v[to + c] = eliminated.v[2 * from + c];
    }
  };
  std::size_t left = 0;  // row of the inner node's position in the eliminated chain
  for (std::size_t e = 0; e < elements_.size(); ++e) {
    const std::size_t first = elements_[e].first;
    // At a joint the eliminated chain has the inner link's slope before the position.
    const bool ends_at_joint = e + 1 < elements_.size() && elements_[e + 1].first != first + 4;
    const std::size_t right = left + (ends_at_joint ? 3 : 2);
    copy(first, left);
    copy(first + 2, left + 1);
    copy(first + 4, right);
    copy(first + 6, left + (ends_at_joint ? 2 : 3));
    left = right;
  }
  return state;
}

void ConstrainedChain::add_inertia(const Coordinates& acceleration,
                                   std::vector<double>& residual) const {
  for (const Element& element : elements_) {
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        residual[element.first + 2 * a] += element.mass[a][b] * acceleration[element.first + 2 * b];
        residual[element.first + 2 * a + 1] +=
            element.mass[a][b] * acceleration[element.first + 2 * b + 1];
      }
    }
  }
  residual[tip_index()] += tip_mass_kg_ * acceleration[tip_index()];
  residual[tip_index() + 1] += tip_mass_kg_ * acceleration[tip_index() + 1];
}

void ConstrainedChain::add_elastic_and_gravity(const Coordinates& q,
                                               std::vector<double>& residual) const {
  for (std::size_t i = 0; i < size_; ++i) {
    residual[i] -= gravity_[i];
  }
  for (const Element& element : elements_) {
    const auto f = elastic_gradient(coefficients(q, element.first, element.inverse_length),
                                    element.half_EA_length, element.bending);
    const auto map = gradient_map(element.inverse_length);
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t k = 0; k < 3; ++k) {
        residual[element.first + 2 * a] += map[k][a] * f.c[k].x;
        residual[element.first + 2 * a + 1] += map[k][a] * f.c[k].y;
      }
    }
  }
}

void ConstrainedChain::add_constraint_forces(const std::vector<double>& multipliers_N,
                                             std::vector<double>& residual) const {
  for (std::size_t link = 0; link < links_.size(); ++link) {
    for (std::size_t c = 0; c < 2; ++c) {
      residual[links_[link].inner + c] += multipliers_N[2 * link + c];
      if (link > 0) {
        residual[links_[link - 1].outer + c] -= multipliers_N[2 * link + c];
      }
    }
  }
}

void ConstrainedChain::set_constraints(const Coordinates& q, double factor,
                                       std::vector<double>& residual) const {
  for (std::size_t link = 0; link < links_.size(); ++link) {
    for (std::size_t c = 0; c < 2; ++c) {
      const double held = link > 0 ? q[links_[link - 1].outer + c] : 0.0;
      residual[links_[link].multiplier + c] = factor * (q[links_[link].inner + c] - held);
    }
  }
}

void ConstrainedChain::add_tangent(const Coordinates& q, double mass_factor,
                                   double stiffness_factor, Matrix& matrix) const {
  for (const Element& element : elements_) {
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        const double mass = mass_factor * element.mass[a][b];
        matrix.add(element.first + 2 * a, element.first + 2 * b, mass);
        matrix.add(element.first + 2 * a + 1, element.first + 2 * b + 1, mass);
      }
    }
    if (stiffness_factor == 0.0) {
      continue;
    }
    const auto tangent =
        elastic_tangent(coefficients(q, element.first, element.inverse_length),
                        element.inverse_length, element.half_EA_length, element.bending);
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t j = 0; j < 8; ++j) {
        matrix.add(element.first + i, element.first + j, stiffness_factor * tangent[i][j]);
      }
    }
  }
  matrix.add(tip_index(), tip_index(), mass_factor * tip_mass_kg_);
  matrix.add(tip_index() + 1, tip_index() + 1, mass_factor * tip_mass_kg_);
  for (std::size_t link = 0; link < links_.size(); ++link) {
    for (std::size_t c = 0; c < 2; ++c) {
      const std::size_t multiplier = links_[link].multiplier + c;
      matrix.add(multiplier, links_[link].inner + c, 1.0);
      matrix.add(links_[link].inner + c, multiplier, 1.0);
      if (link > 0) {
        matrix.add(multiplier, links_[link - 1].outer + c, -1.0);
        matrix.add(links_[link - 1].outer + c, multiplier, -1.0);
      }
    }
  }
}

void ConstrainedChain::add_stiffness_product(const Coordinates& q, const Coordinates& direction,
                                             std::vector<double>& product) const {
  for (const Element& element : elements_) {
    const auto tangent =
        elastic_tangent(coefficients(q, element.first, element.inverse_length),
                        element.inverse_length, element.half_EA_length, element.bending);
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t j = 0; j < 8; ++j) {
        product[element.first + i] += tangent[i][j] * direction[element.first + j];
      }
    }
  }
}

double ConstrainedChain::kinetic_energy_J(const Coordinates& v) const {
  std::vector<double> momentum(size_, 0.0);
  add_inertia(v, momentum);
  double energy = 0.0;
  for (std::size_t i = 0; i < size_; ++i) {
    energy += 0.5 * momentum[i] * v[i];
  }
  return energy;
}

double ConstrainedChain::strain_energy_J(const Coordinates& q) const {
  double energy = 0.0;
  for (const Element& element : elements_) {
    energy += strain_energy(coefficients(q, element.first, element.inverse_length),
                            element.half_EA_length, element.bending);
  }
  return energy;
}

double ConstrainedChain::gravity_energy_J(const Coordinates& q) const {
  double energy = 0.0;
  for (std::size_t i = 0; i < size_; ++i) {
    energy -= gravity_[i] * q[i];
  }
  return energy;
}

PlanarVector<double> ConstrainedChain::momentum_Ns(const Coordinates& v) const {
  std::vector<double> rows(size_, 0.0);
  add_inertia(v, rows);
  // A rigid shift moves positions and no slope, so the rows of positions add up to the momentum.
  PlanarVector<double> momentum{0.0, 0.0};
  for (const Link& link : links_) {
    for (std::size_t i = link.inner; i <= link.outer; i += 4) {
      momentum.x += rows[i];
      momentum.y += rows[i + 1];
    }
  }
  return momentum;
}

std::vector<PlanarVector<double>> ConstrainedChain::node_positions_m(const Coordinates& q) const {
  std::vector<PlanarVector<double>> nodes{pair_at(q, elements_.front().first)};
  for (const Element& element : elements_) {
    nodes.push_back(pair_at(q, element.first + 4));
  }
  return nodes;
}

}  // namespace oblique::solver
