#include "worker/solver/model/relative_cost.h"

#include <algorithm>
#include <cmath>

namespace oblique::solver {
namespace {

/// Work of a step, in elements: those of the chain, and what a step costs on any mesh.
double work_of_step(const ModelParameters& model) {
  constexpr double kOnAnyMesh = 9.0;
  return kOnAnyMesh + static_cast<double>(model.lengths_m.size()) * model.elements_per_link;
}

/// Steps in a contact, but for a factor that meshes share (step_choice.h): they go with
/// omega_tip^(3/4) omega_max^(1/4) tolerance^(-1/4), omega_tip with l^(-1/2) as the tip's inertia
/// has the length l of an element, and omega_max, of bending, with l^-2.
double steps(const ModelParameters& model) {
  const double shortest_m = *std::min_element(model.lengths_m.begin(), model.lengths_m.end());
  const double element_m = shortest_m / model.elements_per_link;
  return std::pow(element_m, -7.0 / 8.0) * std::pow(model.tolerance, -1.0 / 4.0);
}

}  // namespace

std::optional<double> relative_cost(const ModelParameters& model) {
  if (model.integrator != Integrator::kExplicit || model.dt_s != 0.0) {
    return std::nullopt;
  }
  const ModelParameters standard;
  return work_of_step(model) * steps(model) / (work_of_step(standard) * steps(standard));
}

}  // namespace oblique::solver
