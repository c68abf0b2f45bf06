#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/plot/point/history.h"
#include "client/plot/sheets/sheet.h"

namespace oblique::client::plot {

/// What pictures of a point show.
enum class PointPanel { kForces, kLoop, kDeformation, kVelocities, kEnergies, kShape };
inline constexpr std::array<std::string_view, 6> kPointPanels{
    "forces", "loop", "deformation", "velocities", "energies", "shape"};

/// The panels of that name; empty: none, for all. Throws solver::InputError for another name.
std::optional<PointPanel> point_panel_named(const std::string& name);

/// One panel, or all. Its title is the point, its subtitle its values and outcome, its notes what
/// is not to be seen in it.
Sheet sheet_of(const PointHistory& history, std::optional<PointPanel> panel);

/// One panel with its title. `is_first`: it names the shadings in its legend.
Figure figure_of(const PointHistory& history, PointPanel panel, bool names_spans);

/// What became of the energy that the finger gives to the contact, from touch on [J]. Sums of
/// trapezia over the positions of tip and P: exact for the normal element and while P sticks.
struct EnergyHistory {
  std::vector<double> kinetic;   ///< change
  std::vector<double> strain;    ///< change
  std::vector<double> gravity;   ///< change
  std::vector<double> friction;  ///< lost at P
  std::vector<double> element;   ///< stored in the contact, and lost in its restitution
};
EnergyHistory energies_of(const PointHistory& history);

/// The finger at rest, falling, at touch and at separation, and the ground.
Panel shape_panel(const PointHistory& history);
/// "Between touch and separation no node moves by more than 3.1 mm."
std::string shape_note(const PointHistory& history);

}  // namespace oblique::client::plot
