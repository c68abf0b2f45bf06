#include "client/plot/point/panels.h"

namespace oblique::client::plot {

EnergyHistory energies_of(const PointHistory& history) {
  EnergyHistory energies;
  double friction_J = 0.0;
  double element_J = 0.0;
  const auto& rows = history.rows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto& row = rows[i];
    const auto& before = rows[i == 0 ? 0 : i - 1];
    const double fn_N = 0.5 * (before.fn_N + row.fn_N);
    const double ft_N = 0.5 * (before.ft_N + row.ft_N);
    // What the tip gives is work against both forces; what P takes of it is lost.
    const double lost_J = -ft_N * (row.xP_m - before.xP_m);
    friction_J += lost_J;
    element_J += -fn_N * (row.y_m - before.y_m) - ft_N * (row.x_m - before.x_m) - lost_J;
    energies.kinetic.push_back(row.kinetic_J - rows.front().kinetic_J);
    energies.strain.push_back(row.strain_J - rows.front().strain_J);
    energies.gravity.push_back(row.gravity_J - rows.front().gravity_J);
    energies.friction.push_back(friction_J);
    energies.element.push_back(element_J);
  }
  return energies;
}

}  // namespace oblique::client::plot
