#include "worker/solver/chain/constrained_chain.h"

#include <array>

namespace oblique::solver {
namespace {

/// Index of a column's x among the unknowns one by one.
std::size_t unknown(Eigen::Index column) {
  return 2 * static_cast<std::size_t>(column);
}

}  // namespace

ConstrainedChain::ConstrainedChain(const ModelParameters& model) : tip_mass_kg_(model.tip_mass_kg) {
  validate(model);
  const Eigen::Index n = model.elements_per_link;
  const double mass_per_length = model.rho_kg_m3 * model.A_m2;
  for (const double link_length_m : model.lengths_m) {
    const double length = link_length_m / static_cast<double>(n);
    const Eigen::Index inner = columns_ + 1;
    links_.push_back({columns_, inner, inner + 2 * n});
    for (Eigen::Index e = 0; e < n; ++e) {
      elements_.push_back({inner + 2 * e, 1.0 / length, 0.5 * model.E_Pa * model.A_m2 * length,
                           2.0 * model.E_Pa * model.I_m4 / length, gradient_map(1.0 / length),
                           mass_matrix(mass_per_length, length)});
    }
    columns_ = inner + 2 * (n + 1);
  }
  gravity_.setZero(2, columns_);
  for (const Element& element : elements_) {
    gravity_.row(1).segment<4>(element.first) -=
        mass_per_length * model.g_m_s2 * uniform_load(1.0 / element.inverse_length);
  }
  gravity_(1, tip_column()) -= model.tip_mass_kg * model.g_m_s2;
}

ChainState ConstrainedChain::at_rest() const {
  ChainState state;
  state.q.setZero(2, columns_);
  state.v.setZero(2, columns_);
  double x = 0.0;
  for (const Element& element : elements_) {
    const double next = x + 1.0 / element.inverse_length;
    state.q.row(0).segment<4>(element.first) << x, 1.0, next, 1.0;
    x = next;
  }
  return state;
}

TipState ConstrainedChain::tip(const ChainState& state) const {
  const auto r = state.q.col(tip_column());
  const auto v = state.v.col(tip_column());
  return {r.x(), r.y(), v.x(), v.y()};
}

ChainState ConstrainedChain::from_eliminated(const ChainState& eliminated) const {
  ChainState state = at_rest();
  state.t_s = eliminated.t_s;
  Eigen::Index left = 0;  // row of the inner node's position in the eliminated chain
  for (std::size_t e = 0; e < elements_.size(); ++e) {
    const Eigen::Index first = elements_[e].first;
    // At a joint the eliminated chain has the inner link's slope before the position.
    const bool ends_at_joint = e + 1 < elements_.size() && elements_[e + 1].first != first + 2;
    const Eigen::Index right = left + (ends_at_joint ? 3 : 2);
    const std::array<Eigen::Index, 4> row{left, left + 1, right, left + (ends_at_joint ? 2 : 3)};
    state.q.middleCols<4>(first) = eliminated.q(Eigen::all, row);
    state.v.middleCols<4>(first) = eliminated.v(Eigen::all, row);
    left = right;
  }
  return state;
}

GradientCoefficients ConstrainedChain::gradient(const Element& element, const Coordinates& q) {
  return gradient_coefficients(q.middleCols<4>(element.first), element.inverse_length);
}

ElementTangent ConstrainedChain::stiffness(const Element& element, const Coordinates& q) {
  return elastic_tangent(gradient(element, q), element.B, element.half_EA_length, element.bending);
}

void ConstrainedChain::add_inertia(const Coordinates& acceleration, Coordinates& residual) const {
  for (const Element& element : elements_) {
    residual.middleCols<4>(element.first) += acceleration.middleCols<4>(element.first) * element.M;
  }
  residual.col(tip_column()) += tip_mass_kg_ * acceleration.col(tip_column());
}

void ConstrainedChain::add_elastic_and_gravity(const Coordinates& q, Coordinates& residual) const {
  residual -= gravity_;
  for (const Element& element : elements_) {
    residual.middleCols<4>(element.first) +=
        elastic_gradient(gradient(element, q), element.half_EA_length, element.bending) * element.B;
  }
}

void ConstrainedChain::add_constraint_forces(const Coordinates& multipliers_N,
                                             Coordinates& residual) const {
  for (Eigen::Index link = 0; link < links(); ++link) {
    residual.col(at(link).inner) += multipliers_N.col(link);
    if (link > 0) {
      residual.col(at(link - 1).outer) -= multipliers_N.col(link);
    }
  }
}

void ConstrainedChain::set_constraints(const Coordinates& q, double factor,
                                       Coordinates& residual) const {
  residual.col(at(0).multiplier) = factor * q.col(at(0).inner);
  for (Eigen::Index link = 1; link < links(); ++link) {
    residual.col(at(link).multiplier) =
        factor * (q.col(at(link).inner) - q.col(at(link - 1).outer));
  }
}

void ConstrainedChain::take_multipliers(Coordinates& unknowns, Coordinates& multipliers) const {
  multipliers.resize(2, links());
  for (Eigen::Index link = 0; link < links(); ++link) {
    multipliers.col(link) = unknowns.col(at(link).multiplier);
    unknowns.col(at(link).multiplier).setZero();
  }
}

void ConstrainedChain::add_tangent(const Coordinates& q, double mass_factor,
                                   double stiffness_factor, Matrix& matrix) const {
  const auto add_to_both = [&matrix](Eigen::Index row, Eigen::Index column, double value) {
    matrix.add(unknown(row), unknown(column), value);
    matrix.add(unknown(row) + 1, unknown(column) + 1, value);
  };
  for (const Element& element : elements_) {
    ElementTangent tangent = in_both_directions(mass_factor * element.M);
    if (stiffness_factor != 0.0) {
      tangent += stiffness_factor * stiffness(element, q);
    }
    matrix.add_block(unknown(element.first), unknown(element.first), tangent);
  }
  add_to_both(tip_column(), tip_column(), mass_factor * tip_mass_kg_);
  for (Eigen::Index link = 0; link < links(); ++link) {
    const auto [multiplier, inner, outer] = at(link);
    add_to_both(multiplier, inner, 1.0);
    add_to_both(inner, multiplier, 1.0);
    if (link > 0) {
      add_to_both(multiplier, at(link - 1).outer, -1.0);
      add_to_both(at(link - 1).outer, multiplier, -1.0);
    }
  }
}

void ConstrainedChain::add_stiffness_product(const Coordinates& q, const Coordinates& direction,
                                             Coordinates& product) const {
  for (const Element& element : elements_) {
    const ElementCoordinates dq = direction.middleCols<4>(element.first);
    const Eigen::Vector<double, 8> df = stiffness(element, q) * dq.reshaped();
    product.middleCols<4>(element.first) += df.reshaped<Eigen::AutoOrder>(2, 4);
  }
}

double ConstrainedChain::kinetic_energy_J(const Coordinates& v) const {
  Coordinates momentum = Coordinates::Zero(2, columns_);  // M v
  add_inertia(v, momentum);
  return 0.5 * v.cwiseProduct(momentum).sum();
}

double ConstrainedChain::strain_energy_J(const Coordinates& q) const {
  double energy = 0.0;
  for (const Element& element : elements_) {
    energy += strain_energy(gradient(element, q), element.half_EA_length, element.bending);
  }
  return energy;
}

double ConstrainedChain::gravity_energy_J(const Coordinates& q) const {
  return -gravity_.cwiseProduct(q).sum();
}

Eigen::Vector2d ConstrainedChain::momentum_Ns(const Coordinates& v) const {
  Coordinates momentum = Coordinates::Zero(2, columns_);
  add_inertia(v, momentum);
  // A rigid shift moves positions and no slope, so the columns of positions add up to the momentum.
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Link& link : links_) {
    for (Eigen::Index column = link.inner; column <= link.outer; column += 2) {
      sum += momentum.col(column);
    }
  }
  return sum;
}

Coordinates ConstrainedChain::node_positions_m(const Coordinates& q) const {
  Coordinates nodes(2, static_cast<Eigen::Index>(elements_.size()) + 1);
  nodes.col(0) = q.col(elements_.front().first);
  for (Eigen::Index e = 1; e < nodes.cols(); ++e) {
    nodes.col(e) = q.col(elements_[static_cast<std::size_t>(e - 1)].first + 2);
  }
  return nodes;
}

}  // namespace oblique::solver
