#include "worker/solver/reference/constrained_chain.h"

namespace oblique::solver {

ConstrainedChain::ConstrainedChain(const ModelParameters& model)
    : ElementChain(model), tip_mass_kg_(model.tip_mass_kg) {
  const Eigen::Index n = model.elements_per_link;
  Eigen::Index row = 0;
  for (std::size_t link = 0; link < links(); ++link) {
    joints_.push_back({row, row + 1, row - 2});
    for (Eigen::Index e = 0; e < n; ++e) {
      const Eigen::Index first = row + 1 + 2 * e;
      elements_.push_back({{first, first + 1, first + 2, first + 3}, link});
    }
    row += 1 + 2 * (n + 1);
  }
  joints_.front().before = -1;
  add_loads(row, tip_mass_kg_);
}

void ConstrainedChain::add_inertia(const Coordinates& acceleration, Coordinates& residual) const {
  for (const Element& element : elements_) {
    residual.middleCols<4>(element.row[0]) +=
        acceleration.middleCols<4>(element.row[0]) * mass_of(element);
  }
  residual.col(tip_row()) += tip_mass_kg_ * acceleration.col(tip_row());
}

void ConstrainedChain::add_elastic_and_gravity(const Coordinates& q, Coordinates& residual) const {
  residual.row(1) -= weight_N_.transpose();
  for (const Element& element : elements_) {
    residual.middleCols<4>(element.row[0]) +=
        elastic_gradient(coordinates_of(element, q), constants_of(element));
  }
}

void ConstrainedChain::add_constraint_forces(const Coordinates& multipliers_N,
                                             Coordinates& residual) const {
  for (std::size_t link = 0; link < links(); ++link) {
    const auto lambda = multipliers_N.col(static_cast<Eigen::Index>(link));
    residual.col(joints_[link].position) += lambda;
    if (link > 0) {
      residual.col(joints_[link].before) -= lambda;
    }
  }
}

void ConstrainedChain::set_constraints(const Coordinates& q, double factor,
                                       Coordinates& residual) const {
  residual.col(joints_[0].multiplier) = factor * q.col(joints_[0].position);
  for (std::size_t link = 1; link < links(); ++link) {
    const Joint& joint = joints_[link];
    residual.col(joint.multiplier) = factor * (q.col(joint.position) - q.col(joint.before));
  }
}

Coordinates ConstrainedChain::take_multipliers(Coordinates& unknowns) const {
  Coordinates multipliers(2, static_cast<Eigen::Index>(links()));
  for (std::size_t link = 0; link < links(); ++link) {
    multipliers.col(static_cast<Eigen::Index>(link)) = unknowns.col(multiplier_row(link));
    unknowns.col(multiplier_row(link)).setZero();
  }
  return multipliers;
}

void ConstrainedChain::add_tangent(const Coordinates& q, double mass_factor,
                                   double stiffness_factor, Matrix& matrix) const {
  const auto unknown = [](Eigen::Index row) { return 2 * static_cast<std::size_t>(row); };
  const auto add_to_both = [&](Eigen::Index row, Eigen::Index column, double value) {
    matrix.add(unknown(row), unknown(column), value);
    matrix.add(unknown(row) + 1, unknown(column) + 1, value);
  };
  for (const Element& element : elements_) {
    ElementTangent tangent = in_both_directions(mass_factor * mass_of(element));
    if (stiffness_factor != 0.0) {
      tangent +=
          stiffness_factor * elastic_tangent(coordinates_of(element, q), constants_of(element));
    }
    matrix.add_block(unknown(element.row[0]), tangent);
  }
  add_to_both(tip_row(), tip_row(), mass_factor * tip_mass_kg_);
  for (const Joint& joint : joints_) {
    add_to_both(joint.multiplier, joint.position, 1.0);
    add_to_both(joint.position, joint.multiplier, 1.0);
    if (joint.before >= 0) {
      add_to_both(joint.multiplier, joint.before, -1.0);
      add_to_both(joint.before, joint.multiplier, -1.0);
    }
  }
}

void ConstrainedChain::add_stiffness_product(const Coordinates& q, const Coordinates& direction,
                                             Coordinates& product) const {
  for (const Element& element : elements_) {
    const ElementCoordinates dq = coordinates_of(element, direction);
    const Eigen::Vector<double, 8> df =
        elastic_tangent(coordinates_of(element, q), constants_of(element)) * dq.reshaped();
    product.middleCols<4>(element.row[0]) += df.reshaped<Eigen::AutoOrder>(2, 4);
  }
}

double ConstrainedChain::kinetic_energy_J(const Coordinates& v) const {
  Coordinates momentum = Coordinates::Zero(2, rows_);  // M v
  add_inertia(v, momentum);
  return 0.5 * v.cwiseProduct(momentum).sum();
}

}  // namespace oblique::solver
